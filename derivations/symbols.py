"""The symbols of the formulas: their meaning, their scaling, the quantity they belong to.

A symbol means the same in every formula, but for those in `LOCAL`: a letter that
one derivation, or a few, use for something of their own.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

QUANTITIES = (
    "Escape time",
    "Exit probability",
    "Occupation of the layer",
    "Stationary density",
    "Potential, wells and barriers",
    "Drift and its ends",
    "Scaling and noise",
    "Integrals over a panel",
)
_T, _C, _P, _R, _V, _A, _S, _X = QUANTITIES


@dataclass(frozen=True)
class Meaning:
    """Of one symbol.

    Attributes
    ----------
    text : str
    scale : str
        What it is measured in: in the paper's own variables, ``"unscaled"``.
    quantity : str
        The entry of `QUANTITIES` that a formula for it belongs to; empty for a
        symbol that stands on no left side.
    """

    text: str
    scale: str
    quantity: str = ""


_SCALED_TIME = "scaled: t/eps"
_PURE = "a number"
_DRIFT = "velocity, y/t: the same scaled and unscaled"
_SLOPE = "1/scaled time"
_POTENTIAL = "scaled: position times velocity"
_H = "scaled length times lam^k"
_LENGTH = "scaled length to the power"

#: Domains of integration of eq:fourPieces.
PIECES = {
    1: "-r < u < -1, 0 < v < 1",
    2: "-1 < u < v, 0 < v < 1",
    3: "-r < u < 1, 1 < v < r",
    4: "1 < u < v < r",
}

MEANINGS: dict[str, Meaning] = {
    # Position, time, scales.
    "u": Meaning("position across the surface", "scaled: y/eps", _S),
    "y": Meaning("position across the surface", "unscaled"),
    "z": Meaning("position along the surface; the spring's extension", "unscaled"),
    "t": Meaning("time", "unscaled"),
    "t_s": Meaning("time", _SCALED_TIME, _S),
    "epsilon": Meaning("half the width of the smoothed layer", "unscaled"),
    "kappa": Meaning("noise amplitude", "scaled: kappa_p/sqrt(eps)", _S),
    "kappa_phys": Meaning("noise amplitude", "unscaled"),
    "lam": Meaning("the large parameter 2/kappa^2", "scaled time per scaled length squared", _S),
    "r": Meaning("radius of escape", "scaled: r_p/eps", _S),
    "r_phys": Meaning("radius of escape", "unscaled"),
    # The drift.
    "phi": Meaning("drift", _DRIFT, _A),
    "A": Meaning("drift inside the layer", _DRIFT, _A),
    "a_minus": Meaning("drift for u <= -1", _DRIFT),
    "a_plus": Meaning("drift for u >= 1", _DRIFT, _A),
    "a": Meaning("a drift that is constant", _DRIFT),
    "A'": Meaning("slope of the drift inside the layer", _SLOPE, _A),
    "A'_1": Meaning("slope of the drift at the well u1", _SLOPE, _A),
    "A'_2": Meaning("slope of the drift at the barrier u2", _SLOPE, _A),
    "A_1": Meaning("slope of the drift at the well u1, negative", _SLOPE, _A),
    "A_2": Meaning("slope of the drift at the barrier u2, positive", _SLOPE, _A),
    "F": Meaning("friction force", "unscaled", _A),
    "mu": Meaning("shape of the friction force", _PURE),
    "alpha": Meaning("friction force at the layer's edges", "unscaled", _A),
    "z0": Meaning("where on the surface: the spring's extension", "unscaled"),
    "beta": Meaning("breakaway force", "unscaled", _A),
    "u_s": Meaning("turning point of the friction force", "scaled: y/eps", _A),
    "z_1": Meaning("lower edge of the sliding region", "unscaled", _A),
    "z_2": Meaning("upper edge of the sliding region", "unscaled", _A),
    "g_s": Meaning("sliding velocity along the surface", "unscaled", _A),
    "g_minus": Meaning("velocity along the surface on its left", "unscaled"),
    "g_plus": Meaning("velocity along the surface on its right", "unscaled"),
    "ydot": Meaning("rate of y", "unscaled", _A),
    "zdot": Meaning("rate of z", "unscaled", _A),
    "f": Meaning("vector field", "unscaled", _A),
    "f_0": Meaning("vector field at the origin", "unscaled"),
    # Potential, wells, barriers.
    "V": Meaning("potential, V' = -phi and V(-1) = 0", _POTENTIAL, _V),
    "V_1": Meaning("potential at the layer's right edge", _POTENTIAL),
    "V_top": Meaning("potential at the layer's right edge", _POTENTIAL),
    "V_u1": Meaning("potential at the well u1", _POTENTIAL),
    "V_u2": Meaning("potential at the barrier u2", _POTENTIAL),
    "V_m": Meaning("lowest value of the potential", _POTENTIAL),
    "K_m": Meaning("curvature of V at its lowest point, V'' = -A'", _SLOPE),
    "D": Meaning("height of the barrier, V(u2) - V(u1)", _POTENTIAL, _V),
    "u1": Meaning("the well, a zero of the drift", "scaled: y/eps"),
    "u2": Meaning("the barrier, a zero of the drift", "scaled: y/eps"),
    "u3": Meaning("the third zero of the cubic", "scaled: y/eps"),
    "z_plus": Meaning("fold where well and barrier coalesce on u > 0, 1 - beta", "unscaled", _V),
    "z_minus": Meaning("fold where well and barrier coalesce on u < 0, 1 + beta", "unscaled", _V),
    # Escape.
    "T": Meaning("mean escape time from |u| < r, start 0", _SCALED_TIME, _T),
    "T_0": Meaning("mean escape time without the terms of C", _SCALED_TIME, _T),
    **{
        f"T_{n}": Meaning(f"piece of T_0: {where}", _SCALED_TIME, _T) for n, where in PIECES.items()
    },
    "S": Meaning("Stokes multiplier of the well's term", _PURE, _T),
    "p": Meaning("density of the position at a time", "per scaled length", _R),
    "R": Meaning("density integrated over all time", "scaled time per scaled length", _T),
    "C": Meaning("probability of leaving through -r", _PURE, _C),
    "C_high": Meaning("upper bound on C", _PURE, _C),
    "J": Meaning("flux of R to the left", _PURE, _C),
    "kappa_c": Meaning("noise below which escape is exponentially slow", "unscaled", _T),
    "kappa_e": Meaning(
        "noise at which the well's term of T is r/a+", "scaled: kappa_p/sqrt(eps)", _T
    ),
    "ell": Meaning("-log(eps)", _PURE),
    # Steady state.
    "p_ss": Meaning("stationary density", "per scaled length", _R),
    "K": Meaning("normalizing constant of p_ss, its value at u = -1", "per scaled length"),
    "P": Meaning("stationary probability of |u| <= 1", _PURE, _P),
    "P_low": Meaning("lower bound on P", _PURE, _P),
    "L": Meaning("length of an interval (1 - L, 1) where V <= V(1)", "scaled: y/eps"),
    "I_left": Meaning("integral of exp(-2V/kappa^2) over u < -1", "scaled length", _P),
    "I_right": Meaning("integral of exp(-2V/kappa^2) over u > 1", "scaled length", _P),
    "Lq": Meaning("Fokker-Planck operator applied to q", "per scaled length and time", _R),
    "LR": Meaning("Fokker-Planck operator applied to R", "per scaled length", _T),
    "q": Meaning("any density; a mode of the operator", "per scaled length"),
    # Terms of the exact integrals.
    "w": Meaning(
        "lam/sigma times the integral of sigma from the end, both sides added",
        "scaled time per scaled length",
    ),
    "sigma_left": Meaning("Sigma/s on the left of the start, s = exp(lam V)", "scaled length"),
    "sigma_right": Meaning("Sigma/s on the right of the start, s = exp(lam V)", "scaled length"),
    "I0": Meaning("integral of exp(lam V) over (0, r)", "scaled length"),
    "I1": Meaning("integral of exp(lam V) over (-r, 0)", "scaled length"),
    "J0": Meaning(
        "integral over v in (0, r) of exp(lam V) times the integral of exp(-lam V) from -r to v",
        "scaled length squared",
    ),
    "J1": Meaning(
        "integral over v in (-r, 0) of exp(lam V) times the integral of exp(-lam V) from -r to v",
        "scaled length squared",
    ),
}

_BLOCK = {
    "y": Meaning("velocity of the block relative to the belt", "unscaled"),
    "z": Meaning("extension of the spring", "unscaled"),
}
_DERIVATIVES = {
    "c_2": Meaning("curvature of V at the well, of -V at a barrier", _SLOPE),
    **{
        f"c_{j}": Meaning(
            f"{nth} derivative of V at the well, of -V at a barrier",
            f"scaled velocity per scaled length {power}",
        )
        for j, nth, power in (
            (3, "third", "squared"),
            (4, "fourth", "cubed"),
            (5, "fifth", "to the fourth"),
            (6, "sixth", "to the fifth"),
            (7, "seventh", "to the sixth"),
        )
    },
}
LOCAL: dict[str, dict[str, Meaning]] = {
    "eq:cont": {
        "F": Meaning("field inside the layer", "unscaled", _A),
        "f^-": Meaning("field below the layer", "unscaled"),
        "f^+": Meaning("field above the layer", "unscaled"),
    },
    "eq:S": {"Z": Meaning("lam^(2/3) zeta, of the distance from the fold", _PURE)},
    "eq:eekappar": {
        "rho": Meaning("r/kappa^2 in the paper's own variables", "unscaled", _S),
    },
    "eq:scaledSDE": {
        "rho": Meaning("distance from the origin, at most of order r_p", "unscaled"),
    },
    "eq:scaledSDEx": {
        "drift": Meaning("drift of the component across the surface", "unscaled", _S),
        "F2": Meaning("component of the field across the surface", "unscaled"),
        **{f"B{n}": Meaning("strength of noise " + str(n), "unscaled", _S) for n in (1, 2, 3)},
        **{f"d2{n}": Meaning("entry of the noise matrix", "unscaled") for n in (1, 2, 3)},
    },
    "noise-amplitude": {
        "sigma": Meaning("amplitude of the noises together", "unscaled", _S),
        **{f"b{n}": Meaning("strength of noise " + str(n), "unscaled") for n in (1, 2, 3)},
    },
    "eq:reducedSDE": {
        "drift": Meaning("drift of y", "unscaled", _S),
        "noise": Meaning("noise amplitude of y", "unscaled", _S),
        **{f"b{n}": Meaning("strength of noise " + str(n), "unscaled") for n in (1, 2, 3)},
    },
    "eq:reducedSDEtilde": {
        "c_1": Meaning("coefficient of the first derivative in the generator", _DRIFT, _S),
        "c_2": Meaning(
            "coefficient of the second derivative in the generator",
            "scaled length squared per scaled time",
            _S,
        ),
    },
    "regions": {"N": Meaning("how many of the two fields point to the surface", _PURE, _A)},
    "eq:Plarge": {"P": Meaning("stationary probability of |y| <= eps", _PURE, _P)},
    "eq:Psmall": {"P": Meaning("stationary probability of |y| <= eps", _PURE, _P)},
    "eq:Tlarge": {"T": Meaning("mean escape time from |y| < r_phys", "unscaled", _T)},
    "eq:TtildetoT": {
        "T": Meaning("mean escape time from |y| < r_phys", "unscaled", _T),
        "t_s": Meaning("mean escape time", _SCALED_TIME),
    },
    "eq:odeR": {"m": Meaning("decay rate of the mode", "per scaled time")},
    "laplace-substitution": {
        "c2": Meaning("curvature of V at the saddle, V''(u1)", _SLOPE),
        "uhat": Meaning("(u - u1)/kappa", "root of scaled time"),
    },
    "saddle-series": {
        "S": Meaning(
            "ratio of the integral of exp(-lam V) about the well to its Gaussian", _PURE, _T
        ),
        **_DERIVATIVES,
    },
    "saddle-start": {
        "H": Meaning(
            "integral of exp(-lam V) to the right of the start, over the well's Gaussian", _PURE, _T
        ),
        **_DERIVATIVES,
    },
    "pair-products": {
        "Z": Meaning("lam^(2/3) zeta, of the pair's distance", _PURE, _A),
        "t": Meaning("s(v) - s(u)", _PURE),
        "m": Meaning("half-way between s(u) and s(v)", _PURE, _A),
        "J": Meaning("double integral over the pair", "units of lam^(-2/3)", _T),
        "J_1": Meaning("the same with the weight s(v), its finite part", "units of lam^(-1)", _T),
        "J_2": Meaning("the same with s(u) s(v), its finite part", "units of lam^(-4/3)", _T),
    },
    "endpoint-series": {
        "E_up": Meaning("coefficient of lam^-k in the integral of exp(lam V)", _H, _T),
        "E_down": Meaning("coefficient of lam^-k in the integral of exp(-lam V)", _H, _T),
        "side": Meaning("(-1)^k", _PURE),
        "left": Meaning("h_k on the left of the point, 0 at a start", _H),
        "right": Meaning("h_k on the right of the point, 0 at an end", _H),
    },
    "regular-part": {
        "h_next": Meaning("coefficient of t^(i - p - 1) in -h'", "h over a power of t", _T),
        "H": Meaning("coefficient of t^(1 - p) in the primitive", "h over a power of t", _T),
        "term": Meaning("coefficient of t^(i - p) in h", "h over a power of t"),
        "power": Meaning("order of the pole of h", "a whole number"),
        "index": Meaning("number of the coefficient, from 0 on", "a whole number"),
    },
    "pair-primitives": {
        "H_even": Meaning("primitive of alpha/(y^2 - R^2), y > 0", _SCALED_TIME, _T),
        "H_line": Meaning("primitive of alpha/(y^2 + R^2)", _SCALED_TIME, _T),
        "H_odd": Meaning("primitive of beta y/(y^2 - D)", _SCALED_TIME, _T),
        "s_1": Meaning("integral of 1/(y^2 + R^2) over the line", "1/scaled length", _T),
        "s_next": Meaning(
            "integral of (y^2 + R^2)^(-n - 1) over the line", f"{_LENGTH} -1 - 2 n", _T
        ),
        "b_next": Meaning("binomial coefficient of D^(i + 1) y^(-2n - 2i - 2)", _PURE, _T),
        "I": Meaning("integral of y^(j + 2) (y^2 - D)^(-n)", f"{_LENGTH} j + 3 - 2 n", _T),
        "h_next": Meaning(
            "coefficient of y^j in -h' (y^2 - D)^(p + 1)", f"h times {_LENGTH} 2 p + 1 - j", _T
        ),
        "alpha": Meaning(
            "coefficient in the pole part of 1/phi, (alpha + beta y)/(y^2 - D)",
            "scaled time times scaled length",
        ),
        "beta": Meaning("coefficient of y in the pole part of 1/phi", _SCALED_TIME),
        "y": Meaning("position from half-way between the zeros", "scaled: y/eps"),
        "R": Meaning("sqrt(|D|), half the zeros' distance if they are real", "scaled: y/eps"),
        "gap": Meaning("y - R", "scaled: y/eps"),
        "square": Meaning(
            "square of half the zeros' distance, negative for a complex pair",
            "scaled length squared",
        ),
        "product": Meaning("|y^2 - D|", "scaled length squared"),
        "share": Meaning("integral of (y^2 + R^2)^(-n) over the line", f"{_LENGTH} 1 - 2 n"),
        "term": Meaning("binomial coefficient of D^i y^(-2n - 2i)", _PURE),
        "lower": Meaning("integral of y^j (y^2 - D)^(1 - n)", f"{_LENGTH} j + 3 - 2 n"),
        "same": Meaning("integral of y^j (y^2 - D)^(-n)", f"{_LENGTH} j + 1 - 2 n"),
        "before": Meaning(
            "coefficient of y^(j - 1) in h (y^2 - D)^p", f"h times {_LENGTH} 2 p + 1 - j"
        ),
        "after": Meaning(
            "coefficient of y^(j + 1) in h (y^2 - D)^p", f"h times {_LENGTH} 2 p - 1 - j"
        ),
        "n": Meaning("power of the pole", "a whole number"),
        "i": Meaning("number of the coefficient, from 0 on", "a whole number"),
        "power": Meaning("power of the pole of h", "a whole number"),
        "index": Meaning("power of y", "a whole number"),
    },
    "saddle-recurrences": {
        "alpha_j": Meaning(
            "coefficient of t^j in V over its quadratic term", "1/scaled length to the power j", _T
        ),
        "m_0": Meaning("integral of exp(-s^2/2)", _PURE, _T),
        "m_next": Meaning("integral of s^(2n + 2) exp(-s^2/2)", _PURE, _T),
        "moment": Meaning("integral of s^(2n) exp(-s^2/2)", _PURE),
        "n": Meaning("number of the moment, from 0 on", "a whole number"),
        "j": Meaning("power of t", "a whole number"),
        "term": Meaning("coefficient of t^(j + 1) in phi", "velocity over a power of t"),
        "slope": Meaning("slope of the drift at its zero", _SLOPE),
    },
    "two-sides": {
        "behind": Meaning("integral of exp(lam V) left of the start", "scaled length"),
        "ahead": Meaning("integral of exp(lam V) right of the start", "scaled length"),
        "total": Meaning("integral of exp(lam V) over both sides", "scaled length"),
        "nested_left": Meaning("double integral left of the start", "scaled length squared"),
        "nested_right": Meaning("double integral right of the start", "scaled length squared"),
        "speed_start": Meaning(
            "contribution of the start to the integral of exp(-lam V)", "scaled length"
        ),
    },
    "airy-form": {
        "I_up": Meaning("integral of exp(lam V) over the pair", "scaled length", _T),
        "I_down": Meaning("integral of exp(-lam V) over the pair", "scaled length", _T),
        "I_both": Meaning("double integral over the pair", "scaled length squared", _T),
        "Z": Meaning("lam^(2/3) zeta, of the pair's distance", _PURE, _A),
        "small": Meaning("lam^(-1/3)", "lam^(-1/3)"),
        "a": Meaning("du/ds half-way between the zeros", "scaled length times lam^(1/3)"),
        "b": Meaning(
            "slope of du/ds in s half-way between the zeros", "scaled length times lam^(2/3)"
        ),
    },
    "truncated-gaussian": {
        "I_up": Meaning(
            "contribution of the end to the integral of exp(lam V)", "scaled length", _T
        ),
        "I_down": Meaning(
            "contribution of the end to the integral of exp(-lam V)", "scaled length", _T
        ),
        "I_both": Meaning(
            "contribution of the end to the double integral", "scaled length squared", _T
        ),
        "t": Meaning("the square root of twice the fall of V to the end", "lam^(-1/2)"),
        "peak": Meaning("du/dt at the barrier", "root of scaled time"),
        "rest": Meaning("1/phi at the end less p/t", "scaled time per scaled length"),
        "tail": Meaning("the Gaussian integral beyond the end, over its value there", "lam^(-1/2)"),
        "dawson": Meaning("Dawson's integral up to the end", "lam^(-1/2)"),
        "integral": Meaning("lam times the integral of Dawson's", _PURE),
    },
    "positive-density": {
        "w": Meaning(
            "lam e^(lam V(u)) times the integral of e^(-lam V) over all positions",
            "scaled time per scaled length",
        ),
    },
    "threshold": {"ell": Meaning("", "")},
    "gaussian-step": {"G": Meaning("lam times two Gaussian integrals", _SCALED_TIME, _T)},
    "eq:fourPieces": {
        **{
            f"T_{n}": Meaning(f"piece {n} of four of T_0, over lam", "scaled length squared", _T)
            for n in (1, 2, 3, 4)
        },
        "f": Meaning("exp(-lam V)", _PURE),
        "g": Meaning("exp(lam V)", _PURE),
    },
    **{
        label: {
            "N": Meaning("integral of exp(-2V/kappa^2) inside the layer", "scaled length"),
            "M": Meaning("integral of exp(-2V/kappa^2) outside the layer", "scaled length"),
        }
        for label in ("eq:P", "eq:P2")
    },
    "constant-panel": {
        "x": Meaning("lam |a| h, h the width of the panel", _PURE),
        "int_e": Meaning("integral of e^(+-lam V), its largest value taken as 1", "widths", _X),
        "nested_down": Meaning("double integral where V falls", "squared widths", _X),
        "nested_up": Meaning("double integral where V rises", "squared widths", _X),
    },
    "panel-step": {
        "sigma": Meaning(
            "Sigma/s at the panel's left end, s = exp(lam V), Sigma its integral from the end",
            "scaled length",
        ),
        "sigma_b": Meaning("Sigma/s at the panel's right end", "scaled length", _X),
        "w": Meaning(
            "lam/sigma times the integral of sigma from the end to the panel",
            "scaled time per scaled length",
        ),
        "w_b": Meaning("w at the panel's right end", "scaled time per scaled length", _X),
        "int_e": Meaning("c times the integral of e = exp(lam (V - V(a)))", "scaled length"),
        "int_inverse": Meaning("f times the integral of 1/e", "scaled length"),
        "nested": Meaning(
            "f times the double integral of e(v)/e(u) over v < u", "scaled length squared"
        ),
        "fall": Meaning("exp(-lam(V(a) - V(b))) where V falls, else 1", _PURE),
        "climb": Meaning("exp(-lam(V(b) - V(a))) where V rises, else 1", _PURE),
    },
    "eq:osc2": _BLOCK,
    "eq:osc3": {
        **_BLOCK,
        "drift_z": Meaning("drift of z", "unscaled", _A),
        "drift_y": Meaning("drift of y", "unscaled", _A),
        "noise_z": Meaning("noise amplitude of z", "unscaled", _S),
        "noise_y": Meaning("noise amplitude of y", "unscaled", _S),
    },
    "release-time": {
        "T": Meaning("mean time of release from (u, z)", _SCALED_TIME, _T),
        "v": Meaning("variance of the time of release", "scaled time squared", _T),
        "g": Meaning("velocity of the slow variable z", "unscaled"),
    },
    "release-order": {
        "T_1": Meaning("coefficient of eps in the mean time of release", _SCALED_TIME, _T),
        "Sigma": Meaning("scale function, the integral of exp(lam V) from -r", "scaled length"),
        "s": Meaning("source: what the motion of z and y = eps u changes T_f by", "scaled time"),
        "T_f": Meaning("mean escape time with z frozen", _SCALED_TIME),
        "g": Meaning("velocity of the slow variable z", "unscaled"),
        "phi_y": Meaning("slope of the drift in y, unscaled", "unscaled"),
        "x": Meaning("position of the start", "scaled: y/eps"),
    },
    "release-adiabatic": {
        "H": Meaning("chance to be held at a time", _PURE, _T),
        "k": Meaning("rate of escape, 1/T with z frozen where it is", "1/scaled time"),
        "t": Meaning("time", _SCALED_TIME),
    },
    "frozen-time": {
        "T": Meaning("mean time of release", _SCALED_TIME, _T),
        "sigma_T": Meaning("standard deviation of the time of release", _SCALED_TIME, _T),
        "T_f": Meaning("mean escape time with z frozen at its start", _SCALED_TIME),
        "Tf_z": Meaning("derivative of T_f by z", "scaled time per unscaled z"),
        "g": Meaning("velocity of the slow variable z", "unscaled"),
    },
    "fold-delay": {
        "a": Meaning("unit of the distance from the fold's u", "scaled: y/eps", _V),
        "b": Meaning("unit of time past the fold", _SCALED_TIME, _V),
        "w_1": Meaning("distance from the fold's u in its unit", _PURE, _V),
        "s": Meaning("time past the fold in its unit", _PURE),
    },
    "friction-well": {"omega": Meaning("a third of arccos((1 - z0)/beta)", "an angle", _A)},
    "eq:forcePWC": {"alpha": Meaning("Coulomb friction force", "unscaled")},
}

_ZETA = Meaning("square of the zeros' place in s", "lam^(-2/3)")
_S_OF_U = Meaning("the variable of the cubic, phi du = (s^2 - zeta) ds", "lam^(-1/3)")
#: Label -> TeX of symbols of its error, note, conditions and steps alone.
IN_WORDS: dict[str, dict[str, Meaning]] = {
    "eq:Tlarge": {
        r"\kappa_p": MEANINGS["kappa_phys"],
        r"\varepsilon": MEANINGS["epsilon"],
        r"\phi": MEANINGS["phi"],
    },
    "eq:Ttildesmall": {"S": MEANINGS["S"]},
    "eq:FPE": {
        "p": MEANINGS["p"],
        r"\tilde t": MEANINGS["t_s"],
    },
    "eq:Ttilde0": {
        "t": MEANINGS["t_s"],
        "u": MEANINGS["u"],
        "G": Meaning("probability not to have left |u| < r by the time t", _PURE),
    },
    "eq:odeR": {
        "t": MEANINGS["t_s"],
        r"\delta": Meaning("Dirac's delta at the start", "per scaled length"),
    },
    "first-integral": {"R": MEANINGS["R"]},
    "other-pieces": {"T_1": MEANINGS["T_1"], "T_2": MEANINGS["T_2"]},
    "friction-well": {r"\beta": MEANINGS["beta"], "z_0": MEANINGS["z0"]},
    "frozen-time": {"D": MEANINGS["D"]},
    "release-adiabatic": {
        "T": Meaning("mean escape time with z frozen where it is at t", _SCALED_TIME),
        "A'(u_1)": MEANINGS["A_1"],
    },
    "fold-delay": {
        "w": Meaning("distance of u from the fold's", "scaled, in the unit of u, see below"),
        "t": Meaning("time past the fold", _SCALED_TIME),
        "u": Meaning("position across the surface", "scaled, in a unit of its own, see below"),
        "z": Meaning("position along the surface", "in a unit of its own, see below"),
        "g": Meaning("velocity of the slow variable z", "in the unit of z"),
    },
    "regular-part": {"t": Meaning("distance from the zero of the drift", "scaled: y/eps")},
    "saddle-recurrences": {"t": Meaning("distance from the zero of the drift", "scaled: y/eps")},
    "first-three": {name: MEANINGS[name] for name in ("r", "T_1", "T_2")},
    "eq:phi": {"F": Meaning("field inside the layer, eq:cont", "unscaled")},
    "eq:scaledSDEx": {
        "y": MEANINGS["y"],
        "t": MEANINGS["t"],
        "W_j": Meaning("independent Brownian motions", "root of time"),
    },
    "eq:reducedSDE": {
        "y": MEANINGS["y"],
        "t": MEANINGS["t"],
        "W": Meaning("a Brownian motion", "root of time"),
    },
    "eq:reducedSDEtilde": {
        r"\tilde t": MEANINGS["t_s"],
        "W": Meaning("a Brownian motion", "root of scaled time"),
    },
    "eq:fourPieces": {
        **{
            f"T_{n}": Meaning(f"piece of T_0: {where}", _SCALED_TIME) for n, where in PIECES.items()
        },
        "T_0": MEANINGS["T_0"],
        "V": MEANINGS["V"],
    },
    "eq:osc3": {"t": MEANINGS["t"], "W": Meaning("a Brownian motion", "root of time")},
    "eq:scaledSDE": {
        "x": Meaning("position in all coordinates", "unscaled"),
        "r_p": MEANINGS["r_phys"],
        "M": Meaning("bound on the slopes of the coefficients", "unscaled"),
    },
    "eq:TtildeCzero": {
        "C": MEANINGS["C"],
        "J_0": MEANINGS["J0"],
        "J_1": MEANINGS["J1"],
    },
    "eq:S": {
        "A": MEANINGS["A"],
        r"\zeta": _ZETA,
        "s": _S_OF_U,
        "p": Meaning("du/ds half-way between the zeros", "scaled length times lam^(1/3)"),
        "G": Meaning("Ai^2 + Bi^2", _PURE),
    },
    "C-bound": {
        r"V_{\max}": Meaning("largest value of the potential on 0 <= u <= 1", _POTENTIAL),
        r"\Delta": Meaning("any number between 0 and 1, in the end 1/4", _PURE),
    },
    "pair-products": {r"\zeta": _ZETA, "s": _S_OF_U},
    "airy-form": {
        "y": Meaning("position from half-way between the zeros", "scaled: y/eps"),
        r"\psi": Meaning(
            "the drift over y^2 - D, up to sign", "1/(scaled length times scaled time)"
        ),
        "D": Meaning(
            "square of half the zeros' distance, negative for a complex pair",
            "scaled length squared",
        ),
        "R": Meaning("sqrt(D), half the zeros' distance", "scaled: y/eps"),
        r"\zeta": _ZETA,
        "s": _S_OF_U,
        "c": Meaning(
            "R/sqrt(zeta): the zeros are s = -R/c and s = R/c", "scaled length times lam^(1/3)"
        ),
    },
}


@dataclass(frozen=True)
class Listed:
    """A symbol of one formula: its name, its LaTeX, its meaning, and whether it stands left."""

    name: str
    latex: str
    meaning: Meaning
    left: bool


@cache
def symbols(label: str) -> tuple[Listed, ...]:
    """The symbols of a formula, those of the left side first.

    Raises
    ------
    KeyError
        For a symbol that this module does not explain.
    """
    from derivations.registry import build
    from symasym.derivation.printing import tex

    derivation = build(label)
    left = _symbols(derivation.left, arguments=False)
    shown = tuple(part for part in derivation.display if not isinstance(part, str))
    found = {**left, **_symbols((derivation.left, derivation.result, shown))}
    listed = []
    for name in sorted(found, key=lambda name: (name not in left, name.lower(), name)):
        meaning = LOCAL.get(label, {}).get(name) or MEANINGS.get(name)
        if meaning is None:
            raise KeyError(f"{label}: derivations/symbols.py does not explain {name!r}")
        symbol = found[name]
        listed.append(Listed(name, tex(symbol, derivation.names), meaning, name in left))
    return tuple(listed)


def quantities(label: str) -> tuple[str, ...]:
    """Subject of a formula: the quantities of the symbols on its left side."""
    from derivations.registry import build

    about = {s.meaning.quantity for s in symbols(label) if s.left} - {""}
    if build(label).left == 0:  # An equation for the zeros of the drift.
        about = {_V}
    if not about:
        raise KeyError(f"{label}: no symbol on its left side belongs to a quantity")
    return tuple(q for q in QUANTITIES if q in about)


def _symbols(stated: Any, arguments: bool = True) -> dict[str, Any]:
    """Symbols and undefined functions of anything a derivation may state.

    Without `arguments`, V(u) gives V alone.
    """
    import sympy
    from sympy.core.function import AppliedUndef

    from symasym.derivation import Expansion
    from symasym.derivation.results import parts

    if stated is None:
        return {}
    if isinstance(stated, Expansion):
        stated = (stated.leading, stated.gauge)
    if isinstance(stated, (tuple, list)):
        return {name: s for item in stated for name, s in _symbols(item, arguments).items()}
    found: dict[str, Any] = {}
    for expression in parts(stated):
        functions = expression.atoms(AppliedUndef)
        for applied in functions:
            found[applied.func.__name__] = sympy.Symbol(applied.func.__name__)
        if not arguments:
            expression = expression.subs(dict.fromkeys(functions, 0))
        for symbol in expression.free_symbols:
            found[symbol.name] = symbol
    return found
