"""Drifts that are ready-made: friction, and the smoothings of a switch."""
