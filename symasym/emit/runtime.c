/* logaddexp: log(e^x + e^y) */
static double logaddexp(double x, double y)
{
    double high = fmax(x, y);
    if (fabs(high) == INFINITY) return high;
    return high + log1p(exp(-fabs(x - y)));
}

/* erfcx: e^(x^2) erfc(x) for x >= 0 by the midpoint rule (Hunter and Regan 1972) */
static double erfcx(double x)
{
    double total = 0;
    for (int n = 0; n < 13; n++) {
        double t = 0.5*(n + 0.5);
        total += exp(-t*t)/(t*t + x*x);
    }
    return x*total/PI + (x < 6 ? 2*exp(x*x)/(exp(4*PI*x) + 1) : 0);
}

/* erf_: erf(x) for languages without it */
static double erf_(double x)
{
    double total = 0; double term = 2*x*exp(-x*x)/sqrt(PI);
    for (int k = 1; k < 120; k++) { total += term; term *= 2*x*x/(2*k + 1); }
    return fabs(x) < 6 ? total : x/fabs(x);
}

/* dawsn: Dawson's integral (DLMF 7.6.2, 7.12.1) */
static double dawsn(double x)
{
    double total = 0; double y = x*x; double term = fabs(x) < 6 ? x*exp(-y) : 0.5/x;
    for (int k = 0; fabs(x) < 6 && k < 120; k++) { total += term/(2*k + 1); term *= y/(k + 1); }
    for (int k = 0; fabs(x) >= 6 && k < 30; k++) { total += term; term *= (k + 0.5)/y; }
    return total;
}

/* third: cos(arccos(w)/3), continued beyond w = 1 */
static double third(double w)
{
    return w < 1 ? cos(acos(w)/3) : cosh(acosh(w)/3);
}

/* artanhc: artanh(x^(1/2))/x^(1/2), continued below x = 0 */
static double artanhc(double x)
{
    double root = sqrt(fabs(x));
    if (root < 0.01) return 1 + x*(1/3.0 + x*(1/5.0 + x*(1/7.0 + x/9)));
    return x < 0 ? atan(root)/root : atanh(root)/root;
}

/* exprel_: (e^x - 1)/x for n = 1, (e^x - 1 - x)/x^2 for n = 2, times e^(-max(x, 0)) */
static double exprel_(double x, int n)
{
    double a = fabs(x); double total = 0; double term = 0.5;
    if (n == 1) return x == 0 ? 1 : -expm1(-a)/a;
    if (a > 1) return (x < 0 ? 1 - exprel_(x, 1) : exprel_(x, 1) - exp(-a))/a;
    for (int k = 0; k < 18; k++) { total += x < 0 ? term : (k + 1)*term; term *= -a/(k + 3); }
    return total;
}

/* airy_steps: y and y' at `to` from those at `from` for y'' = z y, by Taylor series */
static void airy_steps(double from, double to, double y[4], int k)
{
    double count = ceil(2*fabs(to - from) + 1); double h = (to - from)/count;
    for (int step = 0; step < count; step++) {
        double before = 0; double a = y[k]; double next = y[k + 1];
        double value = 0; double slope = 0; double power = 1;
        for (int n = 0; n < 24; n++) {
            double after = ((from + step*h)*a + before)/((n + 2)*(n + 1.0));
            value += a*power; slope += (n + 1)*next*power; power *= h;
            before = a; a = next; next = after;
        }
        y[k] = value; y[k + 1] = slope;
    }
}

/* airy_all: Ai, Ai', Bi, Bi' (DLMF 9.7 beyond 9) */
static void airy_all(double z, double y[4])
{
    double size = fabs(z); double zeta = 2*size*sqrt(size)/3;
    double p[4] = {0, 0, 0, 0}; double c = 1;
    if (size > 9) {
        double root = sqrt(PI*sqrt(size));
        for (int k = 0; k < 24; k++) {
            double turn = z > 0 ? 1 : (k % 4 < 2 ? 1 : -1);
            p[k % 2] += turn*c; p[2 + k % 2] += k > 0 ? -turn*c*(6.0*k + 1)/(6.0*k - 1) : turn;
            c *= (6.0*k + 1)*(6.0*k + 3)*(6.0*k + 5)/(216*(k + 1)*(2.0*k + 1))/zeta;
        }
        double s = sin(zeta + PI/4); double t = cos(zeta + PI/4); double up = root/PI;
        y[0] = z > 0 ? exp(-zeta)*(p[0] - p[1])/(2*root) : (s*p[0] - t*p[1])/root;
        y[1] = z > 0 ? -exp(-zeta)*up*(p[2] - p[3])/2 : -up*(t*p[2] + s*p[3]);
        y[2] = z > 0 ? exp(zeta)*(p[0] + p[1])/root : (t*p[0] + s*p[1])/root;
        y[3] = z > 0 ? exp(zeta)*up*(p[2] + p[3]) : up*(s*p[2] - t*p[3]);
        return;
    }
    airy_all(9.5, y); /* each starts where it is recessive */
    airy_all(-9.5, p);
    y[2] = p[2]; y[3] = p[3];
    airy_steps(9.5, z, y, 0); airy_steps(-9.5, z, y, 2);
}

/* airy: one of the four functions of airy_all */
static double airy(double z, int part)
{
    double y[4] = {0, 0, 0, 0};
    airy_all(z, y);
    return y[part];
}

