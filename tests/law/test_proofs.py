"""What the proofs of the law rest on: panels, truncation, division, residues."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from flint import acb, arb, arb_poly, fmpq

import symasym as sa
from symasym.base.balls import precision
from symasym.drift.evaluate import pieces
from symasym.drift.scenes import read
from symasym.exact import spectral, transform
from symasym.exact.balls import bits
from tests.law.scenes import TABLE
from tests.problems import relative

LAM, ORDER = arb(6), 12
DRIFTS = {
    "double well": sa.Drift("u - u**3", layer=None),
    "steep": sa.Drift("10 - u", layer=None),
    "pieces": sa.Drift.piecewise([("40", -1), ("cos(3*u)", "1/3"), ("-40", None)]),
    "noise": sa.Drift("u/4", layer=None, noise="(u + 5/2)/2"),
    "Stratonovich": sa.Drift("-u", layer=None, noise="2 + sin(u)", ito="stratonovich"),
}


def panels(name: str, begin: Any = -2, end: Any = 2, digits: int = 20, s: float = 0) -> list[Any]:
    drift = pieces(DRIFTS[name], fmpq(-2), fmpq(2))
    return transform.matrices(drift, LAM, fmpq(begin), fmpq(end), digits, ORDER, s)


def swept(found: list[Any]) -> tuple[Any, Any, Any]:
    return *transform.swept(found, False, ORDER + 1), spectral._mass(found)


@pytest.mark.parametrize("name", DRIFTS)
def test_panels(name: str) -> None:
    """Determinant 1, Newton's inequality, and 20 digits that contain 45."""
    with precision(bits(45)):
        found, fine = panels(name), panels(name, digits=45)
        for p in found:
            whole = (p.y1 * p.z2 - p.y2 * p.z1).truncate(ORDER + 1)
            assert whole[0].overlaps(arb(1))
            assert abs(whole[0] - 1) < 1e-15
            assert all(whole[k].contains(0) for k in range(1, ORDER + 1))
            for f in p[:4]:
                c = list(f)
                for k in range(2, len(c) - 1):
                    assert not c[k] ** 2 * (k - 1) < k * c[k - 1] * c[k + 1] or c[0] != 0
                    assert not c[k] ** 2 * k < (k + 1) * c[k - 1] * c[k + 1] or c[0] == 0
        if len(found) == len(fine):
            for p, q in zip(found, fine, strict=True):
                for f, g in zip(p[:4], q[:4], strict=True):
                    assert all(x.overlaps(y) for x, y in zip(list(f), list(g), strict=False))
        for s in (arb("0.7"), acb("0.3", 2)):
            for p in panels(name, s=3.0):
                y1, y2, z1, z2 = (spectral.truncated(f, arb(3), 8)(s) for f in p[:4])
                assert (y1 * z2 - y2 * z1).overlaps(1 + 0 * s)
                assert abs(y1 * z2 - y2 * z1 - 1) < 1e-6 * abs(y1 * z2)


@pytest.mark.parametrize("name", DRIFTS)
def test_what_a_series_misses_is_in_its_balls(name: str) -> None:
    """With 2 digits asked for, where the remainder is much of the error, and another cut."""
    with precision(bits(45)):
        whole = swept(panels(name, digits=45))
        for cut in (fmpq(-17, 31), fmpq(40, 31)):
            rough = swept(panels(name, -2, cut, 2) + panels(name, cut, 2, 2))
            for f, g in zip(whole[:2], rough[:2], strict=True):
                assert all(x.overlaps(y) for x, y in zip(list(f), list(g), strict=False))
            assert whole[2].overlaps(rough[2])


class Moved:
    """A function whose Taylor polynomials are off by all that their error allows."""

    def __init__(self, of: Any, by: float) -> None:
        self.of, self.by = of, by

    def taylor(self, *at: Any) -> Any:
        series, missed = self.of.taylor(*at)
        return series + self.by, missed + abs(self.by)


@pytest.mark.parametrize("moved", [(1e-5, 0), (-1e-5, 0), (0, 1e-5), (0, -1e-5), (1e-4, -1e-4)])
@pytest.mark.parametrize("name", ["noise", "Stratonovich"])
def test_errors_of_phi_and_sigma_are_in_the_balls(name: str, moved: Any) -> None:
    with precision(bits(20)):
        (piece,) = pieces(DRIFTS[name], fmpq(-2), fmpq(2))
        *parts, alpha = piece.noise
        off = piece._replace(noise=(*map(Moved, parts, moved), alpha))
        at = LAM, fmpq(-2), fmpq(2), 20, ORDER
        exact, rough = (swept(transform.matrices([p], *at)) for p in (piece, off))
        for f, g in zip(exact[:2], rough[:2], strict=True):
            assert all(x.overlaps(y) for x, y in zip(list(f), list(g), strict=True))
            assert list(g)[1].rel_accuracy_bits() > 3


