"""Arithmetics and what is built on them: balls, double-doubles, power series, polynomials."""
