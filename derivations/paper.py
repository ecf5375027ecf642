"""Shared by the section modules: symbols with their meaning, and a derivation that uses others."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sympy
from sympy import Function, Symbol

from symasym.derivation import Derivation

# Scaled variables are those of symasym: u for the paper's tilde y, kappa for its tilde kappa.
u = Symbol("u", real=True)
v = Symbol("v", real=True)
w = Symbol("w", real=True)
t = Symbol("t", positive=True)
x = Symbol("x", real=True)
kappa = Symbol("kappa", positive=True)
r = Symbol("r", positive=True)
# Where a+ and a- have one sign (crossing to the right) they are positive symbols.
a_minus = Symbol("a_minus", positive=True)
a_plus = Symbol("a_plus", positive=True)
# Sliding: a+ < 0.
a_plus_sliding = Symbol("a_plus", negative=True)
eps = Symbol("epsilon", positive=True)
# Physical noise amplitude and radius, before scaling.
kappa_physical = Symbol("kappa_phys", positive=True)
r_physical = Symbol("r_phys", positive=True)
mu = Symbol("mu", positive=True)
alpha = Symbol("alpha", positive=True)
z0 = Symbol("z0", real=True)
C = Symbol("C", positive=True)
u1, u2 = Symbol("u1", real=True), Symbol("u2", real=True)
T = Symbol("T", positive=True)

phi = Function("phi")
V = Function("V")
p = Function("p")

lam = 2 / kappa**2

NAMES: dict[Any, str] = {
    kappa: r"\kappa",
    a_minus: "a^-",
    a_plus: "a^+",
    a_plus_sliding: "a^+",
    eps: r"\varepsilon",
    kappa_physical: r"\kappa_{\mathrm{phys}}",
    r_physical: r"r_{\mathrm{phys}}",
    z0: "z_0",
    u1: "u_1",
    u2: "u_2",
    Symbol("V_1", real=True): "V(1)",
    Symbol("V_top", real=True): "V(1)",
    Symbol("V_0", real=True): "V(0)",
    Symbol("V_m", real=True): "V(u_m)",
    Symbol("V_u1", real=True): "V(u_1)",
    Symbol("V_u2", real=True): "V(u_2)",
    Symbol("V_max", real=True): r"V_{\max}",
    Symbol("phi_0", positive=True): r"\phi(0)",
    Symbol("K_m", positive=True): "V''(u_m)",
    Symbol("A_1", negative=True): "A'(u_1)",
    Symbol("A_2", positive=True): "A'(u_2)",
    # Left sides.
    Symbol("z_plus"): "z_0^{(+)}",
    Symbol("z_minus"): "z_0^{(-)}",
    Symbol("t_s"): r"\tilde t",
    Symbol("A'_1"): "A'(u_1)",
    Symbol("A'_2"): "A'(u_2)",
    Symbol("A'"): "A'(u)",
    Symbol("C_high"): r"C_{\mathrm{bound}}",
    Symbol("P_low"): r"P_{\mathrm{bound}}",
    Symbol("kappa_c"): r"\kappa_c",
    Symbol("Lq"): r"\mathcal{L}^* q",
    Symbol("LR"): r"\mathcal{L}^* R",
    Symbol("kappa_e"): r"\kappa_e",
    Symbol("ydot"): r"\dot y",
    Symbol("zdot"): r"\dot z",
    **{
        Symbol(f"{n}_{side}", positive=True): f"{tex}_{{\\mathrm{{{side}}}}}"
        for side in ("left", "right")
        for n, tex in (("sigma", "\\sigma"), ("w", "w"), ("y", "y"), ("K", "K"), ("M", "M"))
    },
    **{
        Symbol(f"log_{n}_{side}", real=True): f"\\log {tex}_{{\\mathrm{{{side}}}}}"
        for side in ("left", "right")
        for n, tex in (("sigma", "\\sigma"), ("w", "w"))
    },
    Symbol("lam", positive=True): r"\lambda",
    Symbol("inside", positive=True): r"M_{\mathrm{in}}",
    Symbol("outside", positive=True): r"M_{\mathrm{out}}",
    Symbol("log_inside", real=True): r"\log M_{\mathrm{in}}",
    Symbol("log_outside", real=True): r"\log M_{\mathrm{out}}",
    Symbol("near", positive=True): r"n",
    Symbol("far", positive=True): r"f",
    Symbol("both", positive=True): r"b",
    Symbol("end", positive=True): r"e_b",
    Symbol("both_down"): r"b_{\mathrm{down}}",
    Symbol("both_up"): r"b_{\mathrm{up}}",
    Symbol("g_s"): "g_s",
    Symbol("I_left"): r"I_{\mathrm{left}}",
    Symbol("I_right"): r"I_{\mathrm{right}}",
}


class PaperDerivation(Derivation):
    """A derivation that may take up the results of those it rests on.

    `build` gives the derivation of a label, `holds` the truth of the numbers of a counterexample,
    by its name in `derivations.evidence`.
    """

    def __init__(
        self,
        label: str,
        title: str,
        rests_on: tuple[str, ...],
        build: Callable[[str], Derivation],
        holds: Callable[[str], bool],
    ) -> None:
        super().__init__(label, title, rests_on, dict(NAMES))
        self._build = build
        self.holds = holds

    def use(self, label: str) -> Any:
        """The result of another derivation, which must be among `rests_on`."""
        if label not in self.rests_on:
            raise ValueError(f"{self.label} uses {label} without resting on it.")
        result = self._build(label).result
        if result is None:
            raise ValueError(f"{label} has concluded nothing.")
        return result


def rational(text: str) -> Any:
    """An exact SymPy number."""
    return sympy.Rational(text)
