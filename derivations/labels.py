"""Every labelled equation of the paper, and what becomes of it here."""

from __future__ import annotations

import re
from dataclasses import dataclass

#: The equations of the paper without a label, which are numbered as well.
_UNLABELLED_NUMBERS = (28, 31, 46, 48, 52, 55)
PAPER = tuple(
    """
    eq:genFilippov eq:genPerturbed eq:cont eq:genSDE eq:eekappar eq:Plarge eq:Psmall eq:Tdef
    eq:Tlarge eq:Tsmall eq:scaledSDE eq:scaledSDEx eq:phi eq:reducedSDE eq:tildexykappa
    eq:reducedSDEtilde eq:FPE eq:pss eq:V eq:V2 eq:Ttildedef eq:tilder eq:BCs2 eq:Ttilde0
    eq:Ttilde eq:C eq:P eq:P2 eq:Plarge2 eq:Psmall2 eq:TtildeCzero eq:fourPieces eq:fourthTerm
    eq:Ttildelarge eq:secondTerm eq:fourthTerm2 eq:Ttildesmall eq:S eq:TtildetoT eq:osc1 eq:osc2
    eq:forcePWC eq:forcePerturbed eq:osc3 eq:phifric0 eq:Vfric cubic fr1 fr2 eq:odeR
    """.split()  # noqa: SIM905
)

#: Label -> number of the equation in the paper (arXiv:1310.8328), counted through.
NUMBERS = dict(zip(PAPER, (n for n in range(1, 57) if n not in _UNLABELLED_NUMBERS), strict=True))
# Those that the paper has without a label: two bounds, two tails, the appendix.
NUMBERS |= {"tails": 28, "L-bound": 31, "beta": 46, "folds": 52, "threshold": 55}
NUMBERS |= {"first-integral": 57, "density-R": 58, "C-bound": 61, "laplace-substitution": 62}

# Results without a label that carry weight, by the names given to them here.
UNLABELLED = tuple(
    """
    filippov noise-amplitude regions first-integral density-R backward positive-form
    positive-density constant-panel panel-step constant-drift tails L-bound C-bound first-three
    laplace-substitution gaussian-step saddle-series saddle-start pair-products endpoint-series
    regular-part pair-primitives saddle-recurrences two-sides airy-form truncated-gaussian
    other-pieces turning-points beta folds friction-well threshold release-time release-order
    release-adiabatic frozen-time fold-delay
    """.split()  # noqa: SIM905
)

#: Those that the paper has not, with the entry of docs/paper.bib that has the method, if any.
BEYOND = dict.fromkeys(
    """
    positive-form positive-density constant-panel panel-step saddle-series saddle-start
    endpoint-series regular-part saddle-recurrences two-sides release-time release-order
    release-adiabatic frozen-time fold-delay
    """.split(),  # noqa: SIM905
    "",
)
BEYOND |= dict.fromkeys(("pair-products", "pair-primitives", "airy-form"), "ChesterFriedmanUrsell")
BEYOND |= {"truncated-gaussian": "Bleistein"}


@dataclass(frozen=True)
class Definition:
    """A label with nothing to derive.

    Attributes
    ----------
    latex : str
        What the label defines.
    text : str
        The same in characters.
    reason : str
        What it defines, in words, and what is derived from it.
    """

    latex: str
    text: str
    reason: str


def _cases(*rows: str) -> str:
    r"""LaTeX of a field that has a value and a condition in each row."""
    return rf"\begin{{cases}} {_NEXT.join(rows)} \end{{cases}}"


_NEXT = r" \\ "
_FIELD = _cases(
    r"f^-(x) , & y \le -\varepsilon",
    r"F\left(\frac{y}{\varepsilon}, x\right) , & -\varepsilon < y < \varepsilon",
    r"f^+(x) , & y \ge \varepsilon",
)
_SYSTEM = "f^-(x) for y <= -eps, F(y/eps, x) for -eps < y < eps, f^+(x) for y >= eps"
DEFINITIONS = {
    "eq:genFilippov": Definition(
        r"\dot x = " + _cases("f^-(x) , & y < 0", "f^+(x) , & y > 0"),
        "dx/dt = f^-(x) for y < 0, f^+(x) for y > 0",
        "Definition of the discontinuous system; what follows from it at the surface is derived as "
        "'filippov'.",
    ),
    "eq:genPerturbed": Definition(
        rf"\dot x = {_FIELD}",
        f"dx/dt = {_SYSTEM}",
        "Definition of the smoothed system; its one condition is eq:cont.",
    ),
    "eq:genSDE": Definition(
        rf"dx = {_FIELD} \, dt + \kappa_p D(x) \, dW",
        f"dx = ({_SYSTEM}) dt + kappa_phys D(x) dW",
        "Definition of the system with noise; its component across the surface is eq:scaledSDEx.",
    ),
    "eq:Tdef": Definition(
        r"T_p = \mathbb{E}\left[ \min\{ t > 0 : |y(t)| = r_p, \ x(0) = 0 \} \right]",
        "T_phys = E[min{t > 0 : |y(t)| = r_phys, x(0) = 0}]",
        "Definition of the mean escape time; its scaled form is computed in eq:Ttilde0.",
    ),
    "eq:Ttildedef": Definition(
        r"T = \mathbb{E}\left[ \min\{ t > 0 : |u(t)| = r, \ u(0) = 0 \} \right]",
        "T = E[min{t > 0 : |u(t)| = r, u(0) = 0}], scaled",
        "Definition of the scaled mean escape time; eq:Ttilde0 and 'backward' compute it.",
    ),
    "eq:BCs2": Definition(
        r"p(u, 0) = \delta(u) ,\quad p(\pm r, t) = 0",
        "p(u, 0) = delta(u), p(-r, t) = p(r, t) = 0",
        "Definition of the problem: the start at 0 and absorption at both ends; used in eq:odeR, "
        "'density-R' and eq:C.",
    ),
    "eq:osc1": Definition(
        r"\ddot z + \dot z + z + F(\dot z + 1) = 0",
        "z'' + z' + z + F(z' + 1) = 0",
        "Definition of the model; eq:osc2 is derived from it.",
    ),
}
# Labels with nothing to derive, and why.
REASONS = {label: defined.reason for label, defined in DEFINITIONS.items()}


def numbered(text: str, word: str = "") -> str:
    """A sentence with equation numbers, after `word`, in place of the paper's labels."""
    return re.sub(
        r"\((eq:\w+|fr[12])\)|\b(eq:\w+|fr[12]\b|(?<=\d, )cubic$)",
        lambda m: (
            m[0]
            if (m[1] or m[2]) not in NUMBERS
            else f"({word}{NUMBERS[m[1]]})"
            if m[1]
            else f"{word}({NUMBERS[m[2]]})"
        ),
        text,
    )
