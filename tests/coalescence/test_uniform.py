"""Uniform expansions against published cases and plain quadrature."""

import random
from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy
from mpmath import mp

import symasym as sa
from symasym.base.errors import AccuracyError, InputError

SIDES = ["1/2", "0.999999999999", "1", "1.01", "2"]


def value_of(text):
    rational = Fraction(text)
    return mp.mpf(rational.numerator) / rational.denominator


def bessel(order):
    return sa.uniform_integral(
        "z*sinh(t) - t", "1/(2*pi*I)", "t", "oo - I*pi", "oo + I*pi", order=order
    )


def gamma(order):
    return sa.uniform_integral("log(x) - x", "1/x", "x", "mu", "oo", order=order)


@pytest.mark.parametrize("z", SIDES)
def test_bessel_through_its_turning_point(z):
    found = bessel(4).bind(z=z).evaluate(60, dps=25, full=True)
    with mp.workdps(30):
        exact = mp.besselj(60, 60 * value_of(z))
        assert abs(found.value - exact) <= found.error
        assert found.error <= 1e-9 * mp.hypot(exact, 0.05)
    assert found.error_kind == "estimate"


def test_bessel_coefficients_at_the_turning_point():
    """DLMF 10.20: A_k(0) and B_k(0), with the factor 2^(1/3) in front of both."""
    zeta, pairs = bessel(6).bind(z=1).coefficients(dps=25)
    with mp.workdps(25):
        root = mp.cbrt(2)
        a = [1, 0, -mp.mpf(1) / 225, 0, mp.mpf(151439) / 218295000, 0]
        b = [0, root / 70, 0, -root * 1213 / 1023750, 0, None]
        assert abs(zeta) < 1e-25
        for (x, y), first, second in zip(pairs, a, b, strict=True):
            assert abs(x - root * first) < 1e-23
            assert second is None or abs(y - root * second) < 1e-23


@pytest.mark.parametrize("z", ["1/2", "2"])
def test_bessel_coefficient_beside_the_turning_point(z):
    """B_0(zeta) of DLMF 10.20, on both sides."""
    zeta, pairs = bessel(2).bind(z=z).coefficients(dps=25)
    with mp.workdps(25):
        square = 1 - value_of(z) ** 2
        root = mp.sqrt(abs(square))
        if square > 0:
            inner = 5 / (24 * root**3) - 1 / (8 * root)
            expected = mp.cbrt((mp.acosh(1 / value_of(z)) - root) * 3 / 2) ** 2
        else:
            inner = 5 / (24 * root**3) + 1 / (8 * root)
            expected = -(mp.cbrt((root - mp.acos(1 / value_of(z))) * 3 / 2) ** 2)
        front = mp.root(4 * expected / square, 4)
        b_0 = -5 / (48 * expected**2) + inner / mp.sqrt(abs(expected))
        assert mp.almosteq(zeta, expected, 1e-23)
        assert mp.almosteq(pairs[0][0], front, 1e-23)
        assert mp.almosteq(pairs[1][1], front * b_0, 1e-22)


@pytest.mark.parametrize(("nu", "z"), [("40", "1"), ("40.3", "0.9"), ("40.3", "1.2")])
def test_oscillating_with_ends(nu, z):
    """Over [-pi, pi] it's Bessel's function for whole orders, else Anger's; the ends count."""
    found = sa.uniform_integral("I*(z*sin(t) - t)", "1/(2*pi)", "t", "-pi", "pi", order=3)
    found = found.bind(z=z).evaluate(nu, dps=20, full=True)
    with mp.workdps(25):
        y = value_of(nu)
        exact = mp.quad(
            lambda t: mp.cos(y * (t - value_of(z) * mp.sin(t))), mp.linspace(0, mp.pi, 16)
        )
        assert abs(found.value - exact / mp.pi) <= found.error < 1e-8


@pytest.mark.parametrize("z", ["-2", "-1e-30", "0", "1"])
def test_airy_is_exact(z):
    found = sa.uniform_integral("I*(t**3/3 + z*t)", "1/(2*pi)", "t", "-oo", "oo", order=1)
    found = found.bind(z=z).evaluate(8, dps=25, full=True)
    with mp.workdps(40):
        exact = mp.airyai(4 * value_of(z)) / 2
        assert abs(found.value - exact) <= found.error <= 1e-24 * abs(exact)


