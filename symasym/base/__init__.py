"""Modules used by all others: input, ball arithmetic, errors, estimates, and output of files."""
