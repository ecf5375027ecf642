"""Expansions: numbers of any order (`answer`, `strong_noise`), and formulas (`expansion`)."""
