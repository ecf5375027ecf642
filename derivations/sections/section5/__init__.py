"""Section 5: the mean escape time and the stationary density."""
