"""A free parameter whose sign decides where f is largest is asked for."""

import pytest
import sympy

import symasym as sa

X = sympy.Symbol("x")


@pytest.mark.parametrize(
    ("f", "ends", "words"),
    [
        ("-x**2/2 - c*x**4", ("-oo", "oo"), "; c must be positive: pass Symbol.'c', positive=True"),
        ("c*x", (0, "oo"), "; c must be negative: pass Symbol.'c', negative=True"),
        ("-b*x**6 - c*x**2", ("-oo", "oo"), "depends on the sign of b, c; pass"),
        ("c*x**2", (-1, 1), "depends on the sign of c; pass .*positive=True.* or .*negative=True"),
    ],
)
def test_a_sign_is_asked_for(f: str, ends: tuple[object, object], words: str) -> None:
    with pytest.raises(sa.InputError, match=words) as error:
        sa.laplace_integral(f, 1, "x", *ends)
    assert "diverges" not in str(error.value)


def test_with_the_sign_it_is_answered() -> None:
    c = sympy.Symbol("c", positive=True)
    (own,) = sa.laplace_integral(-(X**2) / 2 - c * X**4, 1, X, "-oo", "oo", order=2).contributions
    root = sympy.sqrt(2 * sympy.pi)
    # Gaussian moments: E x^4 = 3.
    assert [sympy.simplify(k / root) for k in own.coefficients] == [1, -3 * c]


def test_what_no_sign_decides_is_refused_as_before() -> None:
    with pytest.raises(sa.InputError, match="could not be decided|no isolated maximum"):
        sa.laplace_integral("-(x - a)**2*(x - b)**2 + a*x", 1, "x", -10, 10)
