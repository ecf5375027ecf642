"""The command line, one module a command; those of the workshop together."""
