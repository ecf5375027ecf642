"""Laplace's method for one integral of g e^(lam f): maxima, Watson's lemma, proved remainders.

`integral` is `sa.laplace_integral`. The escape times of ``method="laplace"`` are
`symasym.asymptotics.weak_noise`.
"""
