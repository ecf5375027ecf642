"""Error against run time: our methods and the peers that are installed.

The layers, each importing only those before it: `timing` (and growth), `peers`, `measure` (scenes,
what is run on them, points and cells); `diagrams`, `pages` (what is shown, and the files of the
report of error against run time); `stability` (the other report).
"""
