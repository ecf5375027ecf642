"""The exact escape time (`symasym.emit.kernels.exact_python`) in C."""

from __future__ import annotations

from symasym.emit.kernels.exact_python import POINTS, tables

_C = """/* Radau's points in (0, 1], and their weights. */
TABLES

typedef struct {
    function_ *drift;
    const double *p, *ends;
    double rough, lam;
    double within[RADAU][RADAU], last[2][RADAU];
} scene_;

typedef struct {
    double sigma, w, loose_sigma, loose;
} swept_;

/* Integrals up to each point of the polynomial through values there, and its last terms. */
static void radau_(scene_ *s)
{
    double p[RADAU][RADAU + 1];
    int i, j, k;
    for (i = 0; i < RADAU; i++) {
        p[i][0] = 1.0;
        p[i][1] = 2.0 * radau_t_[i] - 1.0;
        for (k = 1; k < RADAU; k++)
            p[i][k + 1] = ((2 * k + 1) * p[i][1] * p[i][k] - k * p[i][k - 1]) / (k + 1);
    }
    for (i = 0; i < RADAU; i++)
        for (j = 0; j < RADAU; j++) {
            double sum = p[i][1] + 1.0;
            for (k = 1; k < RADAU; k++)
                sum += p[j][k] * (p[i][k + 1] - p[i][k - 1]);
            s->within[i][j] = radau_w_[j] * sum / 2.0;
        }
    for (k = RADAU - 2; k < RADAU; k++)
        for (j = 0; j < RADAU; j++)
            s->last[k - RADAU + 2][j] = (2 * k + 1) * radau_w_[j] * p[j][k];
}

/* A linear system by elimination; its right-hand side is the last column. */
static void solve_(double a[RADAU][RADAU + 1], double *found)
{
    int i, j, k;
    for (k = 0; k < RADAU; k++) {
        int best = k;
        for (i = k + 1; i < RADAU; i++)
            if (fabs(a[i][k]) > fabs(a[best][k]))
                best = i;
        for (j = k; j <= RADAU; j++) {
            const double x = a[k][j];
            a[k][j] = a[best][j];
            a[best][j] = x;
        }
        for (i = k + 1; i < RADAU; i++) {
            const double factor = a[i][k] / a[k][k];
            for (j = k + 1; j <= RADAU; j++)
                a[i][j] -= factor * a[k][j];
        }
    }
    for (k = RADAU - 1; k >= 0; k--) {
        double rest = a[k][RADAU];
        for (j = k + 1; j < RADAU; j++)
            rest -= a[k][j] * found[j];
        found[k] = rest / a[k][k];
    }
}

/* M' = 1 - lam |drift| M from a, M = 0, to b: M there, its integral; lam times the drift's. */
static int relaxed_(const scene_ *s, double a, double b, double *out)
{
    double end = 0.0, area = 0.0, drop = 0.0, u = a, step = b - a, growth = 2.0;
    long trial;
    for (trial = 0; trial < 100000; trial++) {
        const int final = fabs(step) >= fabs(b - u) * (1.0 - 1e-12);
        double slopes[RADAU], rows[RADAU][RADAU + 1], values[RADAU];
        double h, least = HUGE_VAL, top = 0.0, tail = 0.0, noise;
        int i, j;
        if (final)
            step = b - u;
        h = fabs(step);
        for (i = 0; i < RADAU; i++) {
            slopes[i] = s->lam * h * s->drift(u + radau_t_[i] * step, s->p);
            least = fmin(least, fabs(slopes[i]));
        }
        for (i = 0; i < RADAU; i++) {
            for (j = 0; j < RADAU; j++)
                rows[i][j] = s->within[i][j] * fabs(slopes[j]);
            rows[i][i] += 1.0;
            rows[i][RADAU] = end + radau_t_[i] * h;
        }
        solve_(rows, values);
        for (i = 0; i < RADAU; i++)
            top = fmax(top, fabs(values[i]));
        for (j = 0; j < 2; j++) {
            double sum = 0.0;
            for (i = 0; i < RADAU; i++)
                sum += s->last[j][i] * values[i];
            tail = fmax(tail, fabs(sum));
        }
        /* What the drift's rounding makes of M: no halving gets below it. */
        noise = s->lam * h * s->rough / (1.0 + least);
        if (tail > fmax(1e-13, fmin(noise, 1e-6)) * top) {
            step /= 2.0;
            growth = 1.0;
            if (fabs(step) < 1e-16 * fabs(u))
                return 0;
            continue;
        }
        for (i = 0; i < RADAU; i++) {
            area += h * radau_w_[i] * values[i];
            drop += radau_w_[i] * slopes[i];
        }
        end = values[RADAU - 1];
        if (final) {
            out[0] = end;
            out[1] = area;
            out[2] = drop;
            return 1;
        }
        u += step;
        step *= growth;
        growth = 2.0;
    }
    return 0;
}

/* log sigma and log w at the last of the points, from the end at the first, and their errors. */
static swept_ sweep_(const scene_ *s, const double *points, int count)
{
    swept_ f = {-HUGE_VAL, -HUGE_VAL, 0.0, 0.0};
    const double log_lam = log(s->lam);
    int k;
    for (k = 0; k + 1 < count; k++) {
        const double p = points[k], q = points[k + 1], h = fabs(q - p);
        double one[3], two[3], back, area, x, total, first, slip = 0.0, wrong = 0.0;
        if (fmax(fabs(p), fabs(q)) > 1.0) {
            one[2] = s->lam * s->ends[p > 0.0] * h;
            x = fabs(one[2]);
            one[0] = two[0] = h * exprel_(-x);
            one[1] = h * h * exprel2_(-x);
        } else {
            if (!relaxed_(s, p, q, one) || !relaxed_(s, q, p, two)) {
                f.loose = NAN;
                return f;
            }
            x = fabs(one[2]);
            slip = fabs(one[2] - two[2]);
            wrong = fabs(one[1] / two[1] - 1.0);
        }
        back = log(two[0]);
        area = log_lam + log(one[1]);
        if ((one[2] > 0.0) == (q > p)) {
            /* V falls. */
            const double ahead = log_lam + log(one[0]);
            double part, known;
            total = logaddexp_(f.sigma, back);
            part = exp(area - x - total - ahead);
            first = f.w - logaddexp_(0.0, back - f.sigma) - x;
            f.w = logaddexp_(first, ahead + log1p(-part));
            known = exp(f.sigma - total) * f.loose_sigma + wrong;
            f.loose = exp(first - f.w) * (f.loose + f.loose_sigma + slip) + 2.0 * part * known
                + wrong;
            f.sigma = total + x;
            f.loose_sigma = known + slip;
        } else {
            /* V rises. */
            const double ahead = log(one[0]);
            double kept;
            total = logaddexp_(f.sigma - x, ahead);
            kept = exp(f.sigma - x - total);
            first = logaddexp_(f.w, log_lam + back) - logaddexp_(-x, ahead - f.sigma);
            f.w = logaddexp_(first, area - total);
            f.loose = exp(first - f.w)
                * (f.loose + kept * slip + (1.0 - kept) * f.loose_sigma) + wrong;
            f.loose_sigma = kept * (f.loose_sigma + slip) + wrong;
            f.loose += f.loose_sigma;
            f.sigma = total;
        }
    }
    return f;
}

/* -r or r, what of -1, 1 and the zeros lies between that and 0, from outside, and 0. */
static int points_(double end, const double *zeros, int count, double *points)
{
    const double sign = end > 0.0 ? 1.0 : -1.0;
    int k, number = 0;
    points[number++] = end;
    if (fabs(end) > 1.0)
        points[number++] = sign;
    for (k = 0; k < count; k++) {
        const double u = zeros[sign > 0.0 ? count - 1 - k : k];
        if (sign * u > 0.0 && fabs(u) < fmin(fabs(end), 1.0) && fabs(u - points[number - 1]) > 0.0)
            points[number++] = u;
    }
    points[number++] = 0.0;
    return number;
}

/* log T from 0, where `drift` is that of the layer and `ends` are those beyond it. */
static double log_time_(
    function_ *drift, const double *p, const double *ends, double rough, const double *zeros,
    int count, double kappa, double r)
{
    scene_ s;
    swept_ left, right;
    double points[1032], time, rate, loose;
    int count_left, count_right;
    if (!(kappa >= 1e-8 && kappa <= 1e8 && r >= 1e-100 && r <= 1e12))
        return NAN;
    if (!(fabs(ends[0]) < 1e100 && fabs(ends[1]) < 1e100 && rough < 1e84))
        return NAN;
    s.drift = drift;
    s.p = p;
    s.ends = ends;
    s.rough = rough;
    s.lam = 2.0 / (kappa * kappa);
    radau_(&s);
    count_left = points_(-r, zeros, count, points);
    left = sweep_(&s, points, count_left);
    count_right = points_(r, zeros, count, points);
    right = sweep_(&s, points, count_right);
    time = logaddexp_(left.w, right.w);
    rate = logaddexp_(-left.sigma, -right.sigma);
    loose = exp(-left.sigma - rate) * left.loose_sigma + exp(left.w - time) * left.loose
        + exp(-right.sigma - rate) * right.loose_sigma + exp(right.w - time) * right.loose;
    return loose <= 1e-12 * fmax(1.0, fabs(time - rate)) ? time - rate : NAN;
}
"""


def in_c() -> str:
    """The helper of the target "c"."""
    points, weights = (f"static const double radau_{x}_[{POINTS}] = {{" for x in "tw")
    text = _C.replace("TABLES", tables((points, weights), "};"))
    return text.replace("RADAU", str(POINTS))
