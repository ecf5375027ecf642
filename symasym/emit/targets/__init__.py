"""The languages that code is emitted in: a renderer each, ``to_X.render(program, functions)``.

`symasym.emit.source` has the table of them; the syntax of a language's calls is a `Dialect` of
`symasym.derivation.code`. docs/extending.md adds one.
"""
