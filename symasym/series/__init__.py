"""Power series and what bounds them: truncated, formal, Taylor models; quadratic factors."""