@pytest.mark.parametrize("digits", [0, 20, 45, 70])
@pytest.mark.parametrize("verb", [sa.uniform_integral, sa.laplace_integral])
def test_exponents_of_more_digits_than_are_asked_for(verb, digits):
    f = f"(10**{digits})*(5/3 - (x - 1/7)**2)"
    found = verb(f, 1, "x", "-oo", "oo" if verb is sa.laplace_integral else 2).evaluate(
        700, dps=20, full=True
    )
    with mpmath.workdps(150):
        large = 700 * mpmath.mpf(10) ** digits
        # What is beyond x = 2 is below e^(-3 lam) of it.
        exact = mpmath.sqrt(mpmath.pi / large) * mpmath.exp(large * 5 / 3)
        assert abs(found.value - exact) <= found.error < 1e-18 * exact


@pytest.mark.parametrize("digits", [20, 45])
def test_phases_of_more_digits_than_are_asked_for(digits):
    f = f"(10**{digits})*I*(x**3/3 - x)"
    found = sa.uniform_integral(f, 1, "x", "-oo", "oo").evaluate(3, dps=20)
    with mpmath.workdps(150):
        large = 3 * mpmath.mpf(10) ** digits
        exact = (
            2
            * mpmath.pi
            * large ** (mpmath.mpf(-1) / 3)
            * mpmath.airyai(-(large ** (mpmath.mpf(2) / 3)))
        )
        assert abs(found - exact) < 1e-19 * abs(exact)


def test_even_weight_is_no_polynomial():
    """Its last Taylor coefficient is 0, however many there are."""
    waves = sa.uniform_integral("I*(t**3/3 - 9*t/25)", "1/(1 + t**2)", "t", "-oo", "oo", order=1)
    _, ((a, b),) = waves.coefficients(dps=25)
    with mp.workdps(30):
        assert abs(a - 25 / mp.mpf(34)) < 1e-24
        assert abs(b) < 1e-24


@pytest.mark.parametrize("mu", ["1/4", *SIDES, "10"])
def test_incomplete_gamma(mu):
    """Gamma(a, mu a): DLMF 8.12."""
    found = gamma(4).bind(mu=mu).evaluate(60, dps=25, full=True)
    with mp.workdps(30):
        exact = mp.gammainc(60, 60 * value_of(mu)) * mp.mpf(60) ** -60
        assert abs(found.value - exact) <= found.error < 1e-7 * exact


def slope(errors):
    """From two values of lam, one the double of the other."""
    with mp.workdps(15):
        return mp.log(max(errors[0]) / max(errors[1]), 2)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_order_at_an_end(order):
    errors = [[], []]
    for mu in ("0.9", "1"):
        expansion = gamma(order).bind(mu=mu)
        for lam, row in zip((200, 400), errors, strict=True):
            with mp.workdps(30):
                exact = mp.gammainc(lam, lam * value_of(mu)) * mp.mpf(lam) ** -lam
                row.append(abs(expansion.evaluate(lam, dps=15) / exact - 1))
    assert abs(slope(errors) - order) < 0.05 * order


@pytest.mark.parametrize("order", [2, 4])
def test_order_of_a_pair(order):
    """Of J_nu(nu z) over its envelope; only every other order has a term of each kind."""
    errors = [[], []]
    for z in ("0.8", "1.3"):
        expansion = bessel(order).bind(z=z)
        for lam, row in zip((50, 100), errors, strict=True):
            with mp.workdps(30):
                y = lam * value_of(z)
                exact = mp.besselj(lam, y)
                size = abs(exact) if y <= lam else mp.hypot(exact, mp.bessely(lam, y))
                row.append(abs(expansion.evaluate(lam, dps=15) - exact) / size)
    assert abs(slope(errors) - order) < 0.05 * order


