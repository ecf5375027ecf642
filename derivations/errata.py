"""Points in which the paper's print and the derivations differ, each with its counterexample.

Kinds: ``wrong`` (a formula, sign, direction or statement that is false),
``condition`` (true only under a condition that is missing or misprinted),
``not sharp`` (true, and a stronger statement is derived), ``text`` (two places
of the paper contradict each other; nothing to compute).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

from derivations import evidence, evidence_text
from derivations.evidence import Evidence

KINDS = ("wrong", "condition", "not sharp", "text")


@dataclass(frozen=True)
class Erratum:
    """One slip.

    Attributes
    ----------
    label : str
        The equation, or the section for running text.
    kind : str
    printed, derived : str
        In words and formulas of our own, scaled variables of symasym.
    affects : str
        Whether later results of the paper depend on it.
    derivation : str
        The label whose derivation decides.
    counterexample : callable, optional
        Works out the numbers; left out for kind ``text`` alone.
    """

    label: str
    kind: str
    printed: str
    derived: str
    affects: str
    derivation: str
    counterexample: Callable[[], Evidence] | None = None

    def __post_init__(self) -> None:
        # Seconds each, and asked for by every page that shows them.
        if self.counterexample is not None:
            object.__setattr__(self, "counterexample", cache(self.counterexample))


ERRATA: tuple[Erratum, ...] = (
    Erratum(
        "fr1",
        "wrong",
        "a+ = 1 - z0 + alpha",
        "a+ = 1 - z0 - alpha (the print gives a-)",
        "the second term of eq:Ttildesmall if computed from fr1; eq:phifric0 is right",
        "fr1",
        evidence.a_plus,
    ),
    Erratum(
        "eq:scaledSDEx",
        "wrong",
        "noises through B add up to the amplitude sqrt|B|",
        "|B|",
        "none after it, the factor is absorbed in kappa; it matters when kappa is converted",
        "noise-amplitude",
        evidence.amplitude,
    ),
    Erratum(
        "section 7.3, end",
        "wrong",
        "exponentially large times occur only when kappa >~ sqrt(-eps/log eps)",
        "only when kappa <~ that: T falls as kappa grows",
        "the comparison with the earlier estimate kappa >~ eps has the same direction",
        "threshold",
        evidence.noise_threshold,
    ),
    Erratum(
        "section 7.3, end",
        "not sharp",
        "threshold sqrt(-eps/log eps) ~ 0.05",
        "sqrt(-2 D eps/log eps), D the height of the barrier; 0.0466 for 2 D = 1",
        "none",
        "threshold",
        evidence.threshold_constant,
    ),
    Erratum(
        "section 7.3, on figure 7",
        "wrong",
        "T scales as exp(1/kappa^2)",
        "exp(2 D eps/kappa^2) with unscaled kappa; the constant is far from 1",
        "none",
        "eq:Ttildesmall",
        evidence.noise_scale,
    ),
    Erratum(
        "section 7.3, on figure 7",
        "wrong",
        "scaled T ~ r/z for large noise",
        "scaled T ~ r/(1 - z0 - alpha) = -r/z0 with scaled r (alpha = 1): sign and scaling",
        "none",
        "eq:Ttildelarge",
        evidence.large_noise_time,
    ),
    Erratum(
        "appendix A.2",
        "wrong",
        "exponent with V_max/r, condition V_max/r <= Delta",
        "V_max/(a- r) in both; the bound on C fails where only the printed condition holds",
        "the bound quoted before eq:TtildeCzero needs V_max <= a- r/4 and says so nowhere",
        "C-bound",
        evidence.C_hypothesis,
    ),
    Erratum(
        "appendix A.2",
        "condition",
        "first link holds for sufficiently small eps, kappa and r",
        "needs r/eps >= 1/Delta: r must not be small against eps",
        "the same condition on the final bound",
        "C-bound",
        evidence.C_small_radius,
    ),
    Erratum(
        "appendix A.2",
        "condition",
        "given any Delta > 0",
        "0 < Delta <= 1/2 in the last link",
        "none, Delta = 1/4 is used",
        "C-bound",
        evidence.any_Delta,
    ),
    Erratum(
        "appendix A.2",
        "not sharp",
        "factor (1 + Delta)/(1 - Delta), 2 in the final bound",
        "1/(1 - Delta), 4/3: the factor 1 + Delta comes from nowhere",
        "none",
        "C-bound",
        evidence.slack_factor,
    ),
    Erratum(
        "section 6.2, on C",
        "wrong",
        "terms with C relate to escape through -1",
        "through -r: C is the chance to leave there; reaching -1 is not unlikely",
        "none",
        "eq:C",
        evidence.exit_point,
    ),
    Erratum(
        "eq:secondTerm",
        "not sharp",
        "relative remainder O(kappa)",
        "O(kappa^2): the odd order cancels; its coefficient is derived",
        "eq:Ttildesmall and appendix A.3 likewise",
        "eq:secondTerm",
        evidence.well_order,
    ),
    Erratum(
        "eq:Psmall2",
        "not sharp",
        "P = 1 + O(kappa^2)",
        "1 - P is exponentially small, with the derived prefactor",
        "eq:Psmall likewise",
        "eq:Psmall2",
        evidence.occupation_order,
    ),
    Erratum(
        "eq:Ttildesmall",
        "condition",
        "holds for two roots, A'(u1) <= 0 <= A'(u2) (fr2)",
        "strict inequalities, and kappa small against the distance to the fold",
        "figures 7 and 8 near z0^(+)",
        "eq:Ttildesmall",
        evidence.near_fold,
    ),
    Erratum(
        "eq:Ttildesmall",
        "condition",
        "holds for all u2 < 1",
        "u2 has to keep a distance of several kappa from the edge 1",
        "figures 7 and 8 as z0 -> 1 - alpha",
        "eq:Ttildesmall",
        evidence.near_edge,
    ),
    Erratum(
        "eq:S",
        "condition",
        "for a well, u2 > 0; S = 0 otherwise",
        "a well needs only -1 < u1 < u2 < 1; for u2 < 0 there is an exponentially large term "
        "of its own if V(0) > V(u1)",
        "eq:Ttildesmall for a start behind the barrier",
        "eq:S",
        evidence.behind_barrier,
    ),
    Erratum(
        "eq:Tsmall",
        "condition",
        "T > O(r) if F < 0 for an interval",
        "the interval must lie ahead of the start (or V(0) > V(u1))",
        "summary, point 4; section 6.2 itself does suppose u2 > 0",
        "eq:S",
        evidence.harmless_well,
    ),
    Erratum(
        "eq:Tsmall",
        "condition",
        "T > O(r) for kappa << sqrt(eps)",
        "kappa below the derived edge, which has log(r/eps) in it",
        "the summary's point 4",
        "eq:Tsmall",
        evidence.far_radius,
    ),
    Erratum(
        "eq:Tlarge",
        "condition",
        "T = r/a+ + O(r^2) also for kappa << sqrt(eps), F > 0; scaled T -> r/a+",
        "T = r/a+ + O(eps) + O(r^2): the scaled difference tends to a constant, not to 0",
        "none",
        "eq:S",
        evidence.smooth_crossing,
    ),
    Erratum(
        "section 5.1",
        "wrong",
        "escape time from |u| <= 1",
        "from |u| < r (eq:Ttildedef)",
        "none",
        "eq:Ttilde0",
        evidence_text.radius_one,
    ),
    Erratum(
        "section 5.2",
        "wrong",
        "time to u = r, absorption at u = r",
        "absorption at both ends (eq:BCs2); first passage to r alone takes longer",
        "none",
        "backward",
        evidence_text.both_ends,
    ),
    Erratum(
        "figure 8",
        "text",
        "kappa = 0.01 in the caption, 0.1 in the text",
        "0.01: at 0.1 nothing is exponentially large",
        "none",
        "threshold",
        evidence_text.caption_noise,
    ),
    Erratum(
        "cubic",
        "wrong",
        "up to three critical points inside |u| < 1",
        "at most two for mu > 1/2 (none or two when crossing, one when sliding)",
        "none",
        "cubic",
        evidence_text.count_of_roots,
    ),
    Erratum(
        "section 7.3, list of regions",
        "condition",
        "crossing for z < z0^(+) only",
        "z > 2 crosses as well (to the left), with a well for 2 < z < z0^(-)",
        "none",
        "folds",
        evidence_text.other_crossing,
    ),
    Erratum(
        "section 7.3, on figure 7",
        "wrong",
        "a well of V(v) - V(u) at (u1, u2)",
        "a maximum there; the well is V's, at u1",
        "none",
        "fr2",
        evidence_text.maximum_not_well,
    ),
    Erratum(
        "figure 5",
        "wrong",
        "y > 0 is slip to the left, y < 0 to the right",
        "the other way round, as the text on the breakaway point has it",
        "none",
        "eq:osc2",
        evidence_text.slip_direction,
    ),
    Erratum(
        "beta",
        "condition",
        "branches mu > 1/2 and mu < 1/2",
        "mu = 1/2 belongs to either, both give alpha; figure 7 (ii) uses it",
        "figure 7 (ii)",
        "beta",
        evidence_text.breakaway_gap,
    ),
    Erratum(
        "figure 8",
        "text",
        "three values of mu in the text, four in the caption",
        "four curves",
        "none",
        "eq:Ttildesmall",
    ),
    Erratum(
        "figure 7",
        "text",
        "the caption speaks of a panel (iii)",
        "there are (i) and (ii)",
        "none",
        "eq:Ttildesmall",
    ),
    Erratum(
        "section 2, on the smoothed flow",
        "text",
        "the crossing case is said to resemble panel (i) of figure 1",
        "panel (ii)",
        "none",
        "regions",
    ),
    Erratum(
        "introduction",
        "text",
        "escape times for sliding, densities for crossing",
        "the other way round",
        "none",
        "eq:P",
    ),
    Erratum(
        "summary, point 4",
        "text",
        "the vector F is compared with 0",
        "its component across the surface",
        "none",
        "eq:scaledSDEx",
    ),
    Erratum(
        "eq:scaledSDE",
        "text",
        "remainder O(r) beside dt and dW",
        "O(r) dt in the drift and O(kappa r) dW in the noise",
        "none",
        "eq:scaledSDE",
    ),
    Erratum(
        "section 6.2, end",
        "text",
        "in weak noise T is exponentially large",
        "only with a well ahead of the start, as eq:S itself says",
        "none",
        "eq:S",
    ),
    Erratum(
        "section 6.2, on eq:fourPieces",
        "not sharp",
        "the first three pieces are at most O(kappa^2) in strong noise",
        "1/a- + O(kappa^-2), 3/kappa^2 + O(kappa^-4), kappa^2/(2 a+ a-) + O(1)",
        "none",
        "first-three",
        evidence_text.second_piece_order,
    ),
    Erratum(
        "section 7.2, on the folds",
        "wrong",
        "at the breakaway point the block is released from u = 0",
        "from u = u^(+), where A has its double root (y = 0 only in the discontinuous limit)",
        "none",
        "folds",
        evidence_text.breakaway_position,
    ),
    Erratum(
        "eq:Ttildelarge",
        "condition",
        "r >> kappa^2 is enough for T = (r/a+)(1 + O(kappa^2/r))",
        "a+ r >> kappa^2 is needed: for a constant drift T = (r/a) tanh(a r/kappa^2)",
        "figure 7 as z0 -> 1 - alpha, with and without a well",
        "constant-drift",
        evidence.weak_outward_drift,
    ),
    Erratum(
        "section 7.3, on figures 7 and 8",
        "wrong",
        "exact and asymptotic values agree closely; the accuracy depends on eps and r",
        "it depends on kappa/sqrt(eps) as well: at kappa = 0.1 and mu = 1/2, and near the fold and "
        "near z0 = 1 - alpha at every kappa, they are far apart",
        "none",
        "eq:Ttilde",
        evidence_text.figures_agree,
    ),
    Erratum(
        "section 7.3, on figures 7 and 8",
        "condition",
        "the plotted T, exponentially large, is the time for which the oscillator's block sticks",
        "T has z frozen; the belt takes the block to the fold in (z0 - z0^(+))/eps, where it is "
        "released: T is the block's time only where eps T is small against z0 - z0^(+)",
        "figures 7 and 8 where T exceeds 1/eps; section 6.2 itself claims no more than T > O(r)",
        "eq:reducedSDEtilde",
        evidence_text.released_by_the_belt,
    ),
    Erratum(
        "eq:BCs2",
        "text",
        "the first condition fixes the position at every time",
        "the position at time 0",
        "none",
        "eq:Ttilde0",
    ),
)


def table() -> list[dict[str, Any]]:
    """Every entry with its numbers worked out, as plain data."""
    rows = []
    for entry in ERRATA:
        row: dict[str, Any] = {
            "label": entry.label,
            "kind": entry.kind,
            "printed": entry.printed,
            "derived": entry.derived,
            "affects": entry.affects,
            "derivation": entry.derivation,
        }
        if entry.counterexample is not None:
            found = entry.counterexample()
            row["counterexample"] = {
                "quantity": found.quantity,
                "inputs": found.inputs,
                "printed": number(found.printed),
                "derived": number(found.derived),
                "true": number(found.true),
            }
        rows.append(row)
    return rows


def number(value: Any) -> str:
    """Eight digits of a number."""
    import mpmath

    return str(mpmath.nstr(mpmath.mpf(value), 8))
