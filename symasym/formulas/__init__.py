"""Expansions as formulas, with the drift's parameters free."""
