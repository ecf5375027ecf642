"""The languages that code is emitted in."""
