"""The ball engine: closed forms, and what it refuses."""

from fractions import Fraction as F

import mpmath
import numpy as np
import pytest
from flint import acb, arb, ctx, fmpq

import symasym as sa
from symasym.base.balls import rounded
from symasym.base.errors import AccuracyError, InputError
from symasym.drift.evaluate import Analytic, Piece, pieces
from symasym.drift.scenes import Request, Scene
from symasym.exact import balls
from symasym.exact.first_order import record
from symasym.exact.panels import TaylorModel, panel_of, panels, poly


def enclosed(formula, name, kappa, digits, log=False, **numbers):
    """The value and its error."""
    exact = {"kappa": F(kappa)} | {x: F(y) for x, y in numbers.items()}
    scene = Scene(sa.Drift(formula, "u"), exact)
    answer = balls.of_scene(scene, Request(name, "exact", None, digits, log, True))
    assert answer.kind == "bound"
    small = mpmath.mpf(10) ** (-2 * digits) if log else 0
    value, error = rounded(answer.value, digits)
    assert error <= max(small, abs(value) * mpmath.mpf(10) ** (1 - digits))
    return value, error


def mp(x):
    """A rational in mpmath's precision of the moment."""
    return mpmath.mpf(F(x).numerator) / F(x).denominator


def same(found, true, digits):
    """True where `true`, right to more digits, lies in the ball."""
    value, error = found
    return abs(value - true) <= error + abs(true) * mpmath.mpf(10) ** (-digits - 15)


# -- closed forms ----------------------------------------------------------------------------------

TEN = F(10)
CONSTANT = [
    (F(1, 3), F(1, 2), 10, 0), (TEN**-30, 1, 100, 3), (-(TEN**-100), TEN**-80, TEN**30, 0),
    (F(2, 7), TEN**-150, 1, F(1, 3)), (TEN**100, TEN**30, TEN**299, -(TEN**298)),
    (F(1, 1000), TEN**300, TEN**-300, 0), (F(-1, 3), F(1, 7), 2, TEN**-40 - 2),
    (F(1, 3), F(1, 7), 2, 2 - TEN**-40), (TEN**-15, TEN**-8, 5, TEN**-20),
]  # fmt: skip


@pytest.mark.parametrize(("a", "kappa", "r", "start"), CONSTANT)
def test_constant_drift(a, kappa, r, start):
    """T and C of Brownian motion with drift, from numbers over their whole range."""
    numbers = {"kappa": kappa, "r": r, "start": start}
    with mpmath.workprec(9000):
        x, end, s = map(mp, (a, r, start))
        rate = 2 * x / mp(kappa) ** 2
        c = mpmath.expm1(rate * (end - s)) / mpmath.expm1(2 * rate * end)
        rest = mpmath.expm1(-rate * (end + s)) / mpmath.expm1(-2 * rate * end)
        true = (end * (rest - c) - s) / x
        assert same(enclosed(str(a), "T", digits=25, **numbers), true, 25)
        assert same(enclosed(str(a), "T", digits=25, log=True, **numbers), mpmath.log(true), 25)
        assert same(enclosed(str(a), "C", digits=25, **numbers), c, 25)
        log = mpmath.log1p(-rest) if rest < 0.5 else mpmath.log(c)
        assert same(enclosed(str(a), "C", digits=25, log=True, **numbers), log, 25)


def test_reflecting_end_behind_a_deep_well():
    """F stays 0 from there, so that the well's depth costs no digits, and no time."""
    asked = {"ends": (-1, "3/2"), "start": "-1/5", "reflecting": "right", "log": True, "full": True}
    (value, error), (near, off) = (
        sa.escape_time(sa.Drift("5/2*u - u**3", layer=None), "1/200", method=method, **asked)
        for method in ("exact", "laplace")
    )
    assert abs(value - near) <= error + off < 1e-8 * value


def scale(rate, zero, kappa, low, high):
    """The integral of e^{lam V} from low to high, where A = rate (u - zero), V(zero) = 0."""
    root, middle = mpmath.sqrt(abs(mp(rate))) / mp(kappa), mp(zero)
    erf = mpmath.erfi if rate < 0 else mpmath.erf
    part = erf(root * (high - middle)) - erf(root * (low - middle))
    return part * mpmath.sqrt(mpmath.pi) / 2 / root


# A = rate (u - zero): zeros beside dyadic points, A(-1) or A(1) nearly 0, starts beside the ends.
LINEAR = [
    (1, F(1, 2) + TEN**-12, F(1, 20), F(1, 2)), (-1, F(1, 4) - TEN**-9, F(1, 20), F(1, 4)),
    (1, -1 + TEN**-15, F(1, 10), 0), (-1, 1 - TEN**-30, F(1, 10), TEN**-25 - 1),
    (-3, 0, F(1, 3), 1 - TEN**-20), (60, TEN**-40, 1, F(-1, 64)), (-120, TEN**-3, 1, 0),
]  # fmt: skip


