"""Checks, measurements and figures of symasym; only the commands import them."""
