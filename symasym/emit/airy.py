"""log(Ai^2 + Bi^2) in double precision: Chebyshev coefficients, and the helpers that sum them.

The modulus of the Airy functions is smooth and positive on the whole line. Beyond `FAR` what is
left of its leading asymptotic form, of which t = (FAR/|x|)^(3/2) is the variable, is a series too.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from functools import cache
from typing import Any

from symasym.context import own_context

#: Half-width of the range that is cut into `PANELS` panels of their own series.
FAR = 12
PANELS = 12
# Below this a coefficient adds nothing.
_SMALL = 1e-17
_TERMS = 36


@cache
def coefficients() -> tuple[tuple[float, ...], ...]:
    """Of the panels from -FAR to FAR, then of both asymptotic parts, at -x and at x."""
    with own_context(40) as context:
        return tuple(_series(f, context) for f in _pieces(context))


def _pieces(context: Any) -> list[Callable[[Any], Any]]:
    """What is smooth on each panel and in both asymptotic parts, on [-1, 1]."""

    def modulus(x: Any) -> Any:
        return context.airyai(x) ** 2 + context.airybi(x) ** 2

    def left(t: Any) -> Any:
        x = FAR * t ** (-context.mpf(2) / 3)
        return context.log(context.pi * context.sqrt(x) * modulus(-x))

    def right(t: Any) -> Any:
        x = FAR * t ** (-context.mpf(2) / 3)
        return context.log(context.pi * context.sqrt(x) * modulus(x)) - 4 * x**1.5 / 3

    width = context.mpf(2 * FAR) / PANELS
    middles = [-FAR + (k + context.mpf(1) / 2) * width for k in range(PANELS)]
    panels = [lambda s, m=m: context.log(modulus(m + s * width / 2)) for m in middles]
    return [*panels, *(lambda s, f=f: f((1 + s) / 2) for f in (left, right))]


def _series(f: Any, context: Any) -> tuple[float, ...]:
    """Chebyshev coefficients of f on [-1, 1], as many as doubles need."""
    n = _TERMS
    angles = [context.pi * (2 * k + 1) / (2 * n) for k in range(n)]
    values = [f(context.cos(a)) for a in angles]
    found = [
        2 * sum(v * context.cos(j * a) for v, a in zip(values, angles, strict=True)) / n
        for j in range(n)
    ]
    found[0] /= 2
    while len(found) > 1 and abs(found[-1]) < _SMALL:
        found.pop()
    if len(found) > n - 2:
        raise ArithmeticError("the Airy functions' modulus was not resolved")
    return tuple(map(float, found))


def _rows(indent: str, opening: str, closing: str) -> str:
    lines = []
    for row in coefficients():
        text = textwrap.wrap(", ".join(map(repr, row)), 96 - len(indent) - 4)
        lines += [indent + opening, *(f"{indent}    {line}" for line in text), indent + closing]
    return "\n".join(lines)


_PYTHON = '''\
# Chebyshev coefficients of log(Ai^2 + Bi^2): panels from -FAR to FAR, then asymptotic parts.
_MODULUS = (
ROWS
)


def _series(c, s):
    """The Chebyshev series at s in [-1, 1], by Clenshaw's rule."""
    one = two = 0.0
    for x in c[:0:-1]:
        one, two = 2 * s * one - two + x, one
    return s * one - two + c[0]


def _log_modulus(x):
    """log(Ai(x)^2 + Bi(x)^2)."""
    size = abs(x)
    if size < FAR:
        place = (x + FAR) * PANELS / (2 * FAR)
        k = int(place)
        return _series(_MODULUS[k], 2 * (place - k) - 1)
    t = (FAR / size) ** 1.5
    rest = _series(_MODULUS[PANELS + (x > 0)], 2 * t - 1) - math.log(math.pi * math.sqrt(size))
    return rest + 4 * x * math.sqrt(size) / 3 if x > 0 else rest
'''
_NUMPY = '''