/* panel: from u over h, the rise of lam V; logs of int e^x, int e^-x and the nested integral.
   A value above 4 is returned if x exceeds 4 or the Gauss points do not resolve the drift. */
static double panel(double u, double h, double lam, const double *p, double out[4])
{
    double x[12] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    double e[12] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    double size = 0; double most = 0; double even = 0; double odd = 0;
    out[0] = 0; out[1] = 0; out[2] = 0; out[3] = 0;
    for (int i = 0; i < 12; i++) {
        x[i] = -lam*h*drift(u + h*NODES[i], p);
        size = fmax(size, fabs(x[i]));
        most = fmax(most, fmax(size, fabs(h)*rate(u + h*NODES[i], p)));
        even += LAST[i]*x[i]; odd += LAST[12 + i]*x[i];
    }
    if (most > 4) return most;
    if (fabs(even) + fabs(odd) > 1e-13*size + 1e-14) return 8;
    for (int i = 0; i < 12; i++) {
        double way = 0;
        for (int j = 0; j < 12; j++) way += WITHIN[12*i + j]*x[j];
        e[i] = exp(way); out[0] += WEIGHTS[i]*x[i];
    }
    for (int i = 0; i < 12; i++) {
        double inner = 0;
        for (int j = 0; j < 12; j++) inner += WITHIN[12*i + j]*e[j];
        out[1] += WEIGHTS[i]*e[i]; out[2] += WEIGHTS[i]/e[i]; out[3] += WEIGHTS[i]*inner/e[i];
    }
    h = fabs(h); out[1] = log(h*out[1]); out[2] = log(h*out[2]); out[3] = log(h*h*out[3]);
    return most;
}

/* march: from u to `to`, the rise of lam V, log sigma, log w (panel-step), log int e^(-lam V).
   nan beyond 20,000 panels: kappa is too small, and sa.expand(drift).emit() has a value. */
static void march(double u, double to, double lam, const double *p, double sums[4])
{
    double here[4] = {0, 0, 0, 0}; double h = (to - u)/4;
    for (int n = 0; n < 20000; n++) {
        if (u == to) return;
        int last = fabs(h) > fabs(to - u)*0.999;
        if (last) h = to - u;
        double most = panel(u, h, lam, p, here);
        if (most > 4) { h *= 3.2/most; continue; }
        double total = logaddexp(sums[1], here[1]);
        double kept = -logaddexp(0, here[1] - sums[1]);
        double more = log(lam) + logaddexp(here[2] + kept, here[3] - total);
        sums[3] = logaddexp(sums[3], here[2] - sums[0]);
        sums[2] = logaddexp(sums[2] + kept, more) + here[0];
        sums[1] = total - here[0]; sums[0] += here[0];
        u = last ? to : u + h; h *= most > 0 ? fmin(3.6/most, 4) : 4;
    }
    sums[0] = NAN; sums[1] = NAN; sums[2] = NAN; sums[3] = NAN;
}

/* side: the same from the end at r sign to 0; beyond the layer lam V changes linearly by x */
static void side(double kappa, double r, double sign, const double *p, double sums[4])
{
    double lam = 2/(kappa*kappa); double x = lam*end(sign, p)*sign*(r - 1);
    sums[0] = 0; sums[1] = -INFINITY; sums[2] = -INFINITY; sums[3] = -INFINITY;
    if (r > 1) {
        sums[1] = log((r - 1)*exprel_(x, 1)) - fmin(x, 0);
        sums[2] = log(lam*(r - 1)*exprel_(-x, 2)/exprel_(x, 1));
    }
    march(sign*fmin(r, 1), 0, lam, p, sums);
}

/* log_exit: log T from 0 (positive-form), for sign = 1 log C (exit through -r), for -1 log(1 - C) */
static double log_exit(double kappa, double r, double sign, const double *p)
{
    double left[4] = {0, 0, 0, 0}; double right[4] = {0, 0, 0, 0};
    side(kappa, r, -1, p, left);
    side(kappa, r, 1, p, right);
    if (sign != 0) return -logaddexp(0, sign*(left[1] - right[1]));
    return logaddexp(left[2], right[2]) - logaddexp(-left[1], -right[1]);
}

/* potential: lam V(u) by the panels */
static double potential(double lam, double u, const double *p)
{
    double sums[4] = {0, -INFINITY, -INFINITY, -INFINITY}; double inside = fmax(fmin(u, 1), -1);
    march(-1, inside, lam, p, sums);
    return sums[0] - lam*end(u > 0 ? 1 : -1, p)*(u - inside);
}

/* log_density: log p_ss(u), for sign = 1 log P, for -1 log(1 - P); heights relative to V(u) */
static double log_density(double kappa, double u, double sign, const double *p)
{
    double left[4] = {0, -INFINITY, -INFINITY, -INFINITY}; double lam = 2/(kappa*kappa);
    double right[4] = {0, -INFINITY, -INFINITY, -INFINITY}; double near = fmax(fmin(u, 1), -1);
    march(near, -1, lam, p, left);
    march(near, 1, lam, p, right);
    double inside = logaddexp(left[3], right[3]);
    double beyond = logaddexp(-left[0] - log(lam*end(-1, p)), -right[0] - log(-lam*end(1, p)));
    beyond += 0*beyond; /* nan if infinite, at a tangency */
    if (sign != 0) return -logaddexp(0, sign*(beyond - inside));
    return lam*end(u > 0 ? 1 : -1, p)*(u - near) - logaddexp(inside, beyond);
}
