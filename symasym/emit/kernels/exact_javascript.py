"""The exact escape time (`symasym.emit.kernels.exact_python`) in JavaScript."""

from __future__ import annotations

from symasym.emit.kernels.exact_python import tables

_JAVASCRIPT = """// Radau's points in (0, 1], and their weights.
TABLES

const radau = (() => {
  const n = T.length;
  const rows = T.map((t) => {
    const p = [1, 2 * t - 1];
    for (let k = 1; k < n; k++) p.push(((2 * k + 1) * p[1] * p[k] - k * p[k - 1]) / (k + 1));
    return p;
  });
  // Integrals up to each point of the polynomial through values there, and its last terms.
  const within = rows.map((up) =>
    rows.map((p, j) => {
      let sum = up[1] + 1;
      for (let k = 1; k < n; k++) sum += p[k] * (up[k + 1] - up[k - 1]);
      return (weights[j] * sum) / 2;
    }),
  );
  const last = [n - 2, n - 1].map((k) => rows.map((p, j) => (2 * k + 1) * weights[j] * p[k]));
  return { within, last };
})();

/** A linear system by elimination; its right-hand side is the last column. */
function solve(rows, found) {
  const n = rows.length;
  for (let k = 0; k < n; k++) {
    let best = k;
    for (let i = k + 1; i < n; i++) if (Math.abs(rows[i][k]) > Math.abs(rows[best][k])) best = i;
    const top = rows[best];
    rows[best] = rows[k];
    rows[k] = top;
    for (let i = k + 1; i < n; i++) {
      const row = rows[i];
      const factor = row[k] / top[k];
      for (let j = k + 1; j <= n; j++) row[j] -= factor * top[j];
    }
  }
  for (let k = n - 1; k >= 0; k--) {
    let rest = rows[k][n];
    for (let j = k + 1; j < n; j++) rest -= rows[k][j] * found[j];
    found[k] = rest / rows[k][k];
  }
}

/** M' = 1 - lam |drift| M from a, M = 0, to b: M there, its integral; lam times the drift's. */
function relaxed(drift, rough, lam, a, b) {
  const n = T.length;
  const rows = T.map(() => new Float64Array(n + 1));
  const slopes = new Float64Array(n);
  const values = new Float64Array(n);
  let [end, area, drop, u, step, growth] = [0, 0, 0, a, b - a, 2];
  for (let trial = 0; trial < 100000; trial++) {
    const final = Math.abs(step) >= Math.abs(b - u) * (1 - 1e-12);
    if (final) step = b - u;
    const h = Math.abs(step);
    let least = Infinity;
    for (let j = 0; j < n; j++) {
      slopes[j] = lam * h * drift(u + T[j] * step);
      least = Math.min(least, Math.abs(slopes[j]));
    }
    for (let i = 0; i < n; i++) {
      for (let j = 0; j < n; j++) rows[i][j] = radau.within[i][j] * Math.abs(slopes[j]);
      rows[i][i] += 1;
      rows[i][n] = end + T[i] * h;
    }
    solve(rows, values);
    let [sum, slope, top, tail, beside] = [0, 0, 0, 0, 0];
    for (let j = 0; j < n; j++) {
      sum += weights[j] * values[j];
      slope += weights[j] * slopes[j];
      top = Math.max(top, Math.abs(values[j]));
      tail += radau.last[0][j] * values[j];
      beside += radau.last[1][j] * values[j];
    }
    // What the drift's rounding makes of M: no halving gets below it.
    const noise = (lam * h * rough) / (1 + least);
    const most = Math.max(1e-13, Math.min(noise, 1e-6)) * top;
    if (Math.max(Math.abs(tail), Math.abs(beside)) > most) {
      step /= 2;
      growth = 1;
      if (u + step === u) break;
      continue;
    }
    area += h * sum;
    drop += slope;
    end = values[n - 1];
    if (final) return [end, area, drop];
    u += step;
    step *= growth;
    growth = 2;
  }
  throw new RangeError(
    `lam = 2/kappa^2 is ${lam}, for which M changes beside u = ${u} over less than doubles tell ` +
      "apart; give a larger kappa, or emit the target mpmath",
  );
}

/**
 * log sigma and log w at the last of the points, from the end at the first, and their errors; the
 * most that both directions differ by in a drop of lam V, and in a double integral.
 */
function sweep(drift, ends, rough, lam, points) {
  let [sigma, w, looseSigma, loose] = [-Infinity, -Infinity, 0, 0];
  let [mostSlip, mostWrong] = [0, 0];
  const log = Math.log(lam);
  for (let k = 0; k + 1 < points.length; k++) {
    const [p, q] = [points[k], points[k + 1]];
    let ahead, back, area, drop, x;
    let [slip, wrong] = [0, 0];
    if (Math.max(Math.abs(p), Math.abs(q)) > 1) {
      const h = Math.abs(q - p);
      drop = lam * ends[p > 0 ? 1 : 0] * h;
      x = Math.abs(drop);
      ahead = back = h * exprel(-x);
      area = h * h * exprel2(-x);
    } else {
      let again, other;
      [ahead, area, drop] = relaxed(drift, rough, lam, p, q);
      [back, again, other] = relaxed(drift, rough, lam, q, p);
      x = Math.abs(drop);
      slip = Math.abs(drop - other);
      wrong = Math.abs(area / again - 1);
      mostSlip = Math.max(mostSlip, slip);
      mostWrong = Math.max(mostWrong, wrong);
    }
    back = Math.log(back);
    area = log + Math.log(area);
    if (drop > 0 === q > p) {
      // V falls.
      ahead = log + Math.log(ahead);
      const total = logaddexp(sigma, back);
      const part = Math.exp(area - x - total - ahead);
      const first = w - logaddexp(0, back - sigma) - x;
      w = logaddexp(first, ahead + Math.log1p(-part));
      const known = Math.exp(sigma - total) * looseSigma + wrong;
      loose = Math.exp(first - w) * (loose + looseSigma + slip) + 2 * part * known + wrong;
      sigma = total + x;
      looseSigma = known + slip;
    } else {
      // V rises.
      ahead = Math.log(ahead);
      const total = logaddexp(sigma - x, ahead);
      const kept = Math.exp(sigma - x - total);
      const first = logaddexp(w, log + back) - logaddexp(-x, ahead - sigma);
      w = logaddexp(first, area - total);
      loose = Math.exp(first - w) * (loose + kept * slip + (1 - kept) * looseSigma) + wrong;
      looseSigma = kept * (looseSigma + slip) + wrong;
      loose += looseSigma;
      sigma = total;
    }
  }
  return { sigma, w, looseSigma, loose, mostSlip, mostWrong };
}

/** log T from 0, where `drift` is that of the layer and `ends` are those beyond it. */
function logTime(drift, ends, rough, zeros, count, kappa, r) {
  if (!(kappa >= 1e-8 && kappa <= 1e8 && r >= 1e-100 && r <= 1e12)) {
    const told = `kappa is ${kappa}, r is ${r}`;
    throw new RangeError(`${told}; give kappa in 1e-8..1e8 and r in 1e-100..1e12`);
  }
  const size = rough / 4e-16;
  if (![...ends, size].every((x) => Math.abs(x) < 1e100)) {
    const told = `the drift is ${ends[0]} and ${ends[1]} at the layer's ends, ${size} in size`;
    throw new RangeError(`${told}; give parameters for which it is below 1e100`);
  }
  const lam = 2 / kappa ** 2;
  const known = [-1, 0, 1, ...zeros.slice(0, count)].filter((m) => Math.abs(m) < r);
  const marks = [...new Set(known.map((m) => m + 0))];
  marks.sort((a, b) => a - b);
  const before = marks.filter((m) => m <= 0);
  const behind = marks.filter((m) => m >= 0).reverse();
  const left = sweep(drift, ends, rough, lam, [-r, ...before]);
  const right = sweep(drift, ends, rough, lam, [r, ...behind]);
  const time = logaddexp(left.w, right.w);
  const rate = logaddexp(-left.sigma, -right.sigma);
  const found = time - rate;
  let loose = 0;
  for (const side of [left, right]) {
    loose += Math.exp(-side.sigma - rate) * side.looseSigma + Math.exp(side.w - time) * side.loose;
  }
  if (!(loose <= 1e-12 * Math.max(1, Math.abs(found)))) {
    const slip = Math.max(left.mostSlip, right.mostSlip);
    const wrong = Math.max(left.mostWrong, right.mostWrong);
    const moved = slip.toExponential(1);
    const why =
      slip > wrong
        ? `rounding moves the exponent 2 V/kappa^2 by ${moved}, so that kappa is too small`
        : `two computations of a double integral differ by ${wrong.toExponential(1)}`;
    throw new RangeError(
      `log T is ${found} with an error of ${loose.toExponential(1)}, and 1e-12 is allowed: ` +
        `${why} for doubles; give a larger kappa, or emit the target mpmath`,
    );
  }
  return found;
}
"""


def in_javascript() -> str:
    """The helper of the target "javascript"."""
    return _JAVASCRIPT.replace("TABLES", tables(("const T = [", "const weights = ["), "];", "  "))
