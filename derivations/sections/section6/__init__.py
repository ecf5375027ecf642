"""Section 6: sliding, crossing with strong and with weak noise, and the expansions evaluated."""
