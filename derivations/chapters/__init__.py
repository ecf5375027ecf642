"""The sections of the paper as equations, one module a section."""
