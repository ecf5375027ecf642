"""Laplace's method for the integral of g e^(lam f): maxima, Watson's lemma, proved remainders."""