@pytest.mark.parametrize("c", ["-1/5", "0", "1e-20", "1/5", "3"])
def test_saddle_at_a_kink(c):
    f = "-(x - c)**2/2 - (x + Abs(x))"
    found = sa.uniform_integral(f, "1/(2 + x)", "x", "-1", "4", order=5).bind(c=c)
    found = found.evaluate(80, dps=20, full=True)
    with mp.workdps(30):
        z = value_of(c)
        # The largest value taken out: quad's tolerance is absolute.
        top = (
            -(min(z, 0) ** 2) / 2
            - (z - 2 if z > 2 else 0) * 2
            - (min(z, 2) if z > 0 else 0) ** 2 / 2
        )
        exact = mp.exp(80 * top) * mp.quad(
            lambda x: mp.exp(80 * (-((x - z) ** 2) / 2 - (x + abs(x)) - top)) / (2 + x),
            [-1, -0.5, -0.3, -0.1, 0, 0.02, 0.05, 0.1, 0.2, 0.6, 0.9, 1, 1.1, 1.5, 2, 3, 4],
        )
        assert abs(found.value - exact) <= found.error < 1e-5 * exact


@pytest.mark.parametrize("c", ["-1/50", "-1e-20", "0", "1/2"])
def test_end_at_a_minimum(c):
    """The end adds little, and its coefficients by themselves would diverge."""
    found = sa.uniform_integral("-(x**2 - 1)**2", "exp(x)", "x", "c", "oo", order=3).bind(c=c)
    found = found.evaluate(30, dps=15, full=True)
    with mp.workdps(20):
        exact = mp.quad(
            lambda x: mp.exp(x - 30 * (x**2 - 1) ** 2), [value_of(c), 0.5, 0.8, 1, 1.2, 1.5, 2]
        )
        assert abs(found.value - exact) <= found.error < 2e-4 * exact


def test_removable_singularity():
    found = sa.uniform_integral("-x**2 - x**3", "sin(x)/x", "x", "-1/20", "oo", order=4)
    found = found.evaluate(60, dps=15, full=True)
    with mp.workdps(20):
        exact = mp.quad(
            lambda x: mp.sinc(x) * mp.exp(-60 * (x**2 + x**3)), [-0.05, 0, 0.1, 0.2, 0.4, 0.8, 2]
        )
        assert abs(found.value - exact) <= found.error < 2e-3 * exact


def test_end_where_f_is_minus_infinity():
    found = sa.uniform_integral("log(x) - x", "1/x", "x", 0, "oo", order=4)
    found = found.evaluate(50, dps=20, full=True)
    with mp.workdps(30):
        exact = mp.gamma(50) * mp.mpf(50) ** -50
        assert abs(found.value - exact) <= found.error < 1e-8 * exact


def test_estimates_are_honest():
    rng = random.Random(5)
    for _ in range(4):
        c = [Fraction(rng.randint(-9, 9), 40) for _ in range(3)]
        end = Fraction(rng.randint(-30, 30), 100)
        f = f"-x**2/2 + ({c[0]})*x**3 - x**4/5"
        found = sa.uniform_integral(f, f"cos(x + ({c[1]}))", "x", str(end), 1, order=3)
        found = found.evaluate(50, dps=15, full=True)
        with mp.workdps(20):
            k, shift, lo = (mp.mpf(y.numerator) / y.denominator for y in (*c[:2], end))
            exact = mp.quad(
                lambda x, k=k, shift=shift: (
                    mp.cos(x + shift) * mp.exp(50 * (-(x**2) / 2 + k * x**3 - x**4 / 5))
                ),
                mp.linspace(lo, 1, 9),
            )
            assert abs(found.value - exact) <= found.error
    for _ in range(4):
        c = [Fraction(rng.randint(-9, 9), d) for d in (60, 120, 200)]
        f = f"I*(x**3/3 - ({c[0]})*x + ({c[1]})*x**4 + ({c[2]})*x**5)"
        found = sa.uniform_integral(f, "1/(2 + x)", "x", -1, 1, order=2, near=0)
        found = found.evaluate(60, dps=15, full=True)
        with mp.workdps(20):
            z, k, m = (mp.mpf(y.numerator) / y.denominator for y in c)
            exact = mp.quad(
                lambda x, z=z, k=k, m=m: (
                    mp.expj(60 * (x**3 / 3 - z * x + k * x**4 + m * x**5)) / (2 + x)
                ),
                mp.linspace(-1, 1, 17),
            )
            assert abs(found.value - exact) <= found.error


