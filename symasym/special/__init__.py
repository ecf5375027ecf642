"""Special functions: products of Airy functions and Dawson's integral, in float64 and in digits."""
