"""Expansions of T, C and P; each formula is coded once, generic over the arithmetic."""
