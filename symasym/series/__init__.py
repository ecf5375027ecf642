"""Truncated power series, and local expansions of Laplace-type integrals, over any ring."""
