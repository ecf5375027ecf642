"""Used by every room: reading input, balls, errors, estimates and their texts, files, progress."""
