"""Expansions and bounds: strong noise, weak noise, and two-sided inequalities."""
