"""The error of a Laplace expansion: proved where it can be, estimated elsewhere."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING

from symasym.asymptotics.laplace.expansion import Contribution, expand
from symasym.asymptotics.laplace.kinks import Piece
from symasym.asymptotics.laplace.maxima import Maximum
from symasym.base.call_context import mpf_of
from symasym.base.errors import AccuracyError, InputError
from symasym.base.estimate import ErrorKind

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext
    from sympy import Expr, Symbol

    from symasym.asymptotics.laplace.kinks import Real
    from symasym.asymptotics.laplace.remainder import Proof

# Terms behind the last one used that are looked at.
_BEYOND = 4
_DIGITS = 30
# Terms of what an end or a smaller maximum adds.
_LEADING = 3


@dataclass(frozen=True)
class ErrorModel:
    """The bound or the estimate of the error at any lam, computed when asked for."""

    pieces: tuple[Piece, ...]
    x: Symbol
    contributions: tuple[Contribution, ...]
    origins: tuple[tuple[Piece, Real, str], ...]
    smaller: tuple[Maximum, ...]
    digits: int

    @property
    def kind(self) -> ErrorKind:
        """``"bound"`` if the error is proved, else ``"estimate"``."""
        return "bound" if self.proof is not None else "estimate"

    @cached_property
    def proof(self) -> Proof | None:
        """A `symasym.asymptotics.laplace.remainder.Proof`, or None."""
        from symasym.asymptotics.laplace.remainder import prove

        return prove(self.pieces, self.x, self.contributions, self.origins)

    def statement(self, order: int, sigma: Expr) -> tuple[mpf, Expr, mpf] | None:
        """(K, sigma, lam0) of `Proof.statement`, or None where nothing is proved."""
        return None if self.proof is None else self.proof.statement(order, sigma)

    def relative(
        self, lam: Fraction, orders: list[int], shares: list[mpf], context: MPContext
    ) -> tuple[mpf, ErrorKind]:
        """The error over e^(lam height) of the sum of `shares`; its kind.

        `shares` are the first `orders` terms of each contribution. A bound that exceeds the sum
        itself says nothing; the estimate, named as such, does.
        """
        if self.proof is not None:
            top = self.contributions[0].height_in(context)
            bound = self.proof.relative(lam, orders, shares, top, context)
            if bound <= abs(context.fsum(shares)):
                return bound, "bound"
        return self._estimated(mpf_of(lam, context), orders, context), "estimate"

    def _estimated(self, lam: mpf, orders: list[int], context: MPContext) -> mpf:
        """Twice the largest of the next terms, and what ends and smaller maxima add."""
        total = context.mpf(0)
        top = self.contributions[0].height_in(context)
        for c, used in zip(self._longer(max(orders)), orders, strict=True):
            terms = c.terms(lam, _DIGITS, context)[used : used + _BEYOND]
            weight = context.exp(lam * (c.height_in(context) - top))
            total += 2 * weight * max(map(abs, terms), default=0)
        return total + self.elsewhere(lam, context)

    def elsewhere(self, lam: mpf, context: MPContext) -> mpf:
        """The contribution of ends and smaller maxima, over e^(lam height)."""
        total = context.mpf(0)
        top = self.contributions[0].height_in(context)
        for c in self._elsewhere:
            size = sum(map(abs, c.terms(lam, _DIGITS, context)))
            total += 2 * size * context.exp(lam * (c.height_in(context) - top))
        return total

    def _longer(self, order: int) -> list[Contribution]:
        """The contributions with a few more terms, as numbers."""
        known: dict[int, list[Contribution]] = self.__dict__.setdefault("_known", {})
        if order not in known:
            count, more = order + _BEYOND, []
            for piece, point, side in dict.fromkeys(self.origins):
                more += expand(piece, self.x, point, side, count, digits=_DIGITS, check=False)[0]
            known[order] = more
        return known[order]

    @cached_property
    def _elsewhere(self) -> list[Contribution]:
        """The first terms of what ends and smaller maxima add."""
        points: list[tuple[Piece, Real, str]] = []
        tops = {(side, piece, str(point)) for piece, point, side in self.origins}
        for piece in self.pieces:
            for end, side in ((piece.lo, "right"), (piece.hi, "left")):
                if not end.is_infinite and (side, piece, str(end)) not in tops:
                    points.append((piece, end, side))
        for maximum in self.smaller:
            if maximum.smooth and maximum.left is not None:
                points += [(maximum.left, maximum.point, side) for side in ("left", "right")]
        return [c for piece, point, side in points for c in _leading(piece, self.x, point, side)]


def _leading(piece: Piece, x: Symbol, point: Real, side: str) -> list[Contribution]:
    """The first terms at a point of one side, at a minimum those of -f, which are as large.

    Empty where f = -oo, or g vanishes to all orders.
    """
    for sign in (1, -1):
        with suppress(InputError, AccuracyError):
            signed = replace(piece, f=sign * piece.f)
            terms = expand(signed, x, point, side, _LEADING, digits=_DIGITS, check=False)[0]
            return [replace(c, height=sign * c.height) for c in terms]
    return []
