"""T and 1 - P of a drift through the coalescence of wells, barriers, starts and ends.

`answer` is asked, adds up, and estimates the error from the next orders. To every order:
`coalescing_pair` (which critical points are taken together; Chester-Friedman-Ursell) and
`truncated_gaussian` (Bleistein). Order 0 of polynomial A, without cancellation and with an error of
its own: `order_zero` and `order_zero_forms` over floats or digits; `pairing_arrays` finds the
structure of arrays, `structure` that of one drift. `structure` and the closed forms of
`order_zero_forms` are what `symasym.emit` writes as well. One integral of your own with coalescing
saddles is `symasym.asymptotics.coalescence`.
"""
