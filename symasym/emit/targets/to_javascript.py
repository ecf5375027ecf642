"""JavaScript: an ES module without dependencies."""

from __future__ import annotations

from symasym.emit import uniform_time
from symasym.emit.kernels import airy_magnitude
from symasym.emit.kernels.exact_javascript import in_javascript
from symasym.emit.program import Body, Passage, Program, Ready, header, in_doubles
from symasym.emit.targets.writing import (
    Written,
    comment,
    heading,
    helpers,
    signature_doc,
    text,
    told,
    wrapped,
)

HELPERS: dict[str, Written] = {
    "logIntegral": '''// Gauss-Legendre, 16 points: those on the right, and their weights.
const X = [
  0.09501250983763744, 0.2816035507792589, 0.45801677765722737, 0.6178762444026438,
  0.755404408355003, 0.8656312023878318, 0.9445750230732326, 0.9894009349916499,
];
const W = [
  0.1894506104550685, 0.18260341504492358, 0.16915651939500254, 0.14959598881657674,
  0.12462897125553388, 0.09515851168249279, 0.062253523938647894, 0.027152459411754096,
];

/** Logarithm of the integral of e^g; g is monotone between the points. */
function logIntegral(g, points) {
  const top = Math.max(...points.map(g));
  // The exponent's own rounding: no halving gets below it.
  const noise = 4e-16 * Math.abs(top);
  const panel = (a, b) => {
    const m = (a + b) / 2;
    const h = (b - a) / 2;
    let sum = 0;
    for (let k = 0; k < 8; k++) {
      sum += W[k] * (Math.exp(g(m - h * X[k]) - top) + Math.exp(g(m + h * X[k]) - top));
    }
    return h * sum;
  };
  const total = (a, b, depth, before) => {
    const ga = g(a);
    const gb = g(b);
    const m = (a + b) / 2;
    if (Math.max(ga, gb) < top - 100) return 0;
    if (Math.abs(ga - gb) > 4 && depth < 100) {
      return total(a, m, depth + 1, before) + total(m, b, depth + 1, before);
    }
    const halves = panel(a, m) + panel(m, b);
    const error = Math.abs(halves - panel(a, b));
    // Where halving hardly helps, rounding is all there is.
    const rounding = error <= Math.max(1e-9, 1e3 * noise) * halves && error > before / 16;
    if (!(error > (4e-15 + noise) * halves) || rounding || depth > 100) return halves;
    return total(a, m, depth + 1, error) + total(m, b, depth + 1, error);
  };
  let sum = 0;
  for (let k = 0; k + 1 < points.length; k++) sum += total(points[k], points[k + 1], 0, Infinity);
  return top + Math.log(sum);
}
''',
    "zeros": '''/** Zeros in (-1, 1) of c[0] + c[1] u + ... where its sign changes. */
function zeros(c) {
  if (c.length < 2) return [];
  const value = (u) => c.reduceRight((sum, x) => sum * u + x, 0);
  const marks = [-1, ...zeros(c.map((x, k) => k * x).slice(1)), 1];
  const found = [];
  for (let k = 0; k + 1 < marks.length; k++) {
    let [a, b] = [marks[k], marks[k + 1]];
    const low = value(a) > 0;
    if (low === value(b) > 0) continue;
    for (let i = 0; i < 64; i++) {
      const m = (a + b) / 2;
      if (value(m) > 0 === low) a = m;
      else b = m;
    }
    found.push((a + b) / 2);
  }
  return found;
}
''',
    "logTime": in_javascript(),
    "logModulus": airy_magnitude.in_javascript,
    "logaddexp": '''function logaddexp(x, y) {
  const high = Math.max(x, y);
  return Math.abs(high) === Infinity ? high : high + Math.log1p(Math.exp(-Math.abs(x - y)));
}
''',
    "exprel": '''function exprel(x) {
  return x === 0 ? 1 : Math.expm1(x) / x;
}
''',
    "exprel2": '''function exprel2(x) {
  if (Math.abs(x) > 0.5) return (Math.expm1(x) - x) / x / x;
  let total = 0;
  for (let n = 15; n > 1; n--) total = (1 + x * total) / n;
  return total;
}
''',
    "tanhc": '''function tanhc(x) {
  return x === 0 ? 1 : Math.tanh(x) / x;
}
''',
    "sinc": '''function sinc(x) {
  return x === 0 ? 1 : Math.sin(x) / x;
}
''',
}  # fmt: skip


