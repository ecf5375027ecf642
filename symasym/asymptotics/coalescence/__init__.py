"""Uniform expansions of one integral: coalescing saddles, a saddle near an end.

`integral` is `sa.uniform_integral`; `cubic_map` and `saddle_pair` (Airy functions), `endpoints`
(Bleistein's error functions), `iterated` (double integrals), `result` (the sum and its error). The
escape time of a drift through a coalescence is `symasym.asymptotics.uniform`.
"""
