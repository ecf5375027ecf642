"""The command line: its parser and table of commands (`main`), and the commands (`verbs`)."""
