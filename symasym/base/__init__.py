"""Used by every room: reading input, errors, estimates, files, progress, executors."""
