"""Truncated power series over any ring, and local expansions of Laplace-type integrals by them.

A series is the list of its coefficients of t^0, t^1, ...; what is beyond the list is unknown, and
an operation keeps as many as are known. Elements need + and * with each other, * and / with whole
numbers; quotients and powers divide by the first coefficient alone.

With V' = -phi, e^(lam V) and e^(-lam V) are expanded at a critical point (Watson's lemma), at any
other point (repeated integration by parts), and between the points (finite parts); each may have a
weight, as noise that depends on u gives them. A ring gives the functions of its elements:
`gamma(n)` = Gamma(n/2), `root(x, n)` = x^(n/2), `log`, `euler`, `ratio`; and `generic(c)`: the
series 1 + c_1 t + ... with a way back from its coefficients, which over SymPy are polynomials in
symbols for c_1, c_2, ... meanwhile.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from math import prod
from typing import Any


class Series:
    """c[0] + c[1] t + ... + O(t^len(c))."""

    __slots__ = ("c",)

    def __init__(self, c: Iterable[Any]) -> None:
        self.c = list(c)

    def __len__(self) -> int:
        return len(self.c)

    def __getitem__(self, k: int) -> Any:
        return self.c[k]

    def __add__(self, other: Series) -> Series:
        return Series(a + b for a, b in zip(self.c, other.c, strict=False))

    def __sub__(self, other: Series) -> Series:
        return Series(a - b for a, b in zip(self.c, other.c, strict=False))

    def __neg__(self) -> Series:
        return Series(-a for a in self.c)

    def __mul__(self, other: Any) -> Series:
        """The product with a series, or with an element of the ring."""
        if not isinstance(other, Series):
            return Series(a * other for a in self.c)
        a, b = self.c, other.c
        return Series(dot(a[: k + 1], b[k::-1]) for k in range(min(len(a), len(b))))

    def __truediv__(self, other: Any) -> Series:
        """The quotient q, from b q = a term by term."""
        if not isinstance(other, Series):
            return Series(a / other for a in self.c)
        b, q = other.c, list[Any]()
        for k in range(min(len(self), len(b))):
            q.append(_over(self.c[k] - dot(q, b[k:0:-1]) if k else self.c[0], b[0]))
        return Series(q)

    def power(self, p: Any, first: Any = None) -> Series:
        """The power p, rational or an element of the ring; `first` is that of the coefficient c[0].

        J. C. P. Miller's recurrence n a_0 b_n = sum (p k - n + k) a_k b_(n-k) (D. E. Knuth, The Art
        of Computer Programming 2, 4.7).
        """
        rational = isinstance(p, (int, Fraction))
        above, below = (p.numerator, p.denominator) if rational else (p, 1)
        a, b = self.c, [_power(self.c[0], p) if first is None else first]
        for n in range(1, len(a)):
            ks = [k for k in range(1, n + 1) if (a[k] == 0) is not True]
            factors = [above * k - below * (n - k) for k in ks]
            total = dot([b[n - k] * a[k] for k in ks], factors) / (n * below) if ks else a[0] * 0
            b.append(_over(total, a[0]))
        return Series(b)

    __pow__ = power

    def slope(self) -> Series:
        """The derivative."""
        return Series(a * k for k, a in enumerate(self.c) if k)

    def theta(self) -> Series:
        """t d/dt."""
        return Series(a * k for k, a in enumerate(self.c))


def dot(a: list[Any], b: list[Any]) -> Any:
    """The sum of a_k b_k."""
    row = [x * y for x, y in zip(a, b, strict=False)]
    return sum(row[1:], row[0])


def _over(x: Any, y: Any) -> Any:
    """x/y; nothing is asked of a polynomial over 1."""
    return x if (y == 1) is True else x / y


def _power(x: Any, p: Any) -> Any:
    """x^p; 1 stays 1, in whatever ring."""
    if (x == 1) is True or p == 1:
        return x
    if not isinstance(p, (int, Fraction)):
        return x**p
    return x ** int(p) if p.denominator == 1 else x ** ((x * 0 + p.numerator) / p.denominator)


# -- local expansions --------------------------------------------------------------------------


def watson(
    steep: Series, weight: Series | None, contact: int = 2, beta: Any = 1, *,
    first: int = 0, step: int = 1,
) -> Iterator[Any]:  # fmt: skip
    """d_k, k = first, first + step, ..., of Watson's lemma at any contact mu and power beta > 0.

    int_0 t^(beta-1) g(t) e^(-lam a t^mu (1 + alpha_1 t + ...)) dt ~ sum_k d_k Gamma(s_k)/(mu (a
    lam)^s_k), s_k = (k + beta)/mu, d_k = [t^k] g (1 + alpha_1 t + ...)^(-s_k): Lagrange's reversion
    in Watson's lemma (Perron's formula; DLMF 2.3(iii), 2.4(i); J. Wojdylo, SIAM Rev. 48 (2006) 76).
    `steep` is 1 + alpha_1 t + ..., `weight` is g, or None for 1; beta is rational or of the ring.
    """
    beta = Fraction(beta) if isinstance(beta, int) else beta
    for k in range(first, len(steep), step):
        power = Series(steep.c[: k + 1]) ** ((beta + k) / -contact)
        yield (power if weight is None else power * Series(weight.c[: k + 1]))[k]


def _generic(
    shape: Sequence[Any], weights: Sequence[Sequence[Any]], ring: Any
) -> tuple[Series, list[Series], Callable[[Any], Any]]:
    """1 + shape_1 t + ..., the weights over their first coefficients, as long, and the way back."""
    size = len(shape)
    tails = [c / w[0] for w in weights for c in w[1 : size + 1]]
    every, back = ring.generic([*shape, *tails])
    rows = [
        Series([every[0], *every.c[k * size + 1 : (k + 1) * size + 1]])
        for k in range(1, len(weights) + 1)
    ]
    front = prod(w[0] for w in weights)
    return Series(every.c[: size + 1]), rows, lambda x: back(x) * front if weights else back(x)


def steepness(
    phi: Sequence[Any], ring: Any, weights: Sequence[Sequence[Any]] = ()
) -> tuple[Any, Series, list[Series], Callable[[Any], Any]]:
    """a, and 1 + alpha_1 t + ..., weights, and their way back: V - V(z) = ±a t^2 (1 + alpha_1 t +
    ...) at a zero z of phi."""
    alpha = [c * 2 / (j + 2) / phi[1] for j, c in enumerate(phi[2:], start=1)]
    return (abs(phi[1]) / 2, *_generic(alpha, weights, ring))


def gaussian(
    phi: Sequence[Any], count: int, ring: Any, step: int = 2, weights: Sequence[Any] = ()
) -> list[Any]:
    """c_n of a peak at a zero of phi, sum of c_n lam^-(n+1/2), n < count; with step 1 those of its
    right half, c_k lam^-(k+1)/2."""
    a, steep, rows, back = steepness(phi[: 2 * count + 1], ring, weights)
    row = watson(steep, rows[0] if rows else None, step=step)
    return [
        back(d) * ring.gamma(k + 1) / ring.root(a, k + 1) / (3 - step)
        for k, d in zip(range(0, 2 * count, step), row, strict=False)
    ]


def slow(phi: Sequence[Any], count: int, ring: Any, weights: Sequence[Any] = ()) -> list[Any]:
    """h_1, ..., h_count at t = 0 where phi(0) is not 0: h_1 = weight/phi, h_(k+1) = -h_k'/phi.

    int w e^(-lam V) = e^(-lam V) sum h_k lam^-k and int w e^(lam V) = e^(lam V) sum h_k (-lam)^-k,
    w being the weight, formally, by repeated integration by parts (DLMF 2.3(i)).
    """
    shape, rows, back = _generic([c / phi[0] for c in phi[1:count]], weights, ring)
    h, row = shape**-1, []
    for w in rows:
        h = w * h
    for k in range(1, count + 1):
        row.append(back(h[0]) / phi[0] ** k)
        h = -h.slope() / shape
    return row


def slow_at_zero(
    phi: Sequence[Any], count: int, ring: Any, weights: Sequence[Sequence[Any]] = ()
) -> list[list[Any]]:
    """The coefficients of t^(1-2k), ..., t^-1 of h_k, k = 1 to count, at a simple zero of phi.

    With two weights h_k has the second, and the first is a factor.
    """
    shape, rows, back = _generic([c / phi[1] for c in phi[2 : 2 * count]], weights, ring)
    f, found = shape**-1, []
    f = rows[1] * f if rows else f
    for k in range(1, count + 1):
        of = rows[0] * f if rows else f
        found.append([back(c) / phi[1] ** k for c in of.c[: 2 * k - 1]])
        f = (f * (2 * k - 1) - f.theta()) / shape
    return found


def corner(
    c: Sequence[Any], barrier: bool, ring: Any, other: Sequence[Any]
) -> tuple[list[Any], list[Any]]:
    """Beside a start on a zero of phi, the double integral's coefficients of x^(n+1), and of
    x^(n+1) log lam.

    The finite part of int_0^oo s^i e^(-lam s^2/2) int_0^s t^j e^(lam t^2/2) dt ds for even i, j, a
    Mellin transform at its pole; psi(1/2 + m) = sum 2/(2k-1) - gamma - 2 log 2 (DLMF 5.4.15). What
    is odd in s or t is a product of one-sided series. `c` are Laplace's of both halves, of the
    density that has its peak there, `other` those with the weight of the other one.
    """
    # du = sum a_i s^i ds, c_n = a_2n Gamma(n + 1/2) 2^(n + 1/2).
    a, b = (
        [x / ring.gamma(2 * n + 1) / ring.root(ring.two, 2 * n + 1) for n, x in enumerate(row)]
        for row in (c, other)
    )
    plain, logs = [0] * len(c), [0] * len(c)
    for n in range(len(c)):
        for i in range(n + 1):
            j = n - i
            front = a[i] * b[j] * ring.gamma(2 * j + 1) / ring.gamma(1 - 2 * i)
            front = front * ((-2) ** (n + 1)) / (4 if barrier else -4)
            known = sum(
                (ring.ratio(2, 2 * k - 1) for k in range(1, (i if barrier else j) + 1)),
                -ring.euler - ring.log(ring.two),
            )
            plain[n], logs[n] = plain[n] + front * known, logs[n] - front
    return plain, logs


def finite_parts_in_s(
    phi: Sequence[Any], count: int, ring: Any, weights: Sequence[Sequence[Any]] = ()
) -> list[Any]:
    """How much int_x h_k grows when powers and log of s, not of u - x, are left out; phi(x) = 0.

    V - V(x) = ±s^2/2 and s = t sqrt(2 a) w(t): the constant term of t^-p in powers of s is
    [t^p] t w'/w, a residue (Lagrange).
    """
    a, steep, _, back = steepness(phi[: 2 * count + 1], ring)
    q = [back(c) / 2 for c in (steep.theta() / steep).c]
    return [
        sum((row[-1 - p] * q[p] / p for p in range(1, len(row))), row[-1] * ring.log(a * 2) / 2)
        for row in slow_at_zero(phi, count, ring, weights)
    ]


def pole_sums(poles: Any, lo: Any, hi: Any, count: int, ring: Any) -> list[Any]:
    """Finite parts of int h_k over [lo, hi] where h_k is the sum of its principal parts, as for a
    polynomial phi. `poles` are all its zeros z with phi's Taylor coefficients, whether z is real,
    and those of the weights."""
    row = [0] * count
    for z, phi, real, *weights in poles:
        high, low = hi - z, lo - z
        for k, c in enumerate(slow_at_zero(phi, count, ring, *weights)):
            for p, x in zip(range(-2 * k, 0), c, strict=False):
                row[k] = row[k] + x / p * (_finite_part(high, p) - _finite_part(low, p))
            row[k] = row[k] + c[-1] * ring.log_ratio(high, low, real)
    return row


def _finite_part(t: Any, p: int) -> Any:
    """t^p; at t = 0 its finite part."""
    return 0 if (t == 0) is True else t**p


def by_parts(ends: Any, integral: Callable[[int, int], Any], count: int) -> list[Any]:
    """int f_1 g_k phi, k = 1 to count, from f and g at both ends and `integral`(m, n) of f_(m+1)
    g_(n+1) phi, f and g being h with the two weights.

    g_(n+1) = (d/dV)^n g_1 and du = -dV/phi: half of the derivatives go over to the other factor, so
    that without weights of even k nothing but the ends is left.
    """

    def jump(i: int, j: int) -> Any:
        return ends[1][0][i] * ends[1][1][j] - ends[0][0][i] * ends[0][1][j]

    found, same = [], ends[0][0] is ends[0][1]
    for n in range(count):
        m = n // 2
        rest = jump(m, m) / 2 if n % 2 and same else -integral(m, n - m)
        found.append(-sum((jump(i, n - i - 1) * (-1) ** i for i in range(m)), rest * (-1) ** m))
    return found
