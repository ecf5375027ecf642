/*
 * eq:V: The potential, for sa.friction().
 * Error of the formula: exact.
 * In double precision.
 * Written by symasym.
 */
#ifndef SYMASYM_V_H
#define SYMASYM_V_H

/* The potential, V(-1) = 0 (eq:V). */
/* NAN where u is not a number. */
double V(double u, double mu, double alpha, double z0);

#endif
