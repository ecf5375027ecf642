"""Proved bounds of C and T, for one noise or for all noise below a given one."""
