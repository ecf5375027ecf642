"""float64 panel rules: what one short interval does to an escape problem.

With e(x) = exp(lam (V(x) - V(a))) on a panel [a, b], the escape problem needs
e(b), the integrals of e and 1/e, and the double integral of e(w)/e(x) over
w < x. Which scalings of them stay of moderate size depends on the sign of
V(b) - V(a), so a panel is recorded by four numbers per direction:

=========== ============================ ============================
field       down, V(b) <= V(a)           up, V(b) > V(a)
=========== ============================ ============================
rise        lam (V(b) - V(a))            the same
int_e       int e                        int e / e(b)
int_inverse e(b) int 1/e                 int 1/e
nested      e(b) int int e(w)/e(x)       int int e(w)/e(x)
=========== ============================ ============================

All are positive and none grows with lam, so nothing cancels or overflows. The rules take arrays, or
arrays that carry their derivatives (`symasym.numbers.float_arrays`).
"""

from __future__ import annotations

import math
import threading
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from symasym.base.inputs import FloatArray
from symasym.generated.numpy_formulas import (
    constant_nested_down,
    constant_nested_up,
    constant_single,
)
from symasym.numbers.arithmetic import FLOATS
from symasym.numbers.float_arrays import value_of
from symasym.special.exponentials import quotients

#: Largest lam |V(b) - V(a)| (roughly) of a panel that samples the exponential:
#: beyond it the ratio e^8 of largest to smallest sample costs rounding digits.
REACH = 8.0
#: A slow panel needs lam phi^2/|phi'| above this: nine terms of the slow
#: series then leave (2k-1)!! 400^-k < 1e-16.
SLOWNESS = 400.0
NODES = 16
#: The same where V falls all along: the nested integral is then all but a product of single ones.
REACH_DOWN = 11.0
#: Largest relative truncation error of a sampled panel.
RESOLUTION = 2e-13
_SLOW_TERMS = 9
_BEND = 24.0
#: Numbers of memory that `sampled` takes a panel.
WORK = 2 * NODES + 6
#: Panels at once, which stay in the cache.
AT_ONCE = 2048
#: Rows of a product of matrices at once, below the size at which BLAS starts threads; and columns.
_ROWS = 400
COLUMNS = 800


_kept = threading.local()


def memory() -> list[FloatArray]:
    """Memory for the exponents of `AT_ONCE` panels, and for `sampled`; of each thread the same."""
    if not hasattr(_kept, "parts"):
        _kept.parts = [np.empty(AT_ONCE * n) for n in (NODES, WORK)]
    parts: list[FloatArray] = _kept.parts
    return parts


class Moments(NamedTuple):
    """The record of a panel (see the module's table); `rise` may be as large as lam."""

    rise: FloatArray
    int_e: FloatArray
    int_inverse: FloatArray
    nested: FloatArray


class Rule(NamedTuple):
    """A quadrature rule on [0, 1]: nodes, weights, and two matrices of the same nodes."""

    nodes: FloatArray
    weights: FloatArray
    integrate: FloatArray  # values -> running integral from 0 at the nodes
    differentiate: FloatArray


@cache
def gauss() -> Rule:
    """Gauss-Legendre. Nested integrals by `integrate` inherit the order 2 n of the outer rule."""
    x, w = np.polynomial.legendre.leggauss(NODES)
    p = np.polynomial.legendre.legvander(x, NODES)
    k = np.arange(NODES)
    to_coefficients = (k[:, None] + 0.5) * p[:, :NODES].T * w
    running = np.empty((NODES, NODES))
    running[:, 0] = x + 1
    running[:, 1:] = (p[:, 2:] - p[:, :-2]) / (2 * k[1:] + 1)
    return Rule((x + 1) / 2, w / 2, running @ to_coefficients / 2, np.empty((0, 0)))


