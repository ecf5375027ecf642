"""The drift, its potential and Taylor coefficients as numbers; scenes of one drift or of many."""
