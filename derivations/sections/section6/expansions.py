"""Section 6, weak noise: integration by parts, repeated as in `symasym.series`."""

from sympy import Derivative, Function, Symbol, exp, symbols

from derivations.paper import V, phi, u
from symasym.derivation.derivation import derives

h, g, psi = Function("h"), Function("g"), Function(r"\psi")
lam, t = symbols("lam t", positive=True)
k = Symbol("k", integer=True, positive=True)
sigma, sign_k, left, right = symbols(r"\sigma s_k h_k^- h_k^+", real=True)
kernel = exp(sigma * lam * V(u))


@derives("endpoint-series", "Contributions of a start, a kink or an end, and the slow manifold")
def endpoint_series(d):
    d.suppose(r"on each side of the point that is integrated over, $\phi$ is smooth and not 0")
    d.suppose("the series are formal: they leave out the contributions of other points, which may be "
              "exponentially smaller or larger")
    primitive = -sigma * kernel * h(u) / lam
    parts = d.eq("by parts", Derivative(primitive, u), kernel * (phi(u) * h(u) - sigma * h(u).diff(u) / lam),
                 r"with $\sigma = \pm 1$ and $V' = -\phi$",
                 by=primitive.diff(u).subs(V(u).diff(u), -phi(u)).expand().subs(sigma**2, 1))
    weight = (parts / kernel).expand()
    first = d.eq("first term", Symbol("h_1"), 1 / phi(u), "this is the case of the weight 1",
                 lambda e: [(weight.coeff(lam, 0).subs(h(u), e), 1)])
    manifold = lambda m: m.diff(u) - 1 + lam * phi(u) * m
    following = d.eq("next term", Symbol("h_{k+1}"), -h(u).diff(u) / phi(u), "the remaining integral has the "
                     r"next weight; the sum $M = h_1/\lambda + h_2/\lambda^2 + \dots$ solves "
                     r"$M' = 1 - \lambda\phi M$",
                     lambda e: [(weight.subs(sigma, -1), phi(u) * (h(u) - e / lam)), (manifold(first / lam + (
                         second := e.subs(h(u), first).doit()) / lam**2), second.diff(u) / lam**2)])
    at_zero = following.subs(phi(u), u * psi(u)).subs(h(u), u**(1 - 2 * k) * g(u)).doit()
    d.eq("beside a simple zero of phi", r"t^{2k + 1} h_{k+1} =", ((2 * k - 1) * g(t) - t * g(t).diff(t)) / psi(t),
         r"if $h_k = t^{1 - 2k} g(t)$ and $\phi = t \, \psi(t)$, the next function has a pole of order $2k + 1$",
         by=at_zero.subs(u, t).doit() * t**(2 * k + 1))
    share = (primitive / kernel / h(u) * lam) * (-sigma)**(k - 1) * (left - right)
    for name, sign, value in (("scale integral", 1, sign_k * (left - right)),
                              ("speed integral", -1, left - right)):
        d.eq(name, f"E_k^{'+' if sign > 0 else '-'} =", value, "it is the primitive at the end of one side "
             r"minus that at the start of the other, for the weight $(-\sigma)^{k-1} \phi h_k/\lambda^{k-1}$",
             lambda e, sign=sign: [(share.subs(sigma, sign), e.subs(sign_k, (-1)**k))])
    d.conclude("scale integral", "speed integral", "beside a simple zero of phi",
               note=r"the formulas give the coefficients of $\lambda^{-k}$ in the integrals of $e^{\lambda V}$ "
                    r"and $e^{-\lambda V}$ about a point, in units of $e^{\pm\lambda V}$ at this point; "
                    r"$h_1 = 1/\phi$, $h_{k+1} = -h_k'/\phi$ and $s_k = (-1)^k$; $h_k^\pm$ are their values on "
                    "the left and the right of the point, and 0 on a side without an integral",
               error="a formal series")
