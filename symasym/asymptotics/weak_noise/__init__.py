"""Expansions of T, C and 1 - P for weak noise, in powers of kappa^2/2."""
