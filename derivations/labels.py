"""Every labelled equation of the paper: its number, and what is only defined."""

from __future__ import annotations

# The paper's labels in order; its equations without one are numbered as well.
_ORDER = """
eq:genFilippov eq:genPerturbed eq:cont eq:genSDE eq:eekappar eq:Plarge eq:Psmall eq:Tdef eq:Tlarge
eq:Tsmall eq:scaledSDE eq:scaledSDEx eq:phi eq:reducedSDE eq:tildexykappa eq:reducedSDEtilde eq:FPE
eq:pss eq:V eq:V2 eq:Ttildedef eq:tilder eq:BCs2 eq:Ttilde0 eq:Ttilde eq:C eq:P tails eq:P2
eq:Plarge2 L-bound eq:Psmall2 eq:TtildeCzero eq:fourPieces eq:fourthTerm eq:Ttildelarge
eq:secondTerm eq:fourthTerm2 eq:Ttildesmall eq:S eq:TtildetoT eq:osc1 eq:osc2 eq:forcePWC
eq:forcePerturbed beta
eq:osc3 - eq:phifric0 eq:Vfric cubic folds fr1 fr2 threshold eq:odeR first-integral density-R - -
C-bound laplace-substitution
"""
#: Label -> number of the equation in the paper (arXiv:1310.8328), counted through.
NUMBERS = {label: n for n, label in enumerate(_ORDER.split(), 1) if label != "-"}

#: Labels beyond the paper, with the entry of docs/paper.bib for the method, if any.
BEYOND = {
    **dict.fromkeys(
        ("positive-form", "positive-density", "constant-panel", "panel-step", "saddle-series",
         "saddle-start", "endpoint-series", "canonical-form", "release-time", "release-order",
         "release-adiabatic", "frozen-time", "fold-delay", "exit-transform", "exit-moments",
         "exit-eigenvalue", "state-noise", "state-noise-time", "state-noise-rate"), ""),
    **dict.fromkeys(("airy-form", "cubic-pair"), "ChesterFriedmanUrsell"),
    "truncated-gaussian": "Bleistein",
}  # fmt: skip

_LAYER = r"F\left(\frac{y}{\varepsilon}, x\right) , & -\varepsilon < y < \varepsilon \\"
_SMOOTHED = (
    r"\begin{cases} f^-(x) , & y \le -\varepsilon \\ " + _LAYER
    + r" f^+(x) , & y \ge \varepsilon \end{cases}"
)  # fmt: skip
#: Labels that need no derivation: what they define, and what is derived from it.
DEFINITIONS = {
    "eq:genFilippov": (
        r"\dot x = \begin{cases} f^-(x) , & y < 0 \\ f^+(x) , & y > 0 \end{cases}",
        "the discontinuous system; its consequences at the surface are derived as 'filippov'",
    ),
    "eq:genPerturbed": (
        rf"\dot x = {_SMOOTHED}", "the smoothed system; its one condition is eq:cont",
    ),
    "eq:genSDE": (
        rf"dx = {_SMOOTHED} \, dt + \kappa_p D(x) \, dW",
        "the system with noise; its component across the surface is eq:scaledSDEx",
    ),
    "eq:Tdef": (
        r"T_p = \mathbb{E}\left[ \min\{ t > 0 : |y(t)| = r_p, \ x(0) = 0 \} \right]",
        "the mean escape time; its scaled form is computed in eq:Ttilde0",
    ),
    "eq:Ttildedef": (
        r"T = \mathbb{E}\left[ \min\{ t > 0 : |u(t)| = r, \ u(0) = 0 \} \right]",
        "the scaled mean escape time; eq:Ttilde0 and 'backward' compute it",
    ),
    "eq:BCs2": (
        r"p(u, 0) = \delta(u) ,\quad p(\pm r, t) = 0",
        "the start at 0 and absorption at both ends; used in eq:odeR, 'density-R' and eq:C",
    ),
    "eq:osc1": (
        r"\ddot z + \dot z + z + F(\dot z + 1) = 0", "the oscillator; eq:osc2 is derived from it",
    ),
}  # fmt: skip
