"""Numbers of quadrature rules, and of Ai^2 + Bi^2, as constants of an emitted file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from operator import mul
from typing import Any

from flint import arb, arb_mat

from symasym.emit.kernels.kernel import named
from symasym.numbers.balls import precision

#: Gauss-Lobatto, 16 points of [0, 1], both ends among them, and their weights.
_LOBATTO = (
    0.0, 0.015215976864891033, 0.050399733453263956, 0.10399585406909247,
    0.17380564855875347, 0.2569702890564312, 0.35008476554961837, 0.4493368632390253,
    0.5506631367609747, 0.6499152344503816, 0.7430297109435688, 0.8261943514412465,
    0.8960041459309075, 0.949600266546736, 0.9847840231351089, 1.0,
)  # fmt: skip
_WEIGHTS = (
    0.004166666666666667, 0.025425180502959954, 0.0446968486629654, 0.06212769106625705,
    0.07701349040358214, 0.08874595669585206, 0.0968450119126018, 0.10097915408911494,
    0.10097915408911494, 0.0968450119126018, 0.08874595669585206, 0.07701349040358214,
    0.06212769106625705, 0.0446968486629654, 0.025425180502959954, 0.004166666666666667,
)  # fmt: skip
#: Gauss-Legendre, 16 points: those on the right, and their weights.
GAUSS = {
    "_GAUSS_X": (
        0.09501250983763744, 0.2816035507792589, 0.45801677765722737, 0.6178762444026438,
        0.755404408355003, 0.8656312023878318, 0.9445750230732326, 0.9894009349916499,
    ),
    "_GAUSS_W": (
        0.1894506104550685, 0.18260341504492358, 0.16915651939500254, 0.14959598881657674,
        0.12462897125553388, 0.09515851168249279, 0.062253523938647894, 0.027152459411754096,
    ),
}  # fmt: skip


@cache
def airy() -> dict[str, tuple[float, ...]]:
    """Name -> numbers: Ai² + Bi² times e^{-(4/3) z^(3/2)} where z > 1, by halves from -8 to 8;
    times |z|^(1/2) beyond them, in (8/|z|)^(3/2) from 0 to 1."""

    def fitted(f: Callable[[Any], Any], count: int) -> list[float]:
        """The polynomial through the values at Chebyshev's points."""
        nodes = [(arb.pi() * (2 * k + 1) / (2 * count)).cos() for k in range(count)]
        powers = arb_mat(count, count, [x**k for x in nodes for k in range(count)])
        return [
            float(c.mid()) for c in powers.solve(arb_mat(count, 1, [f(x) for x in nodes])).entries()
        ]

    def scaled(z: Any) -> Any:
        ai, _, bi, _ = z.airy()
        fall = (-4 * z * z.sqrt() / 3).exp() if z > 1 else 1
        return (ai * ai + bi * bi) * fall

    def beyond(sign: int) -> Callable[[Any], Any]:
        def of(t: Any) -> Any:
            size = 8 / ((t + 1) / 2).root(3) ** 2
            return scaled(sign * size) * size.sqrt()

        return of

    with precision(300):
        near = [fitted(lambda t, k=k: scaled((t + 1) / 4 + k / 2 - 8), 13) for k in range(32)]  # type: ignore[misc]
        return {
            "_AIRY_NEAR": tuple(x for row in near for x in row),
            "_AIRY_BELOW": tuple(fitted(beyond(-1), 14)),
            "_AIRY_ABOVE": tuple(fitted(beyond(1), 14)),
        }


@cache
def lobatto() -> dict[str, tuple[float, ...]]:
    """Name -> numbers: the points; of the polynomial through values at them, by which these are
    multiplied for its integral up to each, for its slope there (both by columns), and, in the left
    half, for its last two Legendre coefficients, of which the first is even and the second odd."""
    rows, count = [], len(_LOBATTO)
    for t in _LOBATTO:
        p = [1.0, 2 * t - 1]
        for k in range(1, count):
            p.append(((2 * k + 1) * p[1] * p[k] - k * p[k - 1]) / (k + 1))
        rows.append(p)
    # The square of the last polynomial is beyond the rule's degree: its sum is 2/(count - 1).
    norms = [*(2 * k + 1 for k in range(count - 1)), count - 1]
    sums = [[p[1] + 1, *((p[k + 1] - p[k - 1]) / (2 * k + 1) for k in range(1, count))]
            for p in rows]  # fmt: skip
    given = [[w * n * x for n, x in zip(norms, p[:count], strict=True)]
             for w, p in zip(_WEIGHTS, rows, strict=True)]  # fmt: skip
    top = [p[count - 1] for p in rows]
    slopes = [
        [0.0 if i == j else top[i] / top[j] / (s - t) for i, s in enumerate(_LOBATTO)]
        for j, t in enumerate(_LOBATTO)
    ]
    # The slope of 1 is 0.
    for i in range(count):
        slopes[i][i] = -sum(column[i] for column in slopes)
    return {
        "_LOBATTO": _LOBATTO,
        "_LOBATTO_WITHIN": tuple(sum(map(mul, upto, g)) / 2 for g in given for upto in sums),
        "_LOBATTO_SLOPE": tuple(x for column in slopes for x in column),
        "_LOBATTO_LAST": tuple(g[k] for k in (count - 2, count - 1) for g in given[: count // 2]),
    }


def written(name: str, values: Sequence[float], target: str) -> str:
    """A constant of "python", "c" or "javascript"."""
    own = name if target == "python" else named(name, target)
    opening, closing, indent = {
        "python": (f"{own} = (", ")", "    "),
        "c": (f"static const double {own}[{len(values)}] = {{", "};", "    "),
        "javascript": (f"const {own} = [", "];", "  "),
    }[target]
    rows = [", ".join(map(repr, values[k : k + 4])) for k in range(0, len(values), 4)]
    # C has no comma behind the last.
    inside = ",\n".join(f"{indent}{row}" for row in rows)
    return f"{opening}\n{inside}\n{closing}\n"


def helpers_of(tables: Mapping[str, Sequence[float]], target: str) -> dict[str, Callable[[], str]]:
    """The constants under the names that the language calls them by."""
    return {
        named(name, target): partial(written, name, values, target)
        for name, values in tables.items()
    }
