"""T, C, P and the stationary density as exact integrals, by sweeps from both ends to the start.

`balls` gives any number of digits, proved; `floats` float64 arrays. Theorem and symbols: `balls`.
"""
