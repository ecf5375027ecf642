"""Section 5: the steady state, the mean escape time, and both in positive terms."""
