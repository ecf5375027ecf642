"""Expansions as symbolic formulas in the parameters of the drift."""
