"""T, C, P and the density as exact integrals, by sweeps from both ends (`positive-form`).

`sweep` carries S and the nested integral over one panel (`carried`, which the derivation
`panel-step` emitted) and joins the two sweeps at the start, once for every arithmetic. The
integrals over a panel are found in three ways that share no code: `floats` with `float_blocks`
(which panels), `float_records` (their bisection) and `float_panels` (Gauss samples, slow layers)
for arrays of float64; `digits` with `digit_panels` (Taylor recurrences) to any number of digits;
`balls.sweep` with `balls.panels` (Taylor models) as proved enclosures. `balls.derivatives` and
`digit_derivatives` differentiate the sweeps of balls and digits for `sa.sensitivity`; that of
float64 carries its slopes along (`symasym.numbers.float_arrays`).
"""