def render(program: Program, functions: list[Ready]) -> str:
    """The file."""
    code = "\n\n".join(_function(f) for f in functions)
    used = "\n".join(
        [*helpers(code, {**HELPERS, **uniform_time.helper("javascript", functions)}), ""]
    )
    return "\n".join(
        [*comment(header(program, in_doubles(functions)), "//"), "", f"{used}{code}", ""]
    )


def _function(function: Ready) -> str:
    names = ", ".join(function.arguments)
    lines = [
        f"/** {signature_doc(function)} */",
        *heading(f"export function {function.name}", list(function.arguments), " {"),
    ]
    if function.exp_of:
        call = f"return Math.exp({function.exp_of}"
        lines += wrapped(call, names, "  ", end=");", brackets="()", deeper="  ")
    if function.quadrature:
        lines += _integral(function)
    if function.passage:
        lines += _passage(function)
    for body in function.bodies:
        lines += _block(body)
    if function.bodies and function.bodies[-1].conditions:
        lines += _refusal(function)
    return "\n".join([*lines, "}"])


def _refusal(function: Ready) -> list[str]:
    values = told(function, "${NAME}")
    lines = ["throw new RangeError(", f"  `{values}` +", f'    "{function.outside}",', ");"]
    return ["  " + line for line in lines]


def _integral(function: Ready) -> list[str]:
    """The body of an integral: the points between which its exponent is monotone, its value."""
    q = function.quadrature
    assert q is not None
    inner = ", ".join(text(p, "javascript") for p in q.points)
    if q.coefficients:
        inner = f"...zeros([{', '.join(text(c, 'javascript') for c in q.coefficients)}])"
    marks = ", ".join(["-1", *([inner] if inner else []), "1"])
    if q.over_the_layer:
        lines = wrapped("const points = ", marks, "  ", end=";", brackets="[]", deeper="  ")
    else:
        low, high = text(q.lower, "javascript"), text(q.upper, "javascript")
        within = f"{low}, ...marks.filter((p) => {low} < p && p < {high}), {high}"
        lines = wrapped("const marks = ", marks, "  ", end=";", brackets="[]", deeper="  ")
        lines += wrapped("const points = ", within, "  ", end=";", brackets="[]", deeper="  ")
    value = f"(u) => {text(q.exponent, 'javascript')}, points"
    call = wrapped("return logIntegral", value, "  ", end=";", brackets="()", deeper="  ")
    return [*lines, *call]


def _passage(function: Ready) -> list[str]:
    """The body of an escape time: its drift, where that is zero, its value."""
    q = function.passage
    assert q is not None
    if q.uniform:
        return _uniform(function, q)
    zeros = f"[{', '.join(text(p, 'javascript') for p in q.points)}]"
    if q.coefficients:
        zeros = f"zeros([{', '.join(text(c, 'javascript') for c in q.coefficients)}])"
    ends = ", ".join(text(e, "javascript") for e in q.ends)
    lines = wrapped(
        "const drift = (u) => ", text(q.drift, "javascript"), "  ", end=";", deeper="  "
    )
    value = f"drift, [{ends}], {text(q.rough, 'javascript')}, {zeros}, kappa, r"
    call = wrapped("return logTime", value, "  ", end=";", brackets="()", deeper="  ")
    return [*lines, *call]


def _uniform(function: Ready, q: Passage) -> list[str]:
    """The body of the uniform time: the drift's coefficients, its value if there is one."""
    listed = ", ".join(text(c, "javascript") for c in q.coefficients)
    ends = ", ".join(f"[{', '.join(e)}], {len(e)}" for e in uniform_time.ends(q, "javascript"))
    value = f"c, {len(q.coefficients)}, {ends}, kappa, r"
    return [
        *wrapped("const c = ", listed, "  ", end=";", brackets="[]", deeper="  "),
        *wrapped("const found = logUniform", value, "  ", end=";", brackets="()", deeper="  "),
        "  if (Number.isNaN(found)) {",
        *("  " + line for line in _refusal(function)),
        "  }",
        "  return found;",
    ]


def _block(body: Body) -> list[str]:
    lines, indent = [], "  "
    if body.conditions:
        asked = " && ".join(text(c, "javascript") for c in body.conditions)
        asked = asked.replace("==", "===").replace("!=", "!==")
        lines += wrapped("if ", asked, indent, end=" {", brackets="()", deeper="  ")
        indent += "  "
    for symbol, value in body.shared:
        lines += wrapped(
            f"const {symbol} = ", text(value, "javascript"), indent, end=";", deeper="  "
        )
    values = ", ".join(text(v, "javascript") for v in body.values)
    brackets = "[]" if len(body.values) > 1 else ""
    lines += wrapped("return ", values, indent, end=";", brackets=brackets, deeper="  ")
    return [*lines, *(["  }"] if body.conditions else [])]
