"""The calls that evaluate formulas. They are run when the site is built, for their numbers."""

from __future__ import annotations

from typing import Any

# What the calls below start from.
FRICTION = 'drift = sa.friction(mu=3, alpha=1, z0="-0.4")'
NO_WELL = 'drift = sa.friction(mu=3, alpha=1, z0="-1")'
SLIDING = "drift = sa.linear(a_minus=1, a_plus=-1)"
NONE = ""
CUBIC = 'drift = sa.polynomial(0, -1, 0, "-1/2")'

_ESCAPE = (FRICTION, 'sa.escape_time(drift, "0.3", 10, dps=30, full=True)')


def _beside(start: str, formula: str, exact: str) -> tuple[str, ...]:
    """A formula and the exact value, named, with the difference that says what digits are right."""
    named = f"{start}\nformula = {formula}\nexact = {exact}\nerror = formula / exact - 1"
    return named, 'f"formula {formula:.5g}, exact {exact:.5g}, relative error {error:.1e}"'


_ESCAPES = _beside(
    FRICTION, 'sa.escape_time(drift, "0.1", 10, method="paper")', 'sa.escape_time(drift, "0.1", 10)'
)
_EXIT = (FRICTION, 'sa.exit_probability(drift, "0.3", 10, dps=30, full=True)')
_OCCUPATION = (SLIDING, 'sa.occupation(drift, "0.3", dps=30, full=True)')
_DENSITY = (
    f"from mpmath import nstr\n{SLIDING}",
    'nstr(sa.stationary_density(drift, "0.5", "0.2", dps=30), 30)',
)
_SCALES = (NONE, 'sa.rescale(eps="0.01", kappa="0.03", r="0.1")')
_POTENTIAL = (FRICTION, "drift.potential()")
_ENDS = (FRICTION, "drift.ends")
_CRITICAL = (FRICTION, "drift.critical_points()")
_FIELDS = """\
below = "1 - z - y + alpha", "y - 1"
above = "1 - z - y - alpha", "y - 1"
inside = "1 - z - y - alpha*(s + mu*(s - s**3))", "y - 1"
reduced = sa.reduce(below, above, inside, ((1,), (0,)), ("y", "z"), at={"z": "z0"})"""


def _reduced(*parts: str) -> tuple[str, ...]:
    """Parts of the friction oscillator's reduction."""
    return _FIELDS, *(f"reduced.{part}" for part in parts)


_LAW = 'law = sa.exit_law(sa.Drift("-u", layer=None), 1, 2, full=True)'
_NOISY = (
    'drift = sa.Drift("-u", layer=None, noise="1 + u**2/4", ito="stratonovich")',
    "sa.escape_time(drift, 1, 2, start=1, full=True)",
    "sa.exit_probability(drift, 1, 2, start=1, full=True)",
)
_KRAMERS = """\
well = sa.Drift("u - u**3", layer=None, noise="1 + u/4")
place = {"ends": (-2, "1/2"), "start": -1}"""
_NEAR_FOLD = 'drift = sa.friction(mu=3, alpha=1, z0="-0.77")'


def _expanded(start: str, method: str, order: int) -> tuple[str, ...]:
    """T by a method to an order, with its error, and the exact value."""
    asked = f'sa.escape_time(drift, "0.05", 10, method="{method}", order={order}, full=True)'
    return start, asked, 'sa.escape_time(drift, "0.05", 10)'


_BLOCK = "block = sa.oscillator(mu=3, alpha=1)"


def _release(kappa: str, eps: str) -> tuple[str, ...]:
    """The mean time of release from z = -2/5, and T with z frozen there."""
    return (
        _BLOCK,
        f'sa.release(block, "{kappa}", 10, eps="{eps}", start=(0, "-0.4"))',
        f'sa.escape_time(block.frozen("-0.4"), "{kappa}", 10)',
    )


