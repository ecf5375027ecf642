"""A search for bounds that are violated: `python -m tests.searches.bound_claims`.

Drifts, radii, starts and noise are drawn at random, the hard places among them on purpose: starts
outside the layer at the height of a barrier, at ends, at kinks and beside zeros of A, kappa from
1e-8 to 1e3, the global precisions of mpmath and flint at one of three values. Every answer that
says "bound" is compared with the exact value: arrays with that in float64 and its own error, and
those claims that this cannot tell from violated ones, and single scenes, with more digits
(`symasym.exact.digits`, which shares nothing with the bounds). Integrals by Laplace are compared
with Arb's quadrature.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from typing import Any

import flint
import mpmath
import numpy as np

import symasym as sa
from symasym.numbers import balls

#: Bits of both global contexts.
PRECISIONS = ((20, 24), (53, 53), (400, 300))
_KAPPAS = (-8.0, 3.0)
_AT_ONCE = 400
# Seconds for a single scene.
_PATIENCE = 2
# Of an array's claims, how many are looked at with more digits, and where float64 can't tell.
_LOOKED_AT, _HARD = 1, 3


@contextmanager
def global_precisions(mpmath_bits: int, flint_bits: int) -> Iterator[None]:
    """Both global contexts at these precisions while the block runs."""
    context = flint.ctx
    before = mpmath.mp.prec, context.prec
    mpmath.mp.prec, context.prec = mpmath_bits, flint_bits
    try:
        yield
    finally:
        mpmath.mp.prec, context.prec = before


class Search:
    """Random claims, counted by what said "bound"; `violated` lists those that are false."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        self.claims: Counter[str] = Counter()
        self.checked: Counter[str] = Counter()
        self.violated: list[str] = []

    def run(self, count: int, arrays: bool = True) -> None:
        """About so many claims: most of arrays, or of single scenes alone."""
        while self.claims.total() < count:
            with global_precisions(*PRECISIONS[self._rng.integers(len(PRECISIONS))]):
                if arrays:
                    self._arrays()
                for _ in range(3):
                    self._one()

    # -- scenes --------------------------------------------------------------------------------

    def drift(self) -> sa.Drift:
        """A random drift: polynomials of degree 0 to 5 and some that are none."""
        rng = self._rng
        kind = rng.integers(8)
        if kind == 0:
            return sa.friction(3, 1, str(round(rng.uniform(-1.5, 3.5), 3)))
        if kind == 1:
            low, high = (str(x) for x in rng.uniform(-2, 2, 2).round(2) + 0.005)
            return sa.tanh(low, high, int(rng.integers(1, 6)))
        if kind == 2:
            return sa.Drift(f"sin(4*u + {rng.integers(7)}) + {rng.integers(-9, 10)}/10")
        return sa.polynomial(*(str(x) for x in rng.uniform(-3, 3, rng.integers(1, 7)).round(2)))

    def place(self, drift: sa.Drift) -> tuple[Fraction, Fraction]:
        """A start and a radius."""
        rng = self._rng
        r = Fraction(str(round(float(10.0 ** rng.uniform(-0.5, 1.5)), 4)))
        kind = rng.integers(6)
        if kind == 0:
            return Fraction(0), r
        if kind == 1:
            return Fraction(int(rng.choice([-1, 1]))), r + 1
        if kind == 2:
            # Where V is as high as at a barrier, outside the layer: V(x) = a- |x + 1|.
            zeros, a = _zeros(drift), float(drift.ends[0])
            if zeros and a:
                u = np.linspace(-1, float(zeros[rng.integers(len(zeros))]), 2001)
                values = np.broadcast_to(drift.evaluate_float(u), u.shape)
                height = -float(np.trapezoid(values, u))
                x = -1 - height / a
                if x < -1:
                    return Fraction(x), Fraction(-x) + Fraction(int(rng.integers(1, 99)), 100)
        if kind == 3:
            zeros = _zeros(drift)
            if zeros:
                return Fraction(float(zeros[0])), max(r, Fraction(2))
        if kind == 4:
            return r * Fraction(999, 1000), r
        return Fraction(str(round(float(rng.uniform(-0.99, 0.99)), 3))) * r, r

    # -- claims ---------------------------------------------------------------------------------

    def _arrays(self) -> None:
        """C of many kappa at once."""
        rng, drift = self._rng, self.drift()
        x, r = self.place(drift)
        low = rng.uniform(*_KAPPAS)
        kappa = 10.0 ** rng.uniform(low, low + 0.5, _AT_ONCE)
        scene: dict[str, Any] = {"start": float(x), "complement": bool(rng.integers(2))}
        radius = float(r) * (1 + 0.1 * rng.random(_AT_ONCE)) if rng.integers(2) else float(r)
        claimed, exact = self._both(drift, kappa, radius, scene)
        if claimed is None:
            return
        self.claims["C, arrays"] += len(kappa)
        wrong = np.abs(claimed.value - exact.value)
        room = exact.error + 4e-16 * np.abs(exact.value)
        if (wrong > claimed.error + room).any():
            self.violated.append(f"{drift} {scene} {kappa[np.argmax(wrong - claimed.error)]!r}")
        hard = wrong + room > claimed.error
        rows = rng.permutation(np.flatnonzero(hard))[:_HARD]
        rows = np.union1d(rows, rng.integers(len(kappa), size=_LOOKED_AT))
        for row in rows.tolist():
            one = float(np.broadcast_to(radius, kappa.shape)[row])
            self._check("C, arrays", drift, kappa[row], one, scene, claimed, row)

    def _both(self, drift: sa.Drift, kappa: Any, r: Any, scene: dict[str, Any]) -> Any:
        """The claim and the exact values, or None where either is refused."""
        options: dict[str, Any] = {"log": True, "full": True, **scene}
        try:
            claimed = sa.exit_probability(drift, kappa, r, method="bound", **options)
            return claimed, sa.exit_probability(drift, kappa, r, **options)
        except sa.SymasymError:
            return None, None

    def _check(
        self, name: str, drift: sa.Drift, kappa: float, r: float, scene: Any, claim: Any, row: int
    ) -> None:
        """One claim of an array with more digits."""
        try:
            exact = sa.exit_probability(drift, float(kappa), r, log=True, dps=40, **scene)
        except sa.SymasymError:
            return
        self.checked[name] += 1
        self._judge(name, claim.value[row], claim.error[row], exact, (drift, kappa, r, scene))

    def _judge(self, name: str, value: Any, error: Any, exact: Any, scene: Any) -> None:
        """Note a claim that is false."""
        with mpmath.workprec(600):
            if not abs(mpmath.mpf(value) - exact) <= error + abs(exact) * mpmath.mpf(10) ** -38:
                shown = ", ".join(map(str, scene))
                self.violated.append(f"{name}: {value} +- {error}, exact {exact}: {shown}")

    def _one(self) -> None:
        """A claim that is no array's."""
        kind = self._rng.integers(40)
        if kind < 5:
            self._integral()
        elif kind < 7:
            self._derivative()
        else:
            self._scalar()

    def _integral(self) -> None:
        """An integral of g e^{lam f}, f and g polynomials, by Laplace's method."""
        rng = self._rng
        f, g = (
            [str(c) for c in rng.uniform(-3, 3, rng.integers(low, high)).round(2)]
            for low, high in ((2, 7), (1, 4))
        )
        texts = [" + ".join(f"({c})*x**{k}" for k, c in enumerate(row)) for row in (f, g)]
        a = Fraction(int(rng.integers(-20, 20)), 10)
        b = a + Fraction(int(rng.integers(1, 30)), 10)
        lam = Fraction(str(round(float(10.0 ** rng.uniform(0, 4)), 2)))
        log, dps = bool(rng.integers(2)), [None, 12, 25][rng.integers(3)]
        try:
            expansion = sa.laplace_integral(*texts, "x", str(a), str(b), int(rng.integers(1, 6)))
            claim = expansion.evaluate(lam, dps=dps, log=log, full=True)
        except sa.SymasymError:
            return
        if claim.error_kind != "bound":
            return
        exact = _by_quadrature(f, g, a, b, lam, log)
        if exact is not None:
            self.claims["integral, laplace"] += 1
            self.checked["integral, laplace"] += 1
            shown = (texts, a, b, lam, log, dps)
            self._judge("integral, laplace", claim.value, claim.error, exact, shown)

    def _derivative(self) -> None:
        """d log Q/d kappa of a quantity, against differences of fourth order."""
        rng, drift = self._rng, self.drift()
        quantity = list(_VERBS)[rng.integers(len(_VERBS))]
        x, r = self.place(drift)
        kappa = Fraction(float(f"{10.0 ** rng.uniform(-2, _KAPPAS[1]):.4g}"))
        ask, options = _VERBS[quantity]
        more: dict[str, Any] = {} if "P" in quantity else {"r": r, "start": x}
        dps = int(rng.integers(8, 25))
        step = kappa / 10**12
        try:
            claim = sa.sensitivity(drift, kappa, quantity=quantity, dps=dps, **more)
            if claim.error_kind != "bound":
                return
            logs = [
                ask(drift, kappa + k * step, dps=80, log=True, **more, **options)
                for k in (-2, -1, 1, 2)
            ]
        except sa.SymasymError:
            return
        name = f"d log {quantity}, sensitivity"
        self.claims[name] += 1
        self.checked[name] += 1
        with mpmath.workprec(600):
            changes = mpmath.fdot((1, -8, 8, -1), logs)
            exact = changes * step.denominator / (12 * step.numerator)
        value, error = claim.derivative["kappa"], claim.error["kappa"]
        self._judge(name, value, error, exact, (drift, kappa, quantity, more, dps))

    def _scalar(self) -> None:
        """One scene by a method that proves its error."""
        rng, drift = self._rng, self.drift()
        name, method = _METHODS[rng.integers(len(_METHODS))]
        x, r = self.place(drift)
        if method == "paper":
            x, r = Fraction(0), max(r, Fraction(4))
        low = -4.0 if method in ("strong_noise", "exact") else _KAPPAS[0]
        kappa = Fraction(float(f"{10.0 ** rng.uniform(low, _KAPPAS[1]):.4g}"))
        ask, complement = _VERBS[name]
        options: dict[str, Any] = {"log": bool(rng.integers(2))} | complement
        numbers = (kappa,) if "P" in name else (kappa, r)
        if "P" not in name:
            options["start"] = x
        more: dict[str, Any] = {"full": True, "method": method, "patience": _PATIENCE}
        if method in ("laplace", "strong_noise"):
            more["order"] = int(rng.integers(0, 6))
        more["dps"] = [None, 12, 25][rng.integers(3)]
        try:
            claimed = ask(drift, *numbers, **options, **more)
            if claimed.error_kind != "bound":
                return
            exact = ask(drift, *numbers, **options, dps=45, patience=_PATIENCE)
        except sa.SymasymError:
            return
        self.claims[f"{name}, {method}"] += 1
        self.checked[f"{name}, {method}"] += 1
        self._judge(
            f"{name}, {method}",
            claimed.value,
            claimed.error,
            exact,
            (drift, numbers, options, more),
        )


