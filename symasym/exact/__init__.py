"""T, C, P and the stationary density as exact integrals: sigma' = 1 + lam phi sigma, Q' = sigma.

Swept from both ends to the start: `balls` to any number of digits, proved; `floats` over arrays.
"""
