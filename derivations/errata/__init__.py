"""Where the paper's print differs from what is derived, with evidence that is evaluated."""