@pytest.mark.parametrize("name", ["survival", "cdf", "pdf"])
def test_modes_left_out_are_in_the_ball(name: str) -> None:
    """One mode of Brownian motion, at times where the next ones are a hundredth of it; the part of
    Green's function that they leave."""
    numbers = {"kappa": 1, "r": 1, "start": "1/4"}
    scene = read(sa.Drift("0", layer=None), numbers).one()
    with precision(bits(30)):
        series = spectral.ExitTransform(scene, None, 44, 64.0, 30)
        parts = [(np.sin(k * np.pi * 0.625) / k) ** 2 for k in range(1, 100_000)]
        for count in (1, 4):
            share = sum(parts[count:]) / sum(parts)
            found = series.modes(count).green / series.modes(0).green
            assert float(found) == pytest.approx(share, rel=1e-4)
        for t in (fmpq(1), fmpq(3, 2)):
            series.digits = 6
            true = series.late(t, name, 4)
            series.digits = 0
            found = series.late(t, name, 1)
            assert found.overlaps(true)
            assert found.rel_accuracy_bits() < 12


def test_truncation_is_bounded() -> None:
    """cosh(sqrt(s)) from few powers, with roughly known ones behind them, at s on every side."""
    with precision(200):
        f = arb_poly([1 / arb(2 * k).fac() for k in range(40)])
        rough = arb_poly([*list(f)[:16], *(arb(c, 2 * c) for c in list(f)[16:])])
        for s in (acb(3, 4), acb(-2, 1), acb(0.1)):
            for series in (f.truncate(9), f.truncate(16), rough):
                found = spectral.truncated(series, abs(s), 5)(s)
                assert found.overlaps(s.sqrt().cosh())
                assert abs(found - s.sqrt().cosh()) < 1e-5
        for few in (f.truncate(3), f.truncate(5)):
            with pytest.raises(transform.Undecided):
                spectral.truncated(few, arb(500), 20)


def test_eigenvalues_by_division() -> None:
    """Without its first factors a product is that of the others, to the last coefficients."""
    with precision(300):
        zeros = [arb(k * k) * 2 for k in range(1, 40)]
        f, rest = arb_poly([1]), arb_poly([1])
        for k, z in enumerate(zeros):
            f = (f * arb_poly([1, 1 / z])).truncate(25)
            rest = rest if k < 2 else (rest * arb_poly([1, 1 / z])).truncate(25)
        divided = spectral._divided(spectral._divided(f, zeros[0]), zeros[1])
        assert all(f.overlaps(g) for f, g in zip(list(divided), list(rest), strict=False))
        assert divided[0].rel_accuracy_bits() > 40
        assert len(list(divided)) > 15
        below = spectral._beyond(divided, zeros[:2])
        assert zeros[1] < below < zeros[2]
        assert zeros[2] - below < 1


@pytest.mark.parametrize("name", ["double well", "start on the wall", "jumps beside a wall"])
def test_late_residues_and_early_contour(name: str) -> None:
    """At a time where both hold."""
    scene = TABLE[name]
    law = scene.law(full=True)
    t = Fraction(round(float(law.mean.value) * 20), 10)
    for kind in ("survival", "pdf"):
        late, how = law._exit.at_time(t, kind)
        assert how == "bound"
        early = law._exit._on_contour(t, kind, 18)
        assert early.overlaps(late)
        assert abs(early / late - 1) < 1e-13


def test_mirror_image() -> None:
    one = sa.Drift.piecewise([("1 + u**2", "1/3"), ("exp(-u) - 2*u", None)], noise="2 + sin(u)")
    two = sa.Drift.piecewise([("-exp(u) - 2*u", "-1/3"), ("-1 - u**2", None)], noise="2 - sin(u)")
    for reflecting, back in ((None, None), ("left", "right")):
        law = sa.exit_law(one, 1, ends=(-1, 2), start="0.5", reflecting=reflecting)
        image = sa.exit_law(two, 1, ends=(-2, 1), start="-0.5", reflecting=back)
        of: tuple[Callable[[Any], Any], ...] = (
            lambda f: f.mean, lambda f: f.laplace(2 + 1j), lambda f: f.rate.value,
        )  # fmt: skip
        for x in of[: 3 if reflecting else 2]:
            assert relative(x(image), x(law)) < 1e-14
        assert relative(image.left.mean, law.right.mean) < 1e-14


def test_complex_values_keep_their_digits() -> None:
    """Whatever mpmath's own precision is: E[e^{-s tau}] = 1/cosh(sqrt(2 s)) of Brownian motion."""
    law = sa.exit_law(sa.Drift("0", layer=None), 1, 1, dps=40, full=True)
    found = law.laplace(1 + 2j)
    with mpmath.workdps(60):
        assert abs(found.value - mpmath.sech(mpmath.sqrt(2 + 4j))) <= found.error < 1e-38
