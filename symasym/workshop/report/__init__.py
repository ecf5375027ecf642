"""Error against run time: our methods and the peers that are installed.

The layers, each importing only those before it: `timing`, `peers`, `scenes`, `methods`
(what is run), `measure` (points), `growth`, `stability`; `diagrams`, `pages` (what is shown);
`write` (the files).
"""
