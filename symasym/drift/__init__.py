"""The drift phi of a smoothed switch: its formula, its potential and its Taylor series."""
