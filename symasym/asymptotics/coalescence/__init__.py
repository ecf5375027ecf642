"""Uniform expansions: coalescing saddles (Chester-Friedman-Ursell), saddle near an end."""
