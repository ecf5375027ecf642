"""Reference tables of a grid of exact values."""
