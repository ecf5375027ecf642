"""Expansions for strong noise, in powers of 2/kappa^2."""
