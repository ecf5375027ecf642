"""Helper functions that are written into emitted files."""