def test_floats_arrays_logs():
    pair = gamma(4).bind(mu="1.01")
    values = pair.evaluate([50.0, 100.0], full=True)
    one = pair.evaluate(100, dps=20)
    assert values.value.dtype == np.float64
    assert abs(values.value[1] - float(one)) <= values.error[1]
    assert pair.evaluate(10**6, log=True) == pytest.approx(
        float(pair.evaluate(10**6, dps=20, log=True))
    )
    with pytest.raises(sa.RangeError, match="log=True"):
        pair.evaluate(10**6)
    wave = sa.uniform_integral("I*(t**3/3 - t)", 1, "t", "-oo", "oo")
    assert isinstance(wave.evaluate(5), complex)
    shown = str(wave.evaluate(5, dps=20, full=True))
    text, _, error = shown.partition(" ± ")
    true = wave.evaluate(5, dps=30)
    assert abs(complex(text.replace(" ", "")) - complex(true)) <= float(error.split()[0])
    with pytest.raises(AccuracyError, match="complex"):
        wave.evaluate(5, log=True)


def test_precision_outside_is_no_matter():
    pair = bessel(3).bind(z="0.9")
    with mpmath.workdps(4):
        first = pair.evaluate(30, dps=20)
        assert mp.dps == 4
    with mpmath.workdps(60):
        assert bessel(3).bind(z="0.9").evaluate(30, dps=20) == first


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("x**2", 1, "2x", 0, 1), "variable of integration"),
        ((5, 1, "x", 0, 1), "does not contain x"),
        (("x + I*x", 1, "x", 0, 1), "neither real nor imaginary"),
        (("-x**2", 0, "x", 0, 1), "g is 0"),
        (("-x**2", "x + I", "x", 0, 1), "constant times a real"),
        (("-x**2", 1, "x", 1, 0), "less than b"),
        (("-x**2", 1, "x", "x", 2), "free of it"),
        (("-x**2", 1, "x", 0, 1, 0), "from 1 to"),
        (("-x**2", 1, "x", 0, 1, 2.5), "number of terms"),
        (("x**2", 1, "x", "-oo", "oo"), "diverges"),
        (("-x**4", 1, "x", -1, 1), "flatter than a parabola"),
        (("-x**2", "sqrt(Abs(x))", "x", -1, 1), "no Taylor series"),
        (("I*x", 1, "x", -1, 1), "no two saddles"),
        (("I*cos(x)", 1, "x", -10, 10), "no other"),
        (("I*(x**3/3 - x)", 1, "x", "-1/2", 3), "no other"),
        (("x**3/3 - x", 1, "x", "1 - I*pi", "1 + I*pi"), "complex infinity"),
        (("x**3/3 - x", 1, "x", "-oo - I*pi", "-oo + I*pi"), "other side"),
        (("-x**2", 1, "x", "I", 2), "complex infinity"),
        (("-x**2", "oo", "x", 0, 1), "constant times a real"),
        (("-oo*x**2", 1, "x", 0, 1), "neither real nor imaginary"),
        (("Ai*x - x**3/3", (1, 1), "x", "-oo", "oo"), "has a parameter Ai, which the formula"),
        (("-x**2", 1, "x", "lam", 1), "has a parameter lam, which the formula"),
        (("-x**2", "1/(x - 3/10)", "x", -1, 1), "pole"),
        (("I*(x**3/3 - x)", "1/(x - 19/10)", "x", -2, 2), "pole"),
        (("I*Abs(x)", 1, "x", -1, 1), "kinks"),
        ((sympy.I * sympy.zeta(sympy.Symbol("x")), 1, "x", -1, 1), "not among the functions"),
        (("Abs(x - 1) - Abs(x - 2)", 1, "x", 0, 1), "f is|no maximum|constant"),
    ],
)
def test_bad_input(arguments, sentence):
    with pytest.raises(InputError, match=sentence):
        sa.uniform_integral(*arguments).evaluate(10)


def test_bad_calls():
    free = bessel(2)
    assert free.error_kind == "none"
    assert free.parameters == (sympy.Symbol("z"),)
    with pytest.raises(InputError, match="call bind"):
        free.evaluate(3)
    with pytest.raises(InputError, match="call bind"):
        free.coefficients()
    with pytest.raises(InputError, match="not a parameter"):
        free.bind(y=1)
    with pytest.raises(InputError, match="greater than 0"):
        free.bind(z=1).evaluate(0)
    with pytest.raises(InputError, match="no zeta"):
        gamma(2).bind(mu=1).coefficients()
    with pytest.raises(AccuracyError, match="too far apart"):
        bessel(2).bind(z="1e-30").evaluate(10)


