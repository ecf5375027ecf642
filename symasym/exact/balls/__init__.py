"""T, C, P and the density as proved balls, by Taylor models (python-flint)."""