#: Label -> what to start from, then the calls.
CALLS: dict[str, tuple[str, ...]] = {
    "filippov": _reduced("sliding"),
    "eq:scaledSDEx": _reduced("normal_minus", "normal_inside", "normal_plus"),
    "noise-amplitude": _reduced("amplitude"),
    **dict.fromkeys(("eq:reducedSDE", "eq:osc3"), _reduced("drift", "amplitude")),
    **dict.fromkeys(("eq:Ttilde", "eq:Ttilde0", "backward", "positive-form"), _ESCAPE),
    "constant-drift": (
        "drift = sa.linear(a_minus=1, a_plus=1)",
        'sa.escape_time(drift, "0.5", 2, dps=30, full=True)',
        'sa.exit_probability(drift, "0.5", 2, dps=30, full=True)',
    ),
    "eq:C": _EXIT,
    "C-bound": (
        FRICTION,
        'sa.exit_probability(drift, "0.3", 10, method="paper", full=True)',
        'sa.exit_probability(drift, "0.3", 10)',
    ),
    "eq:Ttildelarge": _beside(
        NO_WELL,
        'sa.escape_time(drift, 1, 1000, method="paper")',
        "sa.escape_time(drift, 1, 1000)",
    ),
    "eq:Ttildesmall": _ESCAPES,
    "eq:S": (_NEAR_FOLD, *(f'sa.stokes_multiplier(drift, "{k}")' for k in ("0.05", "0.2"))),
    **dict.fromkeys(("eq:P", "eq:P2"), _OCCUPATION),
    "L-bound": (
        SLIDING,
        'sa.occupation(drift, 1, method="paper", full=True)',
        "sa.occupation(drift, 1)",
    ),
    "eq:Plarge2": _beside(
        SLIDING,
        'sa.formula("eq:Plarge2").lambdify("numpy")(10, 1, -1)',
        "sa.occupation(drift, 10)",
    ),
    "eq:Psmall2": (CUBIC, 'sa.occupation(drift, "0.2", complement=True)'),
    **dict.fromkeys(("eq:pss", "positive-density"), _DENSITY),
    "eq:phi": (FRICTION, "drift.phi()"),
    "eq:phifric0": (NONE, "sa.friction().phi()"),
    **dict.fromkeys(("eq:V", "eq:V2", "eq:Vfric"), _POTENTIAL),
    **dict.fromkeys(("regions", "eq:forcePWC"), (FRICTION, "drift.region")),
    **dict.fromkeys(("eq:tildexykappa", "eq:tilder", "eq:reducedSDEtilde"), _SCALES),
    "eq:TtildetoT": (*_SCALES, 'sa.rescale(eps="0.01", kappa="0.03", r="0.1").time'),
    **dict.fromkeys(("cubic", "fr2"), _CRITICAL),
    "fr1": _ENDS,
    "friction-well": (FRICTION, "drift.wells()", "drift.barriers()"),
    # epsilon = 1/100 and D = 1/2, as in the paper.
    "threshold": (
        "from math import log",
        'float(sa.formula("threshold").lambdify("numpy")(0.01, 0.5, log(100)))',
    ),
    **dict.fromkeys(("airy-form", "cubic-pair"), _expanded(_NEAR_FOLD, "uniform", 0)),
    "canonical-form": _expanded(_NEAR_FOLD, "uniform", 3),
    "endpoint-series": _expanded(NO_WELL, "laplace", 3),
    "saddle-series": _expanded(FRICTION, "laplace", 3),
    "saddle-start": _expanded('drift = sa.polynomial(0, -1, "3/2", 1)', "laplace", 3),
    "exit-transform": (_LAW, "law.laplace(1)", "law.left.laplace(1)"),
    "exit-moments": (_LAW, "law.mean", "law.moment(2)"),
    "exit-eigenvalue": (_LAW, "law.rate", "law.rates(2)[1]"),
    **dict.fromkeys(("state-noise", "state-noise-time"), _NOISY),
    "state-noise-rate": (
        _KRAMERS,
        'sa.expand(well, start=-1, order=0).evaluate("0.2", **place, full=True)',
        'sa.exit_law(well, "0.2", **place).rate',
        '1 / sa.escape_time(well, "0.2", **place)',
    ),
    "folds": (NONE, 'float(sa.formula("folds").lambdify("numpy")(3, 1))'),
    "turning-points": (NONE, 'float(sa.formula("turning-points").lambdify("numpy")(3))'),
    "beta": (NONE, 'float(sa.emit("beta", "numpy").load().beta(3, 1))'),
    "release-time": _release("0.1", "0.01"),
    "release-order": _release("0.5", "1e-5"),
    "release-adiabatic": _release("0.1", "1e-4"),
    "frozen-time": _release("0.2", "1e-7"),
    # In the page's units; curvature times speed is 1.
    "fold-delay": ("from mpmath import airyaizero, cbrt", "-airyaizero(1)/cbrt(0.01)"),
}


def session(label: str) -> str:
    """An interactive session of the calls of a label, with what they give; empty if it has none."""
    if label not in CALLS:
        return ""
    import symasym as sa

    names: dict[str, Any] = {"sa": sa}
    start, *calls = CALLS[label]
    lines = [">>> import symasym as sa"]
    if start:
        exec(start, names)
        lines += [f">>> {line}" for line in start.splitlines()]
    for call in calls:
        value = eval(call, names)
        lines.append(f">>> {call if _says_itself(value) else f'print({call})'}")
        value = float(value) if isinstance(value, float) else value
        lines.append(repr(value) if _says_itself(value) else str(value))
    return "\n".join(lines)


def _says_itself(value: Any) -> bool:
    """Whether a value is shown as Python echoes it; long arithmetic is printed in full instead."""
    return isinstance(value, (float, str, tuple, list))