ALPHA = sympy.Symbol("alpha", positive=True)
T = sympy.Symbol("t")


@pytest.mark.parametrize("order", [1, 3])
@pytest.mark.parametrize("case", ["bessel", "turned", "waves", "gamma", "both ends", "on the end"])
def test_formula_and_numbers(case, order):
    """The formula comes from series at each saddle, the number from both at once."""
    oo, i, pi, saddles = sympy.oo, sympy.I, sympy.pi, None
    if case in ("bessel", "turned"):
        side = 1 if case == "bessel" else -1
        f = side * (sympy.sinh(T) / sympy.cosh(ALPHA) - T)
        ends = (side * oo - i * pi, side * oo + i * pi)
        integral = (f, sympy.exp(T / 5) / (2 * pi * i), T, *ends)
        saddles = (-ALPHA, ALPHA)
    elif case == "waves":
        integral = (i * (T**3 / 3 - ALPHA**2 * T), 1 / (9 + T + T**2), T, -oo, oo)
    elif case == "gamma":
        integral = (sympy.log(T) - T, 1 / T, T, ALPHA, oo)
    elif case == "on the end":
        integral = (-((T - ALPHA) ** 2) - (T - ALPHA) ** 3 / 3, sympy.exp(T / 5), T, ALPHA, oo)
        saddles = (ALPHA,)
    else:
        integral = (-((T - ALPHA) ** 2) - (T - ALPHA) ** 4 / 3, sympy.cos(T), T, 0, 1)
        saddles = (ALPHA,)
    expansion = sa.uniform_integral(*integral, order)
    found = expansion.expression_in("lam", saddles=saddles)
    modules = [{"airyaiprime": lambda y: mp.airyai(y, derivative=1)}, "mpmath"]
    formula = sympy.lambdify([ALPHA, sympy.Symbol("lam", positive=True)], found, modules)
    value = expansion.bind(alpha="3/5").evaluate(30, dps=20)
    with mp.workdps(40):
        assert abs(formula(mp.mpf(3) / 5, 30) - value) <= 1e-19 * abs(value)


def test_formulas_refused():
    with pytest.raises(InputError, match="order is 4"):
        gamma(4).expression_in()
    with pytest.raises(InputError, match="real zeros|not a maximum"):
        bessel(1).expression_in()
    with pytest.raises(InputError, match="0 maxima"):
        sa.uniform_integral("-x", 1, "x", 0, 1, 1).expression_in()
    with pytest.raises(InputError, match="slope of 0 at the end x = pi"):
        sa.uniform_integral("cos(x)", 1, "x", 0, "pi").expression_in()
    with pytest.raises(InputError, match="has kinks"):
        sa.uniform_integral("-Abs(x)", 1, "x", 0, "oo").expression_in()


def test_half_a_gaussian() -> None:
    half = sa.uniform_integral("-x**2", 1, "x", 0, "oo")
    lam = sympy.Symbol("lam", positive=True)
    assert half.expression_in("lam") == sympy.sqrt(sympy.pi / lam) / 2
    assert "NaN" not in half.latex()


@pytest.mark.parametrize("verb", [sa.laplace_integral, sa.uniform_integral])
def test_what_oscillates_without_end_is_refused(verb) -> None:
    with pytest.raises(InputError, match="does not fall as x tends to oo"):
        verb("sin(x)", 1, "x", 0, "oo")


def test_the_verbs_of_expansions() -> None:
    """Expression, terms, error and LaTeX; code where a language has the functions."""
    near = sa.uniform_integral("-x**2/2 + 2*x", "1 + x", "x", 0, "oo", 2)
    assert sum(near.terms) == near.expression
    (lam,) = near.expression.free_symbols
    with mpmath.workdps(30):
        got = sympy.lambdify(lam, near.expression, "mpmath")(mpmath.mpf(7))
        assert abs(got / near.evaluate(7, dps=25) - 1) < 1e-24
    assert "estimate" in near.error
    assert "erfc" in near.latex()
    with pytest.raises(sa.InputError, match="no closed form to emit"):
        near.emit("c")
    waves = sa.uniform_integral("I*(x**3/3 - alpha*x)", 1, "x", "-oo", "oo", 1)
    assert "none claimed" in waves.error
    assert waves._repr_latex_() is None
