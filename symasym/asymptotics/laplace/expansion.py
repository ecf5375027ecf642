"""The expansion at one maximum of f: Taylor series there, order of contact, coefficients.

With f = f(p) - a t^mu (1 + ...) and g = t^(beta - 1) (g_0 + g_1 t + ...) in the distance t from the
maximum p, on one side or on both, its contribution is

    e^(lam f(p)) sum over k of c_k lam^(-(k + beta)/mu)

(Laplace's method by Watson's lemma; DLMF 2.3(ii), 2.3(iii); A. Erdelyi, Asymptotic Expansions,
section 2.4). On both sides of a smooth maximum the terms with k + beta - 1 odd cancel. The
coefficients are those of `symasym.asymptotics.laplace.watson`, in a coefficient field of
`symasym.series.coefficient_fields`: exact, with parameters, or rounded.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, TypeAlias

import sympy

from symasym.asymptotics.laplace.kinks import Piece, number
from symasym.asymptotics.laplace.watson import (
    moment_coefficients,
    perron_coefficients,
    times_moments,
)
from symasym.base.call_context import own_context, to_mpf
from symasym.base.errors import AccuracyError, InputError
from symasym.series.coefficient_fields import (
    ExpressionField,
    FunctionField,
    MissingConstant,
    RealField,
    sign_of,
)
from symasym.series.taylor_series import NotAnalytic, Series, algebraic, taylor

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext
    from sympy import Expr, Symbol

    from symasym.asymptotics.laplace.kinks import Real
    from symasym.numbers.arithmetic import Number as Element
    from symasym.series.coefficient_fields import CoefficientField

    Field: TypeAlias = ExpressionField | FunctionField | RealField

# f is compared with a constant up to this order before it's called flat.
_HIGHEST_CONTACT = 24
# Orders lost to factors such as sin(x)/x.
_SPARE = 4


@dataclass(frozen=True)
class Contribution:
    """The contribution of one maximum, or of one side of it, to the integral.

    It is e^(lam height) times the sum over k of coefficients[k] lam^(-exponents[k]).

    Attributes
    ----------
    point : Expr or mpf
    side : {"both", "left", "right"}
        The side of the maximum that the interval, or the piece, has.
    height : Expr or mpf
        f there.
    contact : int
        mu: f - height begins with -a t^mu.
    beta : Expr
        g begins with t^(beta - 1).
    exponents : tuple of Expr
        (k + beta)/mu, increasing.
    coefficients : tuple of Expr or mpf
        c_k.
    reduced : tuple of Expr or mpf
        The same without c_k's factor sides Gamma((k + beta)/mu)/(mu a^((k + beta)/mu)).
    scale : Expr or mpf
        a.
    """

    point: Real
    side: str
    height: Real
    contact: int
    beta: Expr
    exponents: tuple[Expr, ...]
    coefficients: tuple[Real, ...]
    reduced: tuple[Real, ...]
    scale: Real

    @property
    def exact(self) -> bool:
        """True if the coefficients are SymPy expressions, False if they are rounded numbers."""
        return isinstance(self.coefficients[0], sympy.Basic)

    def numbers(self, dps: int) -> tuple[list[mpf], list[mpf]]:
        """Exponents and coefficients as mpf with `dps` digits and a few more."""
        exponents = [number(s, dps=dps + 10) for s in self.exponents]
        if not self.exact:
            return exponents, list(self.coefficients)
        coefficients = []
        for k, (s, d) in enumerate(zip(exponents, self.reduced, strict=True)):
            # Sums with irrational constants lose a digit or so an order.
            more = dps + 15 + (0 if d.is_Rational else 20 + 2 * k)
            with own_context(more) as context:
                a, value = number(self.scale, dps=more), number(d, dps=more)
                s = context.make_mpf(s._mpf_)
                sides = 2 if self.side == "both" else 1
                coefficients += times_moments([value], [s], a, self.contact, context.gamma, sides)
        return exponents, coefficients

    def terms(self, lam: mpf, dps: int, context: MPContext) -> list[mpf]:
        """c_k lam^(-(k + beta)/mu), from exponents and coefficients with `dps` digits."""
        pairs = zip(*self.numbers(dps), strict=True)
        return [context.make_mpf(k._mpf_) * lam ** -context.make_mpf(s._mpf_) for s, k in pairs]

    def height_in(self, context: MPContext) -> mpf:
        """f at the maximum, at the context's precision."""
        return context.make_mpf(number(self.height, dps=context.dps)._mpf_)


