"""Expansions of T, C and 1 - P for weak noise, in powers of kappa^2/2: ``method="laplace"``.

`answer` is asked, and chooses the order, and between a proved bound and an estimate; `arrays`
expands in float64, one scene like many. `one_sided` makes the one-sided expansions over an
arithmetic, with what `critical_points` adds for one drift to any digits; `regular_part` has
Hadamard's finite parts, `series` those in 1/lam, `compose` S, D, T and C from two sides, at lam.
Laplace's method for one integral of your own is `symasym.asymptotics.laplace`.
"""
