"""Expansions of T, C and P for weak and strong noise, one text each over any ring."""
