r"""The paper's symbols: how they are printed, what they mean, in what units.

`TABLE` has a row for each name: LaTeX where SymPy would print another one, meaning, unit. Scaled
variables are those of symasym: ``u`` for the paper's :math:`\tilde y`, ``kappa`` for its
:math:`\tilde\kappa`. A symbol has the same meaning in every formula; symbols of a
single formula are explained in its note.
"""

from __future__ import annotations

from sympy import Function, Symbol

from symasym.derivation.tex import NAMES

TABLE = r"""
u | | position across the surface | scaled: $y/\varepsilon$
v | | position across the surface | scaled: $y/\varepsilon$
y | | position across the surface | unscaled
z | | position along the surface; the spring's extension | unscaled
t | | time | scaled: $t_p/\varepsilon$
t_phys | t_p | time | unscaled
epsilon | \varepsilon | half the width of the smoothed layer | unscaled
kappa | | noise amplitude | scaled: $\kappa_p/\sqrt{\varepsilon}$
kappa_phys | \kappa_p | noise amplitude | unscaled
lam | \lambda | the large parameter $2/\kappa^2$ | scaled time per scaled length squared
r | | radius of escape | scaled: $r_p/\varepsilon$
r_phys | r_p | radius of escape | unscaled
phi | \phi | drift | velocity, the same scaled and unscaled
A | | drift inside the layer | velocity, the same scaled and unscaled
a_minus | a^- | drift for $u \le -1$ | velocity, the same scaled and unscaled
a_plus | a^+ | drift for $u \ge 1$ | velocity, the same scaled and unscaled
a | | constant drift | velocity, the same scaled and unscaled
A_1 | A'(u_1) | slope of the drift at the well $u_1$, negative | 1/scaled time
A_2 | A'(u_2) | slope of the drift at the barrier $u_2$, positive | 1/scaled time
A'_1 | A'(u_1) | slope of the drift at the well $u_1$ | 1/scaled time
A'_2 | A'(u_2) | slope of the drift at the barrier $u_2$ | 1/scaled time
A' | A'(u) | slope of the drift inside the layer | 1/scaled time
phi_0 | \phi(0) | drift at the start | velocity, the same scaled and unscaled
F | | friction force | unscaled
mu | | shape of the friction force | a number
alpha | | friction force at the layer's edges | unscaled
beta | | breakaway force | unscaled
z0 | z_0 | position on the surface: the spring's extension | unscaled
z_1 | | lower edge of the sliding region | unscaled
z_2 | | upper edge of the sliding region | unscaled
z_plus | z_0^{(+)} | fold of well and barrier on $u > 0$, $1 - \beta$ | unscaled
z_minus | z_0^{(-)} | fold of well and barrier on $u < 0$, $1 + \beta$ | unscaled
u_s | | turning point of the friction force | scaled: $y/\varepsilon$
g_s | | sliding velocity along the surface | unscaled
g^- | | velocity along the surface on its left | unscaled
g^+ | | velocity along the surface on its right | unscaled
V | | potential, $V' = -\phi$ and $V(-1) = 0$ | scaled position times velocity
V_1 | V(1) | potential at the layer's right edge | scaled position times velocity
V_top | V(1) | potential at the layer's right edge | scaled position times velocity
V_0 | V(0) | potential at the start | scaled position times velocity
V_u1 | V(u_1) | potential at the well $u_1$ | scaled position times velocity
V_u2 | V(u_2) | potential at the barrier $u_2$ | scaled position times velocity
V_m | V(u_m) | lowest value of the potential | scaled position times velocity
s_1 | | curvature of the potential at the well | 1/scaled time
s_2 | | curvature of the potential at the barrier, with the sign of $s_1$ | 1/scaled time
K_m | V''(u_m) | curvature of $V$ at its lowest point, $V'' = -A'$ | 1/scaled time
D | | height of the barrier, $V(u_2) - V(u_1)$ | scaled position times velocity
u1 | u_1 | the well, a zero of the drift | scaled: $y/\varepsilon$
u2 | u_2 | the barrier, a zero of the drift | scaled: $y/\varepsilon$
u3 | u_3 | the third zero of the cubic | scaled: $y/\varepsilon$
T | | mean escape time from $\lvert u\rvert < r$, from 0 unless stated | scaled: $t_p/\varepsilon$
T_phys | T_p | mean escape time from $\lvert y\rvert < r_p$ | unscaled
T_0 | | mean escape time without the terms of $C$ | scaled: $t_p/\varepsilon$
T_1 | | piece of $T_0$: $-r < u < -1$, $0 < v < 1$ | scaled: $t_p/\varepsilon$
T_2 | | piece of $T_0$: $-1 < u < v$, $0 < v < 1$ | scaled: $t_p/\varepsilon$
T_3 | | piece of $T_0$: $-r < u < 1$, $1 < v < r$ | scaled: $t_p/\varepsilon$
T_4 | | piece of $T_0$: $1 < u < v < r$ | scaled: $t_p/\varepsilon$
S | | Stokes multiplier of the well's term | a number
p | | density of the position at time $t$ | per scaled length
R | | density integrated over all time | scaled time per scaled length
C | | probability of leaving through $-r$ | a number
J | | flux of $R$ to the left | a number
kappa_c | \kappa_{c,p} | noise below which escape is exponentially slow | unscaled
kappa_e | | noise at which the well's term of $T$ is $r/a^+$ | scaled: $\kappa_p/\sqrt{\varepsilon}$
ell | \log(1/\varepsilon) | $-\log \varepsilon$ | a number
p_ss | p_{\mathrm{ss}} | stationary density | per scaled length
K | | normalizing constant of $p_{\mathrm{ss}}$, its value at $u = -1$ | per scaled length
N | | integral of $e^{-2V/\kappa^2}$ inside the layer | scaled length
M | | integral of $e^{-2V/\kappa^2}$ outside the layer | scaled length
P | | stationary probability of $\lvert u\rvert \le 1$ | a number
L | | length of an interval $(1 - L, 1)$ where $V \le V(1)$ | scaled: $y/\varepsilon$
I_left | | integral of $e^{-2V/\kappa^2}$ over $u < -1$ | scaled length
I_right | | integral of $e^{-2V/\kappa^2}$ over $u > 1$ | scaled length
q | | any density; a mode of the operator | per scaled length
sigma_left | | $\Sigma/s$ on the left of the start, $s = e^{\lambda V}$ | scaled length
sigma_right | | $\Sigma/s$ on the right of the start, $s = e^{\lambda V}$ | scaled length
I0 | | integral of $e^{\lambda V}$ over $(0, r)$ | scaled length
I1 | | integral of $e^{\lambda V}$ over $(-r, 0)$ | scaled length
J0 | | $\int_0^r e^{\lambda V(v)} \int_{-r}^v e^{-\lambda V}$ | scaled length squared
J1 | | $\int_{-r}^0 e^{\lambda V(v)} \int_{-r}^v e^{-\lambda V}$ | scaled length squared
\eta^- | | $y/e$ for $\mathcal{L} y = s y$ from $-r$, $e = e^{\lambda V}$ | scaled length
\eta^+ | | $y/e$ for $\mathcal{L} y = s y$ from $r$, $e = e^{\lambda V}$ | scaled length
\zeta^- | | $y'/e$ of $\eta^-$ | a number
\zeta^+ | | $-y'/e$ of $\eta^+$ | a number
W | | Wronskian of the two solutions, divided by $e$ | scaled length
\lambda_1 | | principal eigenvalue of the exit problem | 1/scaled time
\alpha | | point of a step where the noise is taken: Itô 0, Stratonovich 1/2 | a number
sigma | \sigma | factor of the noise amplitude, which depends on $u$ | a number
V_\sigma | | potential, $V_\sigma' = -\phi/\sigma^2$ | scaled position times velocity
D_\sigma | | height of the barrier, $V_\sigma(u_2) - V_\sigma(u_1)$ | scaled position times velocity
Sigma | | scale function, 0 at $-r$ | scaled length
m | | speed density, $\lambda/\Sigma'$ for constant noise | scaled time per scaled length squared
Heaviside | \mathbf{1} | $\mathbf{1}_{x > 0}$ is 1 for $x > 0$ and 0 for $x < 0$ | a number
K_left | K_l | integral of $e^{\lambda (V(v) - V(u))}$ over $-r < v < u < x$ | scaled length squared
K_right | K_r | integral of $e^{\lambda (V(v) - V(u))}$ over $x < u < v < r$ | scaled length squared
"""

#: Name -> meaning and unit, in TeX.
MEANINGS: dict[str, tuple[str, str]] = {}
for row in TABLE.strip().splitlines():
    name, shown, meaning, unit = (cell.strip() for cell in row.split("|"))
    MEANINGS[name] = meaning, unit
    if shown:
        NAMES[name] = shown

u, v, x = (Symbol(name, real=True) for name in "uvx")
t, r, T, C = (Symbol(name, positive=True) for name in "trTC")
kappa, kappa_physical = Symbol("kappa", positive=True), Symbol("kappa_phys", positive=True)
eps, t_physical = Symbol("epsilon", positive=True), Symbol("t_phys", positive=True)
r_physical = Symbol("r_phys", positive=True)
# Crossing to the right; sliding.
a_minus, a_plus = Symbol("a_minus", positive=True), Symbol("a_plus", positive=True)
a_plus_sliding = Symbol("a_plus", negative=True)
mu, alpha = Symbol("mu", positive=True), Symbol("alpha", positive=True)
z0, u1, u2, V_1 = (Symbol(name, real=True) for name in ("z0", "u1", "u2", "V_1"))
N = Symbol("N", positive=True)
phi, V, p = map(Function, ("phi", "V", "p"))
lam = 2 / kappa**2
