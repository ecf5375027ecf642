"""The command line: a table of commands (`main`), and what carries them out."""
