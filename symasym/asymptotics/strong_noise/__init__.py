"""T, C, P and their complements for strong noise, in powers of 2/kappa^2.

`answer` is asked for one scene, `arrays` for many. `moments` has the iterated integrals of powers
of V over the layer, `sweep` composes them with the constant drifts outside; the tail of the
exponential series on [-1, 1] is bounded, so that the error is proved.
"""
