"""Section 6: expansions for small and for large noise."""
