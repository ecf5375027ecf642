"""Points in which the paper's print is wrong, each with evidence that does not rest on it.

Kinds, in the order of the list: ``wrong`` (a statement that is false as it stands, or only true
under a condition that is not stated), ``misprint`` (another sign, symbol, number or reference was
meant, as the paper's own formulas show), ``not sharp`` (true, and a stronger statement is derived),
``wording`` (it says something other than what is meant, or two places contradict each other).
Within a kind, what the paper's conclusions depend on comes first.

Formulas stand between dollar signs, in TeX; variables are scaled, as in symasym, and physical ones
carry the index ``p``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

from derivations.errata import evidence, evidence_text
from derivations.errata.evidence import Evidence

KINDS = ("wrong", "misprint", "not sharp", "wording")


@dataclass(frozen=True)
class Erratum:
    """One slip.

    Attributes
    ----------
    section : str
        Of the paper: a number, or ``"A.2"``; the part of it for running text and figures.
    label : str
        The equation's label; empty for running text, captions and lists.
    kind : str
        One of `KINDS`.
    printed, right : str
        What stands there and what is right, in words and formulas of our own.
    consequence : str
        What else depends on it.
    derivation : str
        The label whose derivation decides.
    counterexample : callable, optional
        Works out the numbers.
    argument : str
        Why, where there is no number: two places that contradict each other, or a definition.
    """

    section: str
    label: str
    kind: str
    printed: str
    right: str
    consequence: str
    derivation: str
    counterexample: Callable[[], Evidence] | None = None
    argument: str = ""

    def __post_init__(self) -> None:
        # Seconds each, and asked for by every page that shows them.
        if self.counterexample is not None:
            object.__setattr__(self, "counterexample", cache(self.counterexample))

    @property
    def place(self) -> str:
        """Section and equation."""
        return f"section {self.section}" + (f", {self.label}" if self.label else "")


ERRATA: tuple[Erratum, ...] = (
    # -- wrong: what the conclusions depend on first ------------------------------------------
    Erratum(
        "7.3, figures 7 and 8",
        "",
        "wrong",
        r"the plotted $T$, exponentially large, is the time for which the oscillator's block "
        r"sticks",
        r"$T$ has $z$ frozen; the belt takes the block to the fold in scaled time "
        r"$(z_0 - z_0^{(+)})/\varepsilon$, and it is released some time after: $T$ is the block's "
        r"time only where $z$ changes it by little meanwhile",
        r"figures 7 and 8 where $T$ exceeds $1/\varepsilon$; section 6.2 itself claims no more "
        r"than "
        r"$T_p > O(r_p)$",
        "eq:reducedSDEtilde",
        evidence_text.released_by_the_belt,
    ),
    Erratum(
        "7.3, end",
        "",
        "wrong",
        r"exponentially large times occur only when "
        r"$\kappa_p \gtrsim \sqrt{-\varepsilon/\log\varepsilon}$",
        r"only when $\kappa_p \lesssim$ that: $T$ falls as the noise grows",
        r"the comparison with the earlier estimate $\kappa_p \gtrsim \varepsilon$ has the same "
        r"direction",
        "threshold",
        evidence.noise_threshold,
    ),
    Erratum(
        "7.3, first paragraph",
        "",
        "wrong",
        r"$\varepsilon = 1/100$ and $r_p = 1/10$ are an example of $\varepsilon, \kappa_p \ll r_p$ "
        r"(eq:eekappar), with small and with large noise",
        r"$\sqrt\varepsilon = r_p$ there: noise that is strong, $\kappa_p \ge \sqrt\varepsilon$, "
        r"is "
        r"not small against $r_p$. Both need $\varepsilon \ll r_p^2$",
        r"what is said of figure 7's larger noises is outside the assumption of section 3",
        "eq:eekappar",
        evidence_text.example_radius,
    ),
    Erratum(
        "6.2",
        "eq:Ttildesmall",
        "wrong",
        r"holds for two roots with $A'(u_1) \le 0 \le A'(u_2)$ (fr2)",
        r"strict inequalities, and $\kappa$ small against the distance to the fold",
        r"figures 7 and 8 near $z_0^{(+)}$",
        "eq:Ttildesmall",
        evidence.near_fold,
    ),
    Erratum(
        "6.2, before eq:secondTerm",
        "eq:Ttildesmall",
        "wrong",
        r"holds for all $u_2 < 1$",
        r"$u_2$ has to keep a distance of several $\kappa$ from the end of the layer",
        r"figures 7 and 8 as $z_0 \to 1 - \alpha$",
        "eq:Ttildesmall",
        evidence.near_edge,
    ),
    Erratum(
        "7.3, on figures 7 and 8",
        "",
        "wrong",
        r"exact and asymptotic values agree closely; the accuracy depends on $\varepsilon$ and $r$",
        r"it depends on $\kappa = \kappa_p/\sqrt\varepsilon$ as well: at $\kappa_p = 1/10$ and "
        r"$\mu = 1/2$, and near the fold and near $z_0 = 1 - \alpha$ at every noise, they are far "
        r"apart",
        r"none",
        "eq:Ttilde",
        evidence.figures_agree,
    ),
    Erratum(
        "7.3, on figure 7",
        "",
        "wrong",
        r"wherever the well exists, the first term of eq:Ttildesmall is the larger one",
        r"only for $\kappa$ below the derived edge $\kappa_e$ of eq:Tsmall",
        r"the reading of figure 7 (i) for its larger noises",
        "eq:Tsmall",
        evidence.first_term,
    ),
    Erratum(
        "A.2",
        "",
        "wrong",
        r"exponent with $V_{\max}/r$, condition $V_{\max}/r \le \Delta$",
        r"$V_{\max}/(a^- r)$ in both; the bound on $C$ fails where only the printed condition "
        r"holds",
        r"the bound quoted before eq:TtildeCzero needs $V_{\max} \le a^- r/4$ and says so nowhere",
        "C-bound",
        evidence.C_hypothesis,
    ),
    Erratum(
        "6.2, end",
        "eq:S",
        "wrong",
        r"for a well, $u_2 > 0$; $S = 0$ otherwise",
        r"a well needs only $-1 < u_1 < u_2 < 1$; for $u_2 < 0$ there is an exponentially large "
        r"term "
        r"of its own if $V(0) > V(u_1)$",
        r"eq:Ttildesmall for a start behind the barrier",
        "eq:S",
        evidence.behind_barrier,
    ),
    Erratum(
        "3, point 4",
        "eq:Tsmall",
        "wrong",
        r"$T_p > O(r_p)$ if the drift is negative on an interval",
        r"the interval must lie ahead of the start (or $V(0) > V(u_1)$)",
        r"section 6.2 itself does suppose $u_2 > 0$",
        "eq:S",
        evidence.harmless_well,
    ),
    Erratum(
        "3, point 4",
        "eq:Tsmall",
        "wrong",
        r"$T_p > O(r_p)$ for $\kappa_p \ll \sqrt\varepsilon$",
        r"for $\kappa$ below the derived edge, which has $\log(r_p/\varepsilon)$ in it",
        r"none",
        "eq:Tsmall",
        evidence.far_radius,
    ),
    Erratum(
        "6.2, end",
        "",
        "wrong",
        r"in weak noise eq:Ttildesmall makes $T$ exponentially large",
        r"only if there is a well, and $u_2 > 0$ or $V(0) > V(u_1)$",
        r"none",
        "eq:S",
        evidence.no_well,
    ),
    Erratum(
        "3, point 3",
        "eq:Tlarge",
        "wrong",
        r"$T_p = r_p/a^+ + O(r_p^2)$, also for $\kappa_p \ll \sqrt\varepsilon$ and a positive "
        r"drift (point 4); scaled $T \to r/a^+$ (section 6.2)",
        r"in weak noise $T_p = r_p/a^+ + O(\varepsilon) + O(r_p^2)$: the scaled difference tends "
        r"to a constant, not to 0",
        r"none",
        "eq:S",
        evidence.smooth_crossing,
    ),
    Erratum(
        "4",
        "eq:scaledSDEx",
        "wrong",
        r"noises through $B$ add up to the amplitude $\sqrt{\lvert B\rvert}$",
        r"$\lvert B\rvert$",
        r"none after it, the factor is absorbed in $\kappa$; it matters when $\kappa$ is converted",
        "noise-amplitude",
        evidence.amplitude,
    ),
    Erratum(
        "7.3, on figure 7",
        "",
        "wrong",
        r"scaled $T \approx r/z$ for large noise",
        r"scaled $T \approx r/(1 - z_0 - \alpha) = -r/z_0$ with scaled $r$ ($\alpha = 1$): sign "
        r"and "
        r"scaling",
        r"none",
        "eq:Ttildelarge",
        evidence.large_noise_time,
    ),
    Erratum(
        "5.1, end",
        "",
        "wrong",
        r"escape time from $\lvert u\rvert \le 1$",
        r"from $\lvert u\rvert < r$ (eq:Ttildedef)",
        r"none",
        "eq:Ttilde0",
        evidence_text.radius_one,
    ),
    Erratum(
        "5.2",
        "",
        "wrong",
        r"time to $u = r$, absorption at $u = r$",
        r"absorption at both ends (eq:BCs2); the mean time to reach $r$ alone is longer",
        r"none",
        "backward",
        evidence_text.both_ends,
    ),
    Erratum(
        "6.2, on C",
        "",
        "wrong",
        r"terms with $C$ relate to escape through $-1$",
        r"through $-r$: $C$ is the chance to leave there; reaching $-1$ is not unlikely",
        r"none",
        "eq:C",
        evidence.exit_point,
    ),
    Erratum(
        "7.2",
        "cubic",
        "wrong",
        r"up to three critical points inside $\lvert u\rvert < 1$",
        r"at most two for $\mu > 1/2$ (none or two when crossing, one when sliding)",
        r"none",
        "cubic",
        evidence_text.count_of_roots,
    ),
    Erratum(
        "7.2, on the folds",
        "",
        "wrong",
        r"at the breakaway point the block is released from $u = 0$",
        r"from $u = u^{(+)}$, where $A$ has its double root ($y = 0$ only in the discontinuous "
        r"limit)",
        r"none",
        "folds",
        evidence_text.breakaway_position,
    ),
    Erratum(
        "7.1, after eq:osc1",
        "",
        "wrong",
        r"$z$ is the block's displacement relative to the belt",
        r"relative to the frame: the extension of the spring, as figure 4 has it. Relative to the "
        r"belt the velocity is $y = \dot z + 1$, not $\dot z$",
        r"none, the equations are those of the extension",
        "eq:osc2",
        evidence_text.stuck_block,
    ),
    Erratum(
        "7.1, figure 5",
        "",
        "wrong",
        r"$y > 0$ is slip to the left, $y < 0$ to the right",
        r"the other way round, as the text on the breakaway point has it",
        r"none",
        "eq:osc2",
        evidence_text.slip_direction,
    ),
    Erratum(
        "A.2",
        "",
        "wrong",
        r"given any $\Delta > 0$",
        r"$0 < \Delta \le 1/2$ in the last link",
        r"none, $\Delta = 1/4$ is used",
        "C-bound",
        evidence.any_Delta,
    ),
    Erratum(
        "7.1, on the breakaway force",
        "",
        "wrong",
        r"branches $\mu > 1/2$ and $\mu < 1/2$ of $\beta$",
        r"$\mu = 1/2$ belongs to either, both give $\alpha$",
        r"figure 7 (ii) is drawn at $\mu = 1/2$",
        "beta",
        evidence_text.breakaway_gap,
    ),
    # -- misprint -----------------------------------------------------------------------------
    Erratum(
        "7.2",
        "fr1",
        "misprint",
        r"$a^+ = 1 - z_0 + \alpha$",
        r"$a^+ = 1 - z_0 - \alpha$ (the print gives $a^-$)",
        r"the second term of eq:Ttildesmall if computed from fr1; eq:phifric0 is right",
        "fr1",
        evidence.a_plus,
    ),
    Erratum(
        "7.2, before fr1",
        "",
        "misprint",
        r"the second term of eq:Ttildesmall is the one from $(u_1, u_2)$",
        r"the first; it is the second of the four pieces (eq:secondTerm)",
        r"section 7.3 counts them rightly",
        "eq:secondTerm",
        evidence_text.which_term,
    ),
    Erratum(
        "7.3, first sentence",
        "",
        "misprint",
        r"the exact $T$ comes from putting fr1 and fr2 into eq:Ttilde",
        r"eq:Ttilde has neither $a^+$ nor $A'(u_i)$ in it: it needs $V$ (eq:Vfric), and "
        r"eq:Ttildesmall needs $V(u_i)$ too",
        r"none",
        "eq:Vfric",
        evidence_text.not_enough_for_the_integral,
    ),
    Erratum(
        "7.3, figure 8",
        "",
        "misprint",
        r"$\kappa_p = 0.01$ in the caption, $0.1$ in the text",
        r"$0.01$: at $0.1$ nothing is exponentially large",
        r"none",
        "threshold",
        evidence_text.caption_noise,
    ),
    Erratum(
        "7.3, figure 8",
        "",
        "misprint",
        r"three values of $\mu$ in the text",
        r"four, as in the caption",
        r"none",
        "eq:Ttildesmall",
        argument=r"text and caption name different numbers of curves",
    ),
    Erratum(
        "7.3, figure 7",
        "",
        "misprint",
        r"the caption speaks of a panel (iii)",
        r"there are (i) and (ii), as the same caption says before",
        r"none",
        "eq:Ttildesmall",
        argument=r"the caption lists two values of $\mu$, one to a panel",
    ),
    Erratum(
        "2, on the smoothed flow",
        "",
        "misprint",
        r"the crossing case is said to resemble panel (i) of figure 1",
        r"panel (ii)",
        r"none",
        "regions",
        argument=r"panel (i) of figure 1 is the sliding case",
    ),
    # -- not sharp ----------------------------------------------------------------------------
    Erratum(
        "6.1",
        "eq:Psmall2",
        "not sharp",
        r"$P = 1 + O(\kappa^2)$",
        r"$1 - P$ is exponentially small, with the derived prefactor",
        r"eq:Psmall likewise",
        "eq:Psmall2",
        evidence.occupation_order,
    ),
    Erratum(
        "6.2",
        "eq:secondTerm",
        "not sharp",
        r"relative remainder $O(\kappa)$",
        r"$O(\kappa^2)$: the odd order cancels; its coefficient is derived",
        r"eq:Ttildesmall and appendix A.3 likewise",
        "eq:secondTerm",
        evidence.well_order,
    ),
    Erratum(
        "7.3, end",
        "",
        "not sharp",
        r"threshold $\sqrt{-\varepsilon/\log\varepsilon} \approx 0.05$, whatever the barrier",
        r"$\sqrt{-2 D \varepsilon/\log\varepsilon}$, $D$ the height of the barrier; $0.0466$ for "
        r"$2 D = 1$",
        r"none",
        "threshold",
        evidence.threshold_constant,
    ),
    Erratum(
        "6.2, on eq:fourPieces",
        "",
        "not sharp",
        r"the first three pieces are at most $O(\kappa^2)$ in strong noise",
        r"$1/a^- + O(\kappa^{-2})$, $3/\kappa^2 + O(\kappa^{-4})$, $\kappa^2/(2 a^+ a^-) + O(1)$",
        r"none",
        "first-three",
        evidence_text.second_piece_order,
    ),
    Erratum(
        "A.2",
        "",
        "not sharp",
        r"factor $(1 + \Delta)/(1 - \Delta)$, 2 in the final bound",
        r"$1/(1 - \Delta)$, $4/3$: the quotient of the two bounds before it has no $1 + \Delta$",
        r"none",
        "C-bound",
        evidence.slack_factor,
    ),
    # -- wording ------------------------------------------------------------------------------
    Erratum(
        "2 and 8",
        "",
        "wording",
        r"noise wins where $\kappa_p$ is sufficiently large relative to $\varepsilon$",
        r"relative to $\sqrt\varepsilon$, as sections 3 and 8 go on to say: $\kappa_p$ may be many "
        r"times $\varepsilon$ and still be weak",
        r"the abstract likewise",
        "eq:tildexykappa",
        evidence.comparison_with_sqrt_eps,
    ),
    Erratum(
        "6.2",
        "eq:Ttildelarge",
        "wording",
        r"relative error $O(\kappa_p^2/r_p)$, without a word on $a^+$",
        r"true for each $a^+$, with a constant that grows as $1/a^+$: it is small where "
        r"$a^+ r \gg \kappa^2$",
        r"no help for figure 7 as $z_0 \to 1 - \alpha$, where $a^+ \to 0$",
        "constant-drift",
        evidence.weak_outward_drift,
    ),
    Erratum(
        "3, before point 1",
        "",
        "wording",
        r"the probability of eq:Plarge and eq:Psmall is that of remaining in the layer after $t$",
        r"of being there at $t$: the path may have left and come back, and in the end it always "
        r"has",
        r"none: the formulas are those of being there",
        "eq:P",
        evidence_text.remaining,
    ),
    Erratum(
        "8",
        "",
        "wording",
        r"a cubic friction characteristic gives rise to a well",
        r"only for $\mu > 1/2$; figure 7 (ii) is the cubic without one",
        r"none",
        "turning-points",
        evidence_text.cubic_without_well,
    ),
    Erratum(
        "7.3, on figure 7",
        "",
        "wording",
        r"$T$ scales as $e^{1/\kappa_p^2}$",
        r"as $e^{2 D \varepsilon/\kappa_p^2}$: the constant that scaling leaves open is "
        r"proportional "
        r"to $\varepsilon$",
        r"none",
        "eq:Ttildesmall",
        evidence.noise_scale,
    ),
    Erratum(
        "7.3, list of regions",
        "",
        "wording",
        r"the list has crossing for $z < z_0^{(+)}$ and nothing for $z > 2$",
        r"$z > 2$ crosses as well (to the left), with a well for $2 < z < z_0^{(-)}$",
        r"none, the figures have $z < 0$",
        "folds",
        evidence_text.other_crossing,
    ),
    Erratum(
        "7.3, on figure 7",
        "",
        "wording",
        r"a well of $V(v) - V(u)$ at $(u_1, u_2)$",
        r"a maximum there; the well is $V$'s, at $u_1$",
        r"none",
        "fr2",
        evidence_text.maximum_not_well,
    ),
    Erratum(
        "2",
        "eq:genSDE",
        "wording",
        r"the noise is taken to be uniform in the position, beside an amplitude $\kappa_p D(x)$",
        r"$D$ constant, or smooth and frozen at the origin, as section 4 does",
        r"none: section 4 has $D(0)$ alone; that $D$ may vary is also named as an extension",
        "eq:scaledSDE",
        argument=r"an amplitude that depends on $x$ is not uniform in $x$",
    ),
    Erratum(
        "8",
        "",
        "wording",
        r"the results are said to be shown rigorously",
        r"asymptotically: sections 6.1 and 6.2 leave the remainders of the reduction, $O(r_p)$, "
        r"outside the paper",
        r"none",
        "eq:TtildetoT",
        argument=r"both sections end by saying that a demonstration is beyond the paper",
    ),
    Erratum(
        "7.3, on figure 8",
        "",
        "wording",
        r"the curves are called simulations",
        r"values of the exact integral and of the asymptotic formula, as the caption says",
        r"none",
        "eq:Ttilde",
        argument=r"no path is drawn at random for any curve of figures 7 and 8",
    ),
    Erratum(
        "3",
        "eq:Tsmall",
        "wording",
        r"$T_p > O(r_p)$, and likewise $\kappa_p/\sqrt\varepsilon \ge O(1)$ and "
        r"$t > O(\kappa_p^2)$",
        r"$T_p/r_p \to \infty$, and $\kappa_p/\sqrt\varepsilon$ and $t/\kappa_p^2$ bounded from "
        r"below",
        r"none",
        "eq:Tsmall",
        argument=r"$O$ bounds from above: everything positive is greater than some $O(r_p)$, 0",
    ),
    Erratum(
        "4",
        "eq:scaledSDE",
        "wording",
        r"remainder $O(r_p)$ beside $dt$ and $dW$",
        r"$O(r_p)\,dt$ in the drift and $O(\kappa_p r_p)\,dW$ in the noise",
        r"none",
        "eq:scaledSDE",
        argument=r"an increment over $dt$ has no part that does not vanish with $dt$",
    ),
    Erratum(
        "5.2",
        "eq:BCs2",
        "wording",
        r"the first condition fixes the position at every time",
        r"the position at time 0",
        r"none",
        "eq:Ttilde0",
        argument=r"the condition is printed for $t = 0$",
    ),
    Erratum(
        "3, point 4",
        "",
        "wording",
        r"the vector $F$ is compared with 0",
        r"its component across the surface, $A$ of section 4",
        r"none",
        "eq:scaledSDEx",
        argument=r"vectors are not ordered",
    ),
    Erratum(
        "1, last paragraph",
        "",
        "wording",
        r"escape times for sliding, densities for crossing",
        r"the other way round",
        r"none",
        "eq:P",
        argument=r"section 6.1 has the density of sliding, 6.2 the escape time of crossing",
    ),
)


def table() -> list[dict[str, Any]]:
    """Every entry with its numbers worked out, as plain data."""
    rows = []
    for entry in ERRATA:
        row: dict[str, Any] = {
            "place": entry.place,
            "kind": entry.kind,
            "printed": entry.printed,
            "right": entry.right,
            "consequence": entry.consequence,
            "derivation": entry.derivation,
            "argument": entry.argument,
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
    from fractions import Fraction

    import mpmath

    exact = (
        mpmath.mpf(value.numerator) / value.denominator if isinstance(value, Fraction) else value
    )
    return str(mpmath.nstr(mpmath.mpf(exact), 8))
