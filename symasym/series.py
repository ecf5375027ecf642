"""Truncated power series over any ring, and local expansions of Laplace-type integrals.

A series is the list of its known coefficients of t^0, t^1, ...; an operation returns all
coefficients that these determine. Elements of the ring need + and * with each other, * and / with
integers; quotients and powers of series divide only by the first coefficient.

With V' = -phi, the integrals of e^(lam V) and e^(-lam V) are expanded at critical points (Watson's
lemma) and at other points (repeated integration by parts); the regular part of T needs finite
parts between the points. If the noise depends on u, the integrands have weights. A ring provides
`gamma(n)` = Gamma(n/2), `root(x, n)` = x^(n/2), `log`, `euler`, `ratio`, and `generic(c)`, the
series 1 + c_1 t + ... with a map of results back to the ring; with SymPy, the coefficients are
meanwhile polynomials in symbols that stand for c_1, c_2, ...
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from math import prod
from numbers import Rational
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
        """The product with a series or with an element of the ring."""
        if not isinstance(other, Series):
            return Series(a * other for a in self.c)
        a, b = self.c, other.c
        return Series(dot(a[: k + 1], b[k::-1]) for k in range(min(len(a), len(b))))

    def __truediv__(self, other: Any) -> Series:
        """The quotient q = a/b, from the coefficients of b q = a."""
        if not isinstance(other, Series):
            return Series(a / other for a in self.c)
        b, q = other.c, list[Any]()
        for k in range(min(len(self), len(b))):
            q.append(_over(self.c[k] - dot(q, b[k:0:-1]) if k else self.c[0], b[0]))
        return Series(q)

    def power(self, p: Any, first: Any = None) -> Series:
        """The power p, rational or an element of the ring; `first` is c[0]^p, if known.

        J. C. P. Miller's recurrence n a_0 b_n = sum (p k - n + k) a_k b_(n-k) (D. E. Knuth, The Art
        of Computer Programming 2, 4.7).
        """
        rational = isinstance(p, Rational)
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
        """The series t dc/dt."""
        return Series(a * k for k, a in enumerate(self.c))


def dot(a: list[Any], b: list[Any]) -> Any:
    """The sum of the products a_k b_k."""
    row = [x * y for x, y in zip(a, b, strict=False)]
    return sum(row[1:], row[0])


def _over(x: Any, y: Any) -> Any:
    """x/y; for y = 1 there is no division, which polynomials may not support."""
    return x if (y == 1) is True else x / y


def _power(x: Any, p: Any) -> Any:
    """x^p; for x = 1 or p = 1 it is x without a computation."""
    if (x == 1) is True or p == 1:
        return x
    if not isinstance(p, Rational):
        return x**p
    return x**p.numerator if p.denominator == 1 else x ** ((x * 0 + p.numerator) / p.denominator)


# -- local expansions --------------------------------------------------------------------------


def watson(
    steep: Series, weight: Series | None, contact: int = 2, beta: Any = 1, *,
    first: int = 0, step: int = 1,
) -> Iterator[Any]:  # fmt: skip
    """The d_k, k = first, first + step, ..., of Watson's lemma for any `contact` mu and beta > 0.

    int_0 t^(beta-1) g(t) e^(-lam a t^mu (1 + alpha_1 t + ...)) dt ~ sum_k d_k Gamma(s_k)/(mu (a
    lam)^s_k), s_k = (k + beta)/mu, d_k = [t^k] g (1 + alpha_1 t + ...)^(-s_k): Watson's lemma with
    Lagrange's reversion (Perron's formula; DLMF 2.3(iii), 2.4(i); J. Wojdylo, SIAM Rev. 48 (2006)
    76). `steep` is 1 + alpha_1 t + ..., `weight` is g (None for 1), beta rational or in the ring.
    """
    beta = Fraction(beta) if isinstance(beta, int) else beta
    for k in range(first, len(steep), step):
        power = Series(steep.c[: k + 1]) ** ((beta + k) / -contact)
        yield (power if weight is None else power * Series(weight.c[: k + 1]))[k]


def _generic(
    shape: Sequence[Any], weights: Sequence[Sequence[Any]], ring: Any
) -> tuple[Series, list[Series], Callable[[Any], Any]]:
    """Generic series 1 + shape_1 t + ..., the weights over their first terms, and the way back."""
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
    """a, 1 + alpha_1 t + ..., the weights, and the way back from generic series, where
    V - V(z) = ±a t^2 (1 + alpha_1 t + ...) at a zero z of phi."""
    alpha = [c * 2 / (j + 2) / phi[1] for j, c in enumerate(phi[2:], start=1)]
    return (abs(phi[1]) / 2, *_generic(alpha, weights, ring))


def gaussian(
    phi: Sequence[Any], count: int, ring: Any, step: int = 2, weights: Sequence[Any] = ()
) -> list[Any]:
    """The c_n, n < count, of the contribution sum c_n lam^-(n+1/2) of a zero of phi; with step 1
    the c_k of its right half, sum c_k lam^(-(k+1)/2)."""
    a, steep, rows, back = steepness(phi[: 2 * count + 1], ring, weights)
    row = watson(steep, rows[0] if rows else None, step=step)
    return [
        back(d) * ring.gamma(k + 1) / ring.root(a, k + 1) / (3 - step)
        for k, d in zip(range(0, 2 * count, step), row, strict=False)
    ]


def slow(phi: Sequence[Any], count: int, ring: Any, weights: Sequence[Any] = ()) -> list[Any]:
    """h_1, ..., h_count at t = 0 for phi(0) != 0, where h_1 = w/phi, h_(k+1) = -h_k'/phi.

    With the weight w, repeated integration by parts (DLMF 2.3(i)) gives, as formal antiderivatives,
    int w e^(-lam V) = e^(-lam V) sum h_k lam^-k and int w e^(lam V) = e^(lam V) sum h_k (-lam)^-k.
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
    phi: Sequence[Any], count: int, ring: Any, weights: Sequence[Any] = (), more: int = 0
) -> list[list[Any]]:
    """For k = 1 to count, the coefficients of t^(1-2k), ..., t^-1, and of `more` powers, of h_k at
    a simple zero of phi.

    If there are two weights, h_1 contains the second, and each h_k is multiplied by the first.
    """
    shape, rows, back = _generic([c / phi[1] for c in phi[2 : 2 * count + more]], weights, ring)
    f, found = shape**-1, []
    f = rows[1] * f if rows else f
    for k in range(1, count + 1):
        of = rows[0] * f if rows else f
        found.append([back(c) / phi[1] ** k for c in of.c[: 2 * k - 1 + more]])
        f = (f * (2 * k - 1) - f.theta()) / shape
    return found