@pytest.mark.parametrize(("rate", "zero", "kappa", "start"), LINEAR)
def test_probabilities_of_a_linear_drift(rate, zero, kappa, start):
    """C by error functions, and in a sliding region P and the density."""
    formula = f"({rate})*(u - ({zero}))"
    numbers = {"kappa": kappa, "r": 1, "start": start}
    with mpmath.workdps(900):
        x, lam = mp(start), 2 / mp(kappa) ** 2
        left, right = scale(rate, zero, kappa, -1, x), scale(rate, zero, kappa, x, 1)
        c = right / (left + right)
        assert same(enclosed(formula, "C", digits=30, **numbers), c, 30)
        log = mpmath.log1p(-c)
        assert same(enclosed(formula, "1 - C", digits=30, log=True, **numbers), log, 30)
        if rate < 0 and abs(zero) < 1:
            ends = (mp(-rate * (1 + zero)), mp(-rate * (1 - zero)))
            weight = [mpmath.exp(lam * mp(rate) * (u - mp(zero)) ** 2 / 2) for u in (-1, 1, x)]
            inside = scale(-rate, zero, kappa, -1, 1)
            outside = (weight[0] / ends[0] + weight[1] / ends[1]) / lam
            whole = inside + outside
            assert same(enclosed(formula, "P", kappa, 30), inside / whole, 30)
            assert same(enclosed(formula, "1 - P", kappa, 30), outside / whole, 30)
            for y, there in ((start, weight[2]), (2, weight[1] * mpmath.exp(-lam * ends[1]))):
                assert same(enclosed(formula, "p_ss", kappa, 30, y=y), there / whole, 30)


@pytest.mark.parametrize(
    ("rate", "zero", "kappa", "start"),
    [(F(1, 7), F(1, 3), 2, F(-1, 5)), (-3, TEN**-4, F(1, 2), F(1, 5)), (3, F(1, 9), F(1, 2), 0)],
)
def test_time_of_a_linear_drift(rate, zero, kappa, start):
    """T by quadrature of Green's function, made of error functions."""
    numbers = {"kappa": kappa, "r": 1, "start": start}
    with mpmath.workdps(30):
        x, lam, whole = mp(start), 2 / mp(kappa) ** 2, scale(rate, zero, kappa, -1, 1)

        def green(v):
            left = scale(rate, zero, kappa, -1, min(v, x))
            right = scale(rate, zero, kappa, max(v, x), 1)
            return left * right / whole * mpmath.exp(lam * mp(rate) * (v - mp(zero)) ** 2 / 2)

        true = lam * mpmath.quad(green, [-1, x, 1])
        value, error = enclosed(f"({rate})*(u - ({zero}))", "T", digits=18, **numbers)
        assert abs(value - true) <= error + abs(true) * mpmath.mpf(10) ** -20


# -- functions and resources -----------------------------------------------------------------------


def test_square_root_is_not_continued_across_its_cut():
    """Branch points at +- i/10, by Simpson's rule for V in closed form."""
    u, lam = np.linspace(0, 2, 2**15 + 1), 2 / 0.3**2
    inside, beyond = np.minimum(u, 1), np.maximum(u - 1, 0)
    v = (inside * np.sqrt(inside**2 + 0.01) + 0.01 * np.arcsinh(10 * inside) - inside) / 2
    v = lam * (v + beyond * (np.sqrt(1.01) - 0.5))  # -V on the right, V on the left

    def simpson(f, h):  # from the first point to every second one
        return np.concatenate([[0], np.cumsum((f[:-2:2] + 4 * f[1:-1:2] + f[2::2]) * h / 3)])

    total, q = [], []
    for sign in (1, -1):  # S and the integral of e^{-lam V} S from the end, on both sides
        parts = simpson(np.exp(sign * v), u[1])
        total.append(parts[-1])
        q.append(simpson((parts[-1] - parts) * np.exp(-sign * v[::2]), 2 * u[1])[-1])
    true = lam * (q[0] * total[1] + q[1] * total[0]) / sum(total)
    value, error = enclosed("sqrt(u**2 + 1/100) - 1/2", "T", F(3, 10), 15, r=2, start=0)
    assert abs(value - true) <= error + 1e-9 * true
    for unknown in ("abs(u) + 1", "sqrt(u**2)"):
        with pytest.raises(InputError):
            enclosed(unknown, "T", 1, 10, r=2, start=0)


ZEROS = F(-1, 2), F(1, 8), F(7, 10)


