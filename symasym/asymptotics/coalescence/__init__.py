"""Uniform expansions of one integral: coalescing saddles, a saddle near an end.

`integral` is `sa.uniform_integral`; `cubic_map` the canonical Airy form, `parts` those of the sum
(Airy functions; Bleistein's error functions), `iterated` (double integrals), `result` (the sum and
its error). The escape time of a drift through a coalescence is `symasym.asymptotics.uniform`.
"""
