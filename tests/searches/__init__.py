"""Searches for what the package promises not to do: long runs, of which the tests take a sample."""
