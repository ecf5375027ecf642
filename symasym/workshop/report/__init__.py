"""Error against run time: our methods and the peers that are installed.

The layers, each importing only those before it: `timing`, `peers`, `scenes`, `methods`
(what is run), `measure` (points), `growth`, `cells`; `diagrams`, `pages` (what is shown),
`publish` (the files); `write` and `stability` (the two reports).
"""
