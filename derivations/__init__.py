"""The paper's equations, derived and machine-checked: one module per section.

``python -m derivations`` runs all; `derivations.registry` builds one, and
`derivations.runner` runs those that are asked for and those they rest on.
"""
