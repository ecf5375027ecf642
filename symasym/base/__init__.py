"""Used by every subpackage: reading input, errors, estimates, files, progress, executors."""
