"""Numbers of the exact integrals, four ways that share no code."""
