"""Proved bounds of T, C and 1 - P, for one noise or for all noise below a given one.

`enclosures` (T and 1 - P for weak noise, from `cells` of [-r, r]) and `exit_bounds` (C, of one
scene in balls and of arrays in intervals of float64, from `layer_bounds`) hold at one lam;
`all_noise`, with `dominance`, states one for every kappa below
kappa_0, which `range_bound` hands out (`sa.weak_noise_bound`). docs/proved.md lists every claim
with its theorem and arithmetic.
"""
