"""Asymptotic expansions of int g(x) e^(lam f(x)) dx for large lam."""