def test_what_takes_too_long_is_told():
    """A kink and a huge slope: one sentence, and flint's context as it was."""
    before = ctx.prec, ctx.cap
    with pytest.raises(AccuracyError, match="near .u. = .*; give a smooth A"):
        enclosed("4/5*exp(200*u)", "T", F(1, 10), 10, r=2, start=0)

    def kink(u):
        return (u * u).sqrt(analytic=True) if isinstance(u, acb) else (u * u).sqrt()

    piece = Piece(fmpq(-1), fmpq(1), Analytic(kink))
    with balls.precision(300), pytest.raises(AccuracyError, match="near .u. = [0-9.]*e-"):
        panels([piece], arb(2), piece.left, piece.right, 15, panel_of)
    with pytest.raises(AccuracyError, match="near .u. = 0.3 "):  # right of the start
        sa.escape_time(sa.Drift("1/(u - 3/10)", layer=None), 1, ends=(-1, 2))
    enclosed("u", "T", 1, 10, r=2, start=0)
    assert (ctx.prec, ctx.cap) == before


@pytest.mark.parametrize("kappa", [1, F(1, 10), F(1, 1000), TEN**-8])
@pytest.mark.parametrize("name", ["T", "C", "1 - C"])
def test_nested_and_mirrored(kappa, name):
    """20 digits contain 60, and the mirror image is the same scene."""
    numbers = {"kappa": kappa, "r": F(5, 2), "start": F(-1, 3)}
    formula, image = ("*".join(f"(u - ({x}))" for x in z) for z in (ZEROS, [-x for x in ZEROS]))
    value, error = enclosed(formula, name, digits=20, **numbers)
    fine = enclosed(formula, name, digits=60, **numbers)
    assert abs(value - fine[0]) <= error + fine[1]
    back = {"T": "T", "C": "1 - C", "1 - C": "C"}[name]
    mirror = enclosed(image, back, digits=60, **numbers | {"start": F(1, 3)})
    assert abs(mirror[0] - fine[0]) <= fine[1] + mirror[1]


def test_noise_alone_and_a_geometric_brownian_motion():
    """T = 2 arctan(1/2) without drift; log u is a Brownian motion with the drift a = 1/2."""
    alone = sa.Drift("0", layer=None, noise="1 + u**2/4")
    found = sa.escape_time(alone, 1, 1, dps=40)
    assert sa.escape_time(alone, 1, 1) == pytest.approx(float(found), rel=1e-12)
    growth = sa.exit_law(sa.Drift("u", layer=None, noise="u"), 1, ends=("1/2", 2), start=1, dps=25)
    with mpmath.workdps(50):
        assert abs(found - 2 * mpmath.atan(0.5)) < mpmath.mpf(10) ** -39
        rate = mpmath.mpf(1) / 8 + (mpmath.pi / mpmath.log(4)) ** 2 / 2
        assert abs(growth.rate.value - rate) <= growth.rate.error < rate / 10**25


def test_what_lies_beyond_the_truncated_line():
    """Almost without drift, the speed density of the noise 1 + u^2 is (1 + u^2)^-2."""
    drift = sa.Drift("-u/10**9", layer=None, noise="1 + u**2")
    for side in (-1, 1):
        x, bound = balls._tail(drift, fmpq(1), fmpq(1), 3, side)
        true = float(mpmath.quad(lambda u: (1 + u * u) ** -2, [mp(F(int(x.p), int(x.q))), "inf"]))
        assert true < float(bound) < 1.1 * true


@pytest.mark.parametrize("ito", [0, "stratonovich"])
@pytest.mark.parametrize("keep", [3, 5])
def test_what_a_panel_misses_is_in_its_balls(ito, keep):
    """Moderate and slow panels, with most terms of the drift or of one weight cut off."""
    noise = "2 + sin(3*u)"
    drift = sa.Drift("2*sin(5*u) + tanh(3*u)", layer=None, noise=noise, ito=ito)
    kinds, rest = [], lambda terms: sum(map(abs, terms[keep:]), arb(0))
    with balls.precision(400):
        piece = pieces(drift, fmpq(-1), fmpq(1))[0]
        for lam, k in ((x, k) for x in (arb(3), arb(3000)) for k in range(-15, 16, 2)):
            if p := panel_of(piece, lam, fmpq(k, 16), fmpq(1, 32), 30):
                series = [list(w.series) for w in (p.a, p.b)]
                of_a, of_b = (TaylorModel(poly(c[:keep]), rest(c)) for c in series)
                slope, blur = p.slope[:keep], p.blur + rest(p.slope)
                of_phi = {"slope": slope, "q": poly(slope).integral(), "blur": blur}
                for rough in (p._replace(a=of_a), p._replace(b=of_b), p._replace(**of_phi)):
                    assert rough.blur < 1
                    both = zip(record(rough, lam), record(p, lam), strict=True)
                    assert all(x.overlaps(y) for x, y in both)
                kinds.append(bool(p.cauchy))
    assert 0 < sum(kinds) < len(kinds)
