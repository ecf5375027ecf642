"""The drift phi of a smoothed switch: formula, landscape of its potential, Taylor series."""
