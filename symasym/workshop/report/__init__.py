"""Error against run time: our methods and the peers that are installed.

The layers, each importing only those before it: `timing`, `peers`, `methods` (scenes, and what is
run on them), `measure` (points and cells), `growth`; `diagrams`, `pages` (what is shown, and the
files); `write` and `stability` (the two reports).
"""