def expand(
    piece: Piece, x: Symbol, point: Real, side: str, order: int, *, digits: int | None, check: bool
) -> tuple[list[Contribution], list[str]]:
    """Contributions of one maximum on `side`, and the conditions that were used.

    `digits` None asks for exact coefficients. With `check`, both ways of `coefficients` are
    taken and compared.
    """
    if digits is None:
        return _exactly(piece, x, point, side, order, check)
    # A digit or so is lost an order, in Taylor coefficients and in their sums.
    with own_context(digits + 20 + 2 * order) as context:
        field = RealField(context)
        point = refined(piece, x, point, field)
        contributions, conditions = _in_field(field, piece, x, point, side, order, check)
        return [_rounded(c, digits) for c in contributions], conditions


def refined(piece: Piece, x: Symbol, point: Real, field: RealField) -> Real:
    """A point that is a rounded zero of f', to the field's precision (Newton); else unchanged."""
    if isinstance(point, sympy.Basic):
        return point
    context = field.context
    current = context.make_mpf(point._mpf_)
    for _ in range(60):
        try:
            _, slope, half = taylor(piece.f, x, current, 1, 3, field).c
        except NotAnalytic:
            break
        step = slope / (2 * half) if half else context.mpf(0)
        current -= step
        # Quadratic convergence: after a step of half the digits the next one is below the last.
        if abs(step) <= abs(current) * context.mpf(10) ** (-(context.dps * 2) // 3):
            break
    return current


def _exactly(
    piece: Piece, x: Symbol, point: Real, side: str, order: int, check: bool
) -> tuple[list[Contribution], list[str]]:
    """Contributions in the field of rational functions that their constants generate."""
    scout = ExpressionField()
    _in_field(scout, piece, x, point, side, 1, False)
    constants = list(scout.constants)
    for _ in range(30):
        try:
            return _in_field(FunctionField(constants), piece, x, point, side, order, check)
        except MissingConstant as missing:
            constants.append(missing.value)
    raise AccuracyError(
        f"the irrational constants of the expansion at {x} = {point} did not close under "
        "arithmetic; pass dps=… for numerical coefficients."
    )


def irrational_constants(piece: Piece, x: Symbol, point: Real, side: str) -> bool:
    """True if exact coefficients would carry constants such as sqrt(2) or exp(1/3)."""
    scout = ExpressionField()
    _in_field(scout, piece, x, point, side, 1, False)
    return any(not g.is_Symbol for g in FunctionField(scout.constants).generators)


def _rounded(c: Contribution, digits: int) -> Contribution:
    """The contribution with numbers of `digits` digits."""
    return replace(
        c,
        height=to_mpf(c.height, digits + 10),
        coefficients=tuple(to_mpf(x, digits) for x in c.coefficients),
        reduced=tuple(to_mpf(x, digits) for x in c.reduced),
        scale=to_mpf(c.scale, digits + 10),
    )


def contact_of(
    piece: Piece, x: Symbol, point: Real, sign: int, field: CoefficientField
) -> tuple[int, tuple[int | None, bool]]:
    """The order mu of f - f(point), and the sign of its first coefficient."""
    count = 4
    while count <= 2 * _HIGHEST_CONTACT:
        try:
            c = taylor(piece.f, x, point, sign, count, field).c
        except NotAnalytic:
            raise InputError(
                f"f = {piece.f} has no Taylor series at its maximum {x} = {point}; Laplace's "
                "method here needs one on each side."
            ) from None
        for k in range(1, count):
            if not field.negligible(c[k], c[1:]):
                lead = field.to_expression(c[k])
                if isinstance(lead, sympy.Basic):
                    return k, sign_of(lead)
                return k, ((lead > 0) - (lead < 0), True)
        count *= 2
    raise InputError(
        f"f = {piece.f} is flat at {x} = {point} to order {_HIGHEST_CONTACT}; give an f whose "
        "maximum is isolated."
    )


def _in_field(
    field: CoefficientField,
    piece: Piece,
    x: Symbol,
    point: Real,
    side: str,
    order: int,
    check: bool,
) -> tuple[list[Contribution], list[str]]:
    """Contributions of one maximum, coefficients in `field`, and the conditions that were used."""
    sign = -1 if side == "left" else 1
    contact, (slope, proved) = contact_of(piece, x, point, sign, field)
    if slope != -1 or (side == "both" and contact % 2):
        raise InputError(
            f"f = {piece.f} is not largest at {x} = {point} (the first term after f there is of "
            f"order {contact} and {'positive' if slope == 1 else 'of another or unknown sign'}); "
            "give the point of a maximum, or symbols with assumptions that decide."
        )
    conditions = []
    step = 2 if side == "both" else 1
    count = step * order + 1
    lead = taylor(piece.f, x, point, sign, contact + count + _SPARE, field)
    if not proved:
        conditions.append(f"{sympy.simplify(field.to_expression(lead.c[contact]))} < 0")
    terms = algebraic(piece.g, x, point, sign, count + _SPARE, field)
    if not terms:
        raise InputError(
            f"g = {piece.g} vanishes to every order that was looked at at {x} = {point}; the "
            "expansion has no term there."
        )
    return [
        _contribution(lead, term, contact, side, order, x, point, check, conditions)
        for term in terms
    ], conditions


def _contribution(
    lead: Series,
    term: tuple[Element, Series],
    contact: int,
    side: str,
    order: int,
    x: Symbol,
    point: Real,
    check: bool,
    conditions: list[str],
) -> Contribution:
    """One contribution from f's Taylor series and one term t^front (g_0 + g_1 t + ...) of g.

    beta = front + 1; the reduced coefficients are Perron's (`perron_coefficients`), times
    Gamma((k + beta)/mu)/(mu a^((k + beta)/mu)).
    """
    field = lead.field
    front, weight = term
    start, step = 0, 1
    if side == "both":
        step = 2
        if not (isinstance(front, Fraction) and front.denominator == 1):
            raise InputError(
                f"g behaves as a power {field.to_expression(front)} of {x} - ({point}) at an "
                "interior maximum, where it isn't real on both sides; write it with Abs, or "
                "split the integral there."
            )
        start = front.numerator % 2
    beta = front + 1 if isinstance(front, Fraction) else front + field.rational(Fraction(1))
    shown = _as_sympy(beta, field)
    positive = sign_of(shown)
    if positive[0] != 1:
        raise InputError(
            f"g behaves as a power {sympy.simplify(shown - 1)} of the distance from {x} = {point}, "
            "where f is largest, so the integral diverges unless the power is above -1; change g "
            "or give its symbols assumptions."
        )
    if not positive[1]:
        conditions.append(f"{shown} > 0")
    needed = start + step * (order - 1) + 1
    f, g = lead.c[: contact + needed], weight.c[:needed]
    if len(g) < needed:
        raise AccuracyError(
            f"g = {point} loses {needed - len(g)} orders at {x} = {point}; simplify g."
        )
    reduced = perron_coefficients(f, g, contact, beta, step=step, start=start)
    if check:
        _require_agreement(
            reduced, moment_coefficients(f, g, contact, beta, step=step, start=start), field
        )
    a = field.to_expression(-f[contact])
    exponents = tuple((start + step * k + shown) / contact for k in range(order))
    plain = tuple(field.to_expression(d) for d in reduced)
    own, gamma = exponents, sympy.gamma
    if isinstance(field, RealField):
        own = tuple(number(s, dps=field.context.dps) for s in exponents)
        gamma = field.context.gamma
    return Contribution(
        point=point,
        side=side,
        height=field.to_expression(lead.c[0]),
        contact=contact,
        beta=shown,
        exponents=exponents,
        coefficients=tuple(times_moments(plain, own, a, contact, gamma, step)),
        reduced=plain,
        scale=a,
    )


def _as_sympy(value: Element, field: CoefficientField) -> Expr:
    """A rational or an element of the field as an expression."""
    if isinstance(value, Fraction):
        return sympy.Rational(value.numerator, value.denominator)
    shown = field.to_expression(value)
    return shown if isinstance(shown, sympy.Basic) else sympy.nsimplify(sympy.Float(shown))


def _require_agreement(
    first: list[Element], second: list[Element], field: CoefficientField
) -> None:
    """Refuse coefficients on which reversion and moments disagree."""
    for k, (a, b) in enumerate(zip(first, second, strict=True)):
        gap = a - b
        if isinstance(field, RealField):
            # Of all digits carried, the orders may cost a quarter.
            agree = abs(gap) <= max(abs(a), abs(b), 1) * field.context.mpf(10) ** (
                -field.context.dps * 3 // 4
            )
        else:
            agree = field.is_zero(gap)
        if not agree:
            raise AccuracyError(
                f"reversion and moments disagree at coefficient {k} ({a} against {b}), which is a "
                "defect of symasym; please report it with f and g."
            )
