"""The derivations, one module a subject, named after the section of the paper that it is in."""