def corner(
    c: Sequence[Any], barrier: bool, ring: Any, other: Sequence[Any]
) -> tuple[list[Any], list[Any]]:
    """For a start on a zero of phi, the coefficients in the double integral of lam^-(n+1) and of
    lam^-(n+1) log lam.

    They come from the finite part of int_0^oo s^i e^(-lam s^2/2) int_0^s t^j e^(lam t^2/2) dt ds
    for even i, j, a Mellin transform at its pole; psi(1/2 + m) = sum 2/(2k-1) - gamma - 2 log 2
    (DLMF 5.4.15). Terms odd in s or t are products of one-sided series. `c` is the Laplace series
    of the density with its peak there, `other` the one with the weight of the other density.
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
    """The increase of Hadamard's finite part of int_x h_k, phi(x) = 0, if the divergent terms
    omitted are powers and the logarithm of s instead of u - x.

    V - V(x) = ±s^2/2, s = t sqrt(2 a) w(t); t^-p has in s the constant term [t^p] t w'/w (Lagrange)
    """
    a, steep, _, back = steepness(phi[: 2 * count + 1], ring)
    q = [back(c) / 2 for c in (steep.theta() / steep).c]
    return [
        sum((row[-1 - p] * q[p] / p for p in range(1, len(row))), row[-1] * ring.log(a * 2) / 2)
        for row in slow_at_zero(phi, count, ring, weights)
    ]


def pole_sums(poles: Any, lo: Any, hi: Any, count: int, ring: Any) -> list[Any]:
    """Hadamard's finite parts of int h_k over [lo, hi] if h_k is the sum of its principal parts, as
    for a polynomial phi. `poles` has every zero z of phi with phi's Taylor coefficients, whether z
    is real, and the weights' Taylor coefficients."""
    row = [0] * count
    for z, phi, real, *weights in poles:
        high, low = hi - z, lo - z
        for k, c in enumerate(slow_at_zero(phi, count, ring, *weights)):
            for p, x in zip(range(-2 * k, 0), c, strict=False):
                row[k] = row[k] + x / p * (_finite_part(high, p) - _finite_part(low, p))
            row[k] = row[k] + c[-1] * ring.log_ratio(high, low, real)
    return row


def _finite_part(t: Any, p: int) -> Any:
    """t^p, or its finite part 0 at t = 0."""
    return 0 if (t == 0) is True else t**p


def by_parts(ends: Any, integral: Callable[[int, int], Any], count: int) -> list[Any]:
    """int f_1 g_k phi du, k = 1 to count, where f and g are h with the first and second weight.
    `ends` has f and g at both ends, and `integral`(m, n) is that of f_(m+1) g_(n+1) phi.

    As g_(n+1) = (d/dV)^n g_1 and du = -dV/phi, integration by parts moves half of the derivatives
    to f; without weights only end-point terms remain for even k.
    """

    def jump(i: int, j: int) -> Any:
        return ends[1][0][i] * ends[1][1][j] - ends[0][0][i] * ends[0][1][j]

    found, same = [], ends[0][0] is ends[0][1]
    for n in range(count):
        m = n // 2
        rest = jump(m, m) / 2 if n % 2 and same else -integral(m, n - m)
        found.append(-sum((jump(i, n - i - 1) * (-1) ** i for i in range(m)), rest * (-1) ** m))
    return found