@cache
def lobatto() -> Rule:
    """Chebyshev-Lobatto (both ends are nodes) with Clenshaw-Curtis weights."""
    n = NODES
    angle = np.pi * np.arange(n + 1) / n
    x = -np.cos(angle)
    c = np.ones(n + 1)
    c[0] = c[-1] = 2
    c *= (-1.0) ** np.arange(n + 1)
    difference = x[:, None] - x[None, :] + np.eye(n + 1)
    d = np.outer(c, 1 / c) / difference
    d -= np.diag(d.sum(axis=1))
    w = np.ones(n - 1)
    for k in range(1, n // 2):
        w -= 2 * np.cos(2 * k * angle[1:-1]) / (4 * k * k - 1)
    w -= np.cos(n * angle[1:-1]) / (n * n - 1)
    weights = np.concatenate(([1 / (n * n - 1)], 2 * w / n, [1 / (n * n - 1)]))
    return Rule((x + 1) / 2, weights / 2, np.empty((0, 0)), 2 * d)


@cache
def running_powers(count: int, terms: int) -> tuple[FloatArray, FloatArray]:
    """Half the integrals of t^k from the left end of each of `count` equal panels of [-1, 1].

    To the panel's Gauss nodes, shape (count, NODES, terms), and to its right end (count, terms).
    """
    rule = gauss()
    ends = np.append(rule.nodes, 1.0)
    left = 2 * np.arange(count)[:, None, None] / count - 1
    t = left + 2 / count * np.outer(ends, rule.nodes)
    powers = t[:, None] ** np.arange(terms)[:, None, None]
    whole = powers @ rule.weights * (ends / count)
    to_nodes = np.ascontiguousarray(whole[..., :-1].swapaxes(1, 2))
    return to_nodes, np.ascontiguousarray(whole[..., -1])


#: Terms of q up to which `REACH` and the slope of q alone keep e^{lam V} resolved.
PLAIN = 6


@cache
def bends(terms: int) -> FloatArray:
    """Largest Taylor coefficients of q on a panel, in half widths, from that of t^2 on.

    On the ellipse about the panel whose half axes have the sum 5.8, and |t| is below 3, each of
    them moves lam V by e^12 at most, and there 16 nodes miss 5.8^-32. Without them what is missed
    doesn't show in the last Legendre coefficients: of e^x, x = T_11 + T_13, these are small.
    """
    k = np.arange(2, terms)
    largest: FloatArray = _BEND * (k + 1) / 3.0 ** (k + 1)
    return largest


@cache
def binomials(terms: int) -> FloatArray:
    """Binomial coefficients of j over k, rows k from 2, columns j."""
    rows = [[math.comb(j, k) for j in range(terms)] for k in range(2, terms)]
    return np.array(rows, dtype=np.float64)


@cache
def lobatto_powers(terms: int) -> FloatArray:
    """t^k at the Lobatto nodes of [-1, 1], shape (NODES + 1, terms)."""
    powers: FloatArray = (2 * lobatto().nodes[:, None] - 1) ** np.arange(terms)
    return powers


def exponents_of_series(
    series: FloatArray, count: int, out: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Exponents on blocks of `count` equal panels each, and how far lam V rises on a panel.

    Parameters
    ----------
    series : array of shape (terms, blocks)
        Taylor coefficients of lam phi h about the middle of a block of width h, in half widths.
    count : int
    out : array of shape (count, NODES, blocks), optional
        Where the exponents are put.

    Returns
    -------
    exponents : array of shape (count, NODES, blocks)
        lam int phi from the left end of each panel to its Gauss nodes.
    rise : array of shape (count, blocks)
    """
    to_nodes, whole = running_powers(count, series.shape[0])
    return np.matmul(to_nodes, series, out=out), -(whole @ series)


def exponents_of_values(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The same from lam phi times a panel's width at the Gauss nodes, shape (…, NODES, blocks)."""
    rule = gauss()
    return rule.integrate @ values, -(rule.weights @ values)


@cache
def last_coefficients() -> FloatArray:
    """Matrix from values at the Gauss nodes to the mean and the last two Legendre coefficients."""
    x, w = np.polynomial.legendre.leggauss(NODES)
    k = np.array([0, NODES - 2, NODES - 1])
    p = np.polynomial.legendre.legvander(x, NODES - 1)[:, k]
    return np.ascontiguousarray((p * w[:, None] * (k + 0.5)).T)


@cache
def _running_and_last() -> FloatArray:
    """`Rule.integrate` of Gauss-Legendre and, below it, `last_coefficients`."""
    return np.vstack((gauss().integrate, last_coefficients()))


def by_columns(matrix: FloatArray, x: FloatArray) -> FloatArray:
    """matrix @ x in pieces of columns: threads of BLAS cost more than they save."""
    number = COLUMNS * NODES**2 // matrix.size
    if x.shape[1] <= number:
        return matrix @ x
    result = np.empty((len(matrix), x.shape[1]))
    for low in range(0, x.shape[1], number):
        some = slice(low, low + number)
        result[:, some] = matrix @ x[:, some]
    return result


def product(x: Any, matrix: FloatArray) -> Any:
    """x @ matrix in pieces of `_ROWS`: threads of BLAS cost more than they save on short rows."""
    whole = len(x) // _ROWS * _ROWS if isinstance(x, np.ndarray) else 0
    if whole <= _ROWS:
        return x @ matrix
    result = np.empty((len(x), *matrix.shape[1:]))
    pieces, places = (y[:whole].reshape(-1, _ROWS, *y.shape[1:]) for y in (x, result))
    np.matmul(pieces, matrix, out=places)
    np.matmul(x[whole:], matrix, out=result[whole:])
    return result


def sampled(
    exponents: FloatArray, rise: FloatArray, h: FloatArray, work: FloatArray | None = None
) -> tuple[Moments, FloatArray]:
    """Blocks of equal panels on which the exponential is sampled, and their truncation errors.

    Parameters
    ----------
    exponents, rise : arrays of shape (panels, NODES, blocks) and (panels, blocks)
        See `exponents_of_series`. A block's exponents must stay within the range of float64.
    h : array of shape (blocks,)
        The widths of the blocks.
    work : array, optional
        See `integrals`.
    """
    int_e, int_inverse, nested, missed = integrals(exponents, work)
    nested = nested.sum(axis=0)
    if rise.shape[0] > 1:
        # As they stand at the left end of the block: neighbours differ by one exponential only.
        ahead = np.multiply.accumulate(np.exp(rise[:-1]))
        int_e[1:] *= ahead
        int_inverse[1:] /= ahead
        nested += (np.add.accumulate(int_e)[:-1] * int_inverse[1:]).sum(axis=0)
    h = h / rise.shape[0]
    rise = rise.sum(axis=0)
    up = rise > 0
    end = np.exp(np.where(up, -rise, rise))
    up_end, down_end = np.where(up, end, 1.0) * h, np.where(up, 1.0, end) * h
    int_e, int_inverse = int_e.sum(axis=0), int_inverse.sum(axis=0)
    moments = Moments(rise, int_e * up_end, int_inverse * down_end, nested * h * down_end)
    return moments, missed.max(axis=0)


def integrals(exponents: FloatArray, work: FloatArray | None = None) -> tuple[FloatArray, ...]:
    """The integrals of e, of 1/e and the nested one over panels of width 1, e = 1 at their left
    ends, and what 16 nodes miss of them.

    What they miss of e and of 1/e is orthogonal to the polynomials they hold, so that the
    nested integral loses only the product of both. The errors are relative and come from the last
    Legendre coefficients; the factors are what 10^5 random panels of degree up to 8 need, and more.

    Parameters
    ----------
    exponents : array of shape (panels, NODES, blocks)
    work : array of `WORK` times as many numbers as there are panels, optional
        Memory to be used beside that of plain `exponents`, which are overwritten then: getting it
        anew takes as long as filling it.
    """
    shape = exponents.shape[0], exponents.shape[2]
    places: Any = [None] * 4
    if work is not None:
        e_place, both = arrays_in(work, (NODES, NODES + 6), shape)
        places = [exponents, e_place, both[:, : NODES + 3], both[:, NODES + 3 :]]
    inverse_e: Any = np.exp(exponents, out=places[0])  # 1/e at the nodes
    e = np.divide(1.0, inverse_e, out=places[1])  # costs less than a second exponential
    # One product of matrices for each: the running integral, the mean, the last coefficients.
    inner: Any = np.matmul(_running_and_last(), e, out=places[2])
    last: Any = np.matmul(last_coefficients(), inverse_e, out=places[3])
    int_e, int_inverse = inner[:, NODES], last[:, 0]
    if work is None:
        both = np.concatenate((value_of(inner), value_of(last)), axis=1)
    # Of e and of 1/e: the mean, and the moduli of the last coefficients.
    ends = both[:, NODES:].reshape(shape[0], 2, 3, shape[1])
    off = np.abs(ends[:, :, 1:])
    off = off[:, :, 0] + off[:, :, 1]
    shares = off / ends[:, :, 0]
    single = np.maximum(shares[:, 0], shares[:, 1])
    inner = inner[:, :NODES]
    inner *= inverse_e
    nested = gauss().weights @ inner
    missed = 2e-4 * off[:, 0] * off[:, 1] / value_of(nested) + 6e-4 * single * single
    return int_e, int_inverse, nested, missed


def arrays_in(
    memory: FloatArray, rows: tuple[int, ...], shape: tuple[int, ...]
) -> list[FloatArray]:
    """Arrays with these numbers of rows between the axes of `shape`, one after the other."""
    result, low = [], 0
    for n in rows:
        high = low + n * math.prod(shape)
        result.append(memory[low:high].reshape(shape[0], n, *shape[1:]))
        low = high
    return result


def slow_terms(x: FloatArray) -> list[FloatArray]:
    """Terms t_0 = 1/|x|, t_{k+1} = t_k'/|x| at the Lobatto nodes of [0, 1].

    Their alternating sum solves M' = 1 - |x| M and their sum solves Q' = -1 + |x| Q, the solutions
    that follow the drift without a layer.
    """
    # Memory got at once: fresh arrays take three times as long.
    places: Any = [None] * _SLOW_TERMS
    if isinstance(x, np.ndarray):
        places = np.empty((_SLOW_TERMS, *x.shape))
    terms = [np.divide(1.0, np.abs(x), out=places[0])]
    derivative = lobatto().differentiate.T
    for place in places[1:]:
        terms.append(np.multiply(product(terms[-1], derivative), terms[0], out=place))
    return terms


def slow(x: FloatArray, h: FloatArray) -> Moments:
    """Panels on which lam|phi| is so large that integrals live in layers at the ends.

    Parameters
    ----------
    x : array of shape (panels, NODES + 1)
        lam phi h at the Lobatto nodes, of one sign per panel.
    h : array of shape (panels,)
    """
    rule = lobatto()
    terms = slow_terms(x)
    # The smallest first.
    even, odd = terms[-1] + terms[-3], terms[-2] + terms[-4]
    for term in terms[-5::-2]:
        even += term
    for term in terms[-6::-2]:
        odd += term
    m, q = even - odd, even + odd
    rise = -(x @ rule.weights)
    decay = np.exp(-np.abs(rise))
    up = rise > 0
    # Layer at the end where 1/e is largest, and at the one where e is (roles of m and q
    # swap with the direction because the layer must decay away from its end).
    m_in, m_out, q_in, q_out = m[:, 0], m[:, -1], q[:, 0], q[:, -1]
    m_moment = m_out - m_in * decay
    q_moment = q_in - q_out * decay
    both_up = m @ rule.weights - m_in * q_moment
    both_down = q_in * m_moment - decay * (q @ rule.weights)
    return Moments(
        rise,
        h * np.where(up, m_moment, q_moment),
        h * np.where(up, q_moment, m_moment),
        h * h * np.where(up, both_up, both_down),
    )


def constant(lam_a: FloatArray, h: FloatArray) -> Moments:
    """Panels of any width on which the drift is constant, in closed form.

    Parameters
    ----------
    lam_a, h : arrays of shape (panels,)
        lam times the drift, and the width.
    """
    x, up = np.abs(lam_a * h), lam_a < 0
    small = x < 0.5
    some = small.any()
    safe = np.where(small, 1.0, x) if some else x
    first = constant_single(safe)
    # Both lose digits for small x.
    second = np.where(up, constant_nested_up(safe, first), constant_nested_down(safe, first))
    if some:
        phi_1, phi_2 = quotients(-x[small], FLOATS)
        first[small], second[small] = phi_1, np.where(up[small], phi_2, phi_1 - phi_2)
    single = h * first
    return Moments(np.where(up, x, -x), single, single, h * h * second)


def merge_slow(
    scene: np.ndarray, moments: Moments, slow_panel: np.ndarray
) -> tuple[np.ndarray, Moments]:
    """Join neighbouring slow panels of one scene and one direction into one record.

    Returns the index of the first panel of each record, and the records.

    Their exponents exceed 40, so of the joint integrals only the layer at each
    end is left and, upwards, the products of neighbours.
    """
    if not slow_panel.any():
        return np.arange(len(scene)), moments
    rise, int_e, int_inverse, nested = moments
    up = rise > 0
    joins = np.zeros(len(scene), dtype=bool)
    joins[1:] = slow_panel[1:] & slow_panel[:-1] & (scene[1:] == scene[:-1]) & (up[1:] == up[:-1])
    first = np.flatnonzero(~joins)
    last = np.append(first[1:], len(scene)) - 1
    product = np.concatenate(([0.0], np.where(joins[1:], int_e[:-1] * int_inverse[1:], 0.0)))
    summed = np.add.reduceat(nested + product, first)
    single = first == last
    up = up[first]
    return first, Moments(
        np.add.reduceat(rise, first),
        np.where(up, int_e[last], int_e[first]),
        np.where(up, int_inverse[first], int_inverse[last]),
        np.where(up | single, summed, int_e[first] * int_inverse[last]),
    )
