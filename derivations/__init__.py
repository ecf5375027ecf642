"""The paper's equations, derived and machine-checked: one module per section.

``python -m derivations`` checks all of them; ``symasym.formula(label)`` builds one.
"""
