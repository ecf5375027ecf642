"""Integrals of g(x) e^(lam f(x)) of one's own, by Laplace's method."""
