"""Checks, measurements and figures; only the commands import this package."""
