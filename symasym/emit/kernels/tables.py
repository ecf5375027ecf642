"""Tables of `symasym.special.airy` and `.dawson` as constants of an emitted file.

The library and the files it writes so hold the same numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, partial
from operator import mul

from symasym.emit.kernels.kernel import named
from symasym.special.airy import airy_parts
from symasym.special.dawson import dawson_parts
from symasym.special.tables import Table

#: Ai² + Bi², Ai'² + Bi'², Bi and Bi' of those that the library has.
_PRODUCTS = (0, 2, 3, 4)
#: In place of Bi and Bi', below: real and imaginary parts without their turning.
_BELOW = (0, 2, 3, 4, 5, 6)
#: Radau, 16 points in (0, 1], zeros of P_16 - P_15 moved there, and their weights.
_RADAU = (
    0.00564068897251171, 0.029482298647942485, 0.07141295311515884, 0.12983102555359105,
    0.20249275505010406, 0.28660608625752704, 0.37893868864697805, 0.4759423084632349,
    0.5738891609066858, 0.6690151950299599, 0.7576647390313427, 0.8364309606056102,
    0.902286700679378, 0.9527004099058333, 0.9857305452631743, 1.0,
)  # fmt: skip
_WEIGHTS = (
    0.014448569508407165, 0.03309475430506822, 0.050497839810891954, 0.06596284996653407,
    0.078893460902101, 0.08879239637636975, 0.09527914712767754, 0.09810439411951584,
    0.09715954485578392, 0.09248089074433267, 0.08424819892496124, 0.07277777261010113,
    0.05851017655193003, 0.04199264072248259, 0.02385111347384286, 0.00390625,
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
def airy(products: bool) -> dict[str, tuple[float, ...]]:
    """Name -> numbers, of all `products` or of Ai² + Bi² alone."""
    near, below, above = airy_parts()
    return {
        "_AIRY_NEAR": _flat(near, _PRODUCTS if products else (0,)),
        "_AIRY_BELOW": _flat(below, _BELOW if products else (0,)),
        "_AIRY_ABOVE": _flat(above, _PRODUCTS if products else (0,)),
    }


@cache
def dawson() -> dict[str, tuple[float, ...]]:
    """Name -> numbers, of e^{x²} erfc(x), Dawson's integral and that one's integral."""
    near, beyond = dawson_parts()
    return {"_DAWSON_NEAR": _flat(near, range(3)), "_DAWSON_BEYOND": _flat(beyond, range(3))}


@cache
def radau() -> dict[str, tuple[float, ...]]:
    """Name -> numbers: the points; of the polynomial through values at them, by which these are
    multiplied for its integral up to each, and for its last two Legendre coefficients."""
    rows, count = [], len(_RADAU)
    for t in _RADAU:
        p = [1.0, 2 * t - 1]
        for k in range(1, count):
            p.append(((2 * k + 1) * p[1] * p[k] - k * p[k - 1]) / (k + 1))
        rows.append(p)
    sums = [[p[1] + 1, *(p[k + 1] - p[k - 1] for k in range(1, count))] for p in rows]
    given = list(zip(_WEIGHTS, rows, strict=True))
    within = (w * sum(map(mul, upto, p)) / 2 for upto in sums for w, p in given)
    last = ((2 * k + 1) * w * p[k] for k in (count - 2, count - 1) for w, p in given)
    return {"_RADAU": _RADAU, "_RADAU_WITHIN": tuple(within), "_RADAU_LAST": tuple(last)}


def _flat(table: Table, chosen: Iterable[int]) -> tuple[float, ...]:
    """Function by function, piece by piece, ascending powers."""
    return tuple(float(x) for k in chosen for x in table.coefficients[k].T.ravel())


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