def _log_modulus(x):
    """log(Ai(x)^2 + Bi(x)^2)."""
    x = np.asarray(x, dtype=np.float64)
    size, found = np.abs(x), np.empty(np.shape(x))
    place = (np.clip(x, -FAR, FAR) + FAR) * PANELS / (2 * FAR)
    panel = np.where(size < FAR, place.astype(int), PANELS + (x > 0))
    for k in np.unique(panel):
        here = panel == k
        if k < PANELS:
            found[here] = _series(_MODULUS[k], 2 * (place[here] - k) - 1)
            continue
        root = np.sqrt(size[here])
        rest = _series(_MODULUS[k], 2 * (np.sqrt(FAR) / root) ** 3 - 1) - np.log(np.pi * root)
        found[here] = rest + 4 * x[here] * root / 3 if k > PANELS else rest
    return found[()]
'''
_JAVASCRIPT = """\
// Chebyshev coefficients of log(Ai^2 + Bi^2): panels from -FAR to FAR, and asymptotic parts.
const modulus = [
ROWS
];

/** The Chebyshev series at s in [-1, 1], by Clenshaw's rule. */
function series(c, s) {
  let [one, two] = [0, 0];
  for (let k = c.length - 1; k > 0; k--) [one, two] = [2 * s * one - two + c[k], one];
  return s * one - two + c[0];
}

/** log(Ai(x)^2 + Bi(x)^2). */
function logModulus(x) {
  const size = Math.abs(x);
  if (size < FAR) {
    const place = ((x + FAR) * PANELS) / (2 * FAR);
    const k = Math.floor(place);
    return series(modulus[k], 2 * (place - k) - 1);
  }
  const root = Math.sqrt(size);
  const t = (FAR / size) ** 1.5;
  const rest = series(modulus[x > 0 ? PANELS + 1 : PANELS], 2 * t - 1) - Math.log(Math.PI * root);
  return x > 0 ? rest + (4 * x * root) / 3 : rest;
}
"""
_C = """/* Chebyshev coefficients of log(Ai^2 + Bi^2): panels from -FAR to FAR, then both asymptotic
   parts; the number of coefficients first. */
static const double modulus_[ALL][LONGEST] = {
ROWS
};

/* The Chebyshev series at s in [-1, 1], by Clenshaw's rule. */
static double series_(const double *c, double s)
{
    double one = 0.0, two = 0.0;
    int k;
    for (k = (int)c[0]; k > 1; k--) {
        const double next = 2.0 * s * one - two + c[k];
        two = one;
        one = next;
    }
    return s * one - two + c[1];
}

/* log(Ai(x)^2 + Bi(x)^2). */
static double log_modulus_(double x)
{
    const double size = fabs(x), root = sqrt(size), pi = 3.141592653589793;
    double rest;
    if (size < FAR.0) {
        const double place = (x + FAR.0) * PANELS.0 / (2.0 * FAR.0);
        const int k = (int)place;
        return series_(modulus_[k], 2.0 * (place - k) - 1.0);
    }
    if (!(size >= FAR.0))
        return NAN;
    rest = series_(modulus_[PANELS + (x > 0.0)], 2.0 * pow(FAR.0 / size, 1.5) - 1.0)
        - log(pi * root);
    return x > 0.0 ? rest + 4.0 * x * root / 3.0 : rest;
}
"""


def _numbered(text: str) -> str:
    return text.replace("FAR", str(FAR)).replace("PANELS", str(PANELS))


def in_python() -> str:
    """The helper of the target "python"."""
    return _numbered(_PYTHON).replace("ROWS", _rows("    ", "(", "),"))


def in_numpy() -> str:
    """The helper of the target "numpy"."""
    return in_python()[: in_python().index("\n\ndef _log_modulus")] + _numbered(_NUMPY)


def in_javascript() -> str:
    """The helper of the target "javascript"."""
    return _numbered(_JAVASCRIPT).replace("ROWS", _rows("  ", "[", "],"))


def in_c() -> str:
    """The helper of the target "c"."""
    every = coefficients()
    rows = []
    for row in every:
        text = textwrap.wrap(", ".join([f"{len(row)}.0", *map(repr, row)]), 88)
        rows += ["    {", *(f"        {line}" for line in text), "    },"]
    rows[-1] = "    }"
    sizes = _numbered(_C).replace("ALL", str(len(every)))
    sizes = sizes.replace("LONGEST", str(1 + max(map(len, every))))
    return sizes.replace("ROWS", "\n".join(rows))