def _by_quadrature(
    f: list[str], g: list[str], a: Fraction, b: Fraction, lam: Fraction, log: bool
) -> Any:
    """The integral of g e^{lam f} over [a, b] by Arb, or None if that is not right to 35 digits."""
    from flint import acb, arb, fmpq

    with balls.precision(1200):
        f_of, g_of = ([arb(fmpq(*Fraction(c).as_integer_ratio())) for c in row] for row in (f, g))
        low, high, large = (arb(fmpq(*x.as_integer_ratio())) for x in (a, b, lam))

        def horner(row: list[Any], z: Any) -> Any:
            total = acb(0)
            for c in reversed(row):
                total = total * z + c
            return total

        found = acb.integral(
            lambda z, _: horner(g_of, z) * (large * horner(f_of, z)).exp(),
            low,
            high,
            rel_tol=arb(10) ** -45,
        ).real
        if log:
            found = found.log() if found > 0 else arb("nan")
        if not found.is_finite() or not found.rel_accuracy_bits() > 120:
            return None
        mantissa, exponent = found.mid().man_exp()
        with mpmath.workprec(600):
            return mpmath.ldexp(mpmath.mpf(int(mantissa)), int(exponent))


def _zeros(drift: sa.Drift) -> list[Any]:
    """The zeros of A; none where A is 0 everywhere."""
    try:
        return [p.u for p in drift.critical_points()]
    except sa.SymasymError:
        return []


