"""Answers kept from before a rebuilding, and the comparison with them."""
