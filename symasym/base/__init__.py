"""What every room uses: reading input, errors, estimates, files, progress, executors."""
