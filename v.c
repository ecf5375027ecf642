/*
 * eq:V: The potential, for sa.friction().
 * Error of the formula: exact.
 * In double precision.
 * Written by symasym.
 */
#include "v.h"

#include <math.h>

double V(double u, double mu, double alpha, double z0)
{
    if (u <= -1.0) {
        return (1.0 + u)*(-1.0 + z0 - alpha);
    }
    if (u < 1.0) {
        const double t0 = alpha*mu/4.0;
        const double t1 = t0 + alpha/2.0;
        return (1.0 + u)*(-1.0 + z0 - t1 + u*(t1 + u*(t0 - t0*u)));
    }
    if (u >= 1.0) {
        return -1.0 + z0 - alpha + u*(-1.0 + alpha + z0);
    }
    return NAN;
}