_COMPLEMENT = {"complement": True}
_VERBS: dict[str, tuple[Any, dict[str, Any]]] = {
    "T": (sa.escape_time, {}),
    "C": (sa.exit_probability, {}),
    "1 - C": (sa.exit_probability, _COMPLEMENT),
    "P": (sa.occupation, {}),
    "1 - P": (sa.occupation, _COMPLEMENT),
}
_METHODS = [
    *((name, "bound") for name in ("C", "1 - C")),
    *((name, "paper") for name in ("C", "1 - C", "P", "1 - P")),
    *((name, "laplace") for name in ("T", "T", "P", "1 - P")),
    *((name, "strong_noise") for name in _VERBS),
    *((name, "exact") for name in _VERBS),
]


def main(arguments: list[str] | None = None) -> int:
    """Print how many claims there were of each kind, and those that are false."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--claims", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--single", action="store_true", help="single scenes alone, no arrays")
    options = parser.parse_args(arguments)
    search = Search(options.seed)
    search.run(options.claims, not options.single)
    for name, count in sorted(search.claims.items()):
        print(f"{name}: {count} claims, {search.checked[name]} with more digits")
    print(f"{search.claims.total()} claims, {len(search.violated)} violated")
    for line in search.violated:
        print(line)
    return int(bool(search.violated))


if __name__ == "__main__":
    raise SystemExit(main())
