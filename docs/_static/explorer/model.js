// What the explorer shows, in numbers. Every formula is in `emitted`, which the page holds: it is
// written by symasym.emit when the site is built. Here they are only called and put together.
"use strict";

const REGIONS = ["repelling sliding", "crossing", "sliding"];
/** How far the layer is shown: |u| up to this. */
const REACH = 1.75;
/** Ends of the slider of z0. */
const SPRING = [-3, 5];
/** Ends of the slider of kappa, log10. */
const NOISE = [-2.5, -1];
/** The parameters of each drift, in the order of the emitted functions. */
const DRIFTS = {
  friction: ["mu", "alpha", "z0"],
  tanh: ["aminus", "aplus", "steepness"],
  hill: ["aminus", "aplus", "K"],
  sine: ["aminus", "aplus", "b"],
};
/** What log10 T may be drawn against: for friction z0, for the others a+, for each kappa. */
const AXES = { z0: SPRING, aplus: [-2, 2], kappa: NOISE };

function isFriction(s) {
  return (s.drift ?? "friction") === "friction";
}

/** A formula with the drift of `s` in it, as a function of u alone. */
function along(name, s) {
  const drift = s.drift ?? "friction";
  const values = DRIFTS[drift].map((one) => s[one]);
  const label = isFriction(s) ? `eq:${name}` : `${drift} eq:${name}`;
  return (u) => emitted[label][name](u, ...values);
}

/** The sign of what slider values make; these are multiples of 1/100, so less is rounding. */
function sign(x) {
  return Math.abs(x) < 1e-9 ? 0 : Math.sign(x);
}

/** a- and a+ of the friction drift, and the name of the region. */
function region(alpha, z0) {
  return regionOf(
    emitted["eq:phifric0"].friction_left(alpha, z0),
    emitted["eq:phifric0"].friction_right(alpha, z0),
  );
}

/** The name of the region, with its a- and a+. */
function regionOf(aMinus, aPlus) {
  if (sign(aMinus) === 0 || sign(aPlus) === 0) return { aMinus, aPlus, name: "tangency" };
  // The signs of a-, a+ in their order: --, -+, +-, ++.
  const place = 2 * (aMinus > 0) + (aPlus > 0);
  return { aMinus, aPlus, name: REGIONS[emitted["regions"].regions()[place]] };
}

/** Zeros of phi in (-1, 1), in order: a well where phi falls, a barrier where it rises. */
function criticalPoints(mu, alpha, z0) {
  const coefficients = emitted["eq:phifric0"].friction_coefficients(mu, alpha, z0);
  const zeros = [];
  emitted["eq:pss"].zeros(coefficients, coefficients.length, -1, 1, zeros);
  return zeros.map((u, k) => {
    const before = (u + (k ? zeros[k - 1] : -1)) / 2;
    const kind = emitted["eq:phi"].phi(before, mu, alpha, z0) > 0 ? "well" : "barrier";
    return { u, kind, V: emitted["eq:V"].V(u, mu, alpha, z0) };
  });
}

/** z0 at both folds; none where the drift has no turning point in the layer. */
function folds(mu, alpha) {
  if (!(sign(1 - emitted["turning-points"].friction_turning_point(mu)) > 0)) return null;
  return emitted["folds"].friction_folds(mu, alpha);
}

/** Side of the folds on which z0 is: 1 between them, 0 at one, -1 beyond; null without folds. */
function side(s, z0) {
  const ends = folds(s.mu, s.alpha);
  return ends && sign(Math.min(z0 - ends[0], ends[1] - z0));
}

/** The natural logarithm of the paper's T; null where it has none, or jumps. */
function logTime(s, z0) {
  if (region(s.alpha, z0).name !== "crossing" || side(s, z0) === 0) return null;
  return emitted["eq:Ttildesmall"].log_weak_noise_time(s.kappa, s.r, s.mu, s.alpha, z0);
}

/** The step multiplier of the well's term in the paper's T; null where no well can be born. */
function multiplier(s, z0) {
  const where = side(s, z0);
  if (region(s.alpha, z0).name !== "crossing" || where === null) return null;
  return (1 + where) / 2;
}

/** The smooth multiplier, from 0 to 1 through the fold; null where no well can be born. */
function smoothMultiplier(s, z0) {
  if (region(s.alpha, z0).name !== "crossing" || side(s, z0) === null) return null;
  return emitted["eq:S"].stokes_multiplier(s.kappa, s.mu, s.alpha, z0);
}

/** Slider values to scaled variables; the drift's parameters stay as they are. */
function scaled({ kappa, eps, r, ...drift }) {
  return {
    ...drift,
    kappa: emitted["eq:tildexykappa"].scaled_noise(kappa, eps),
    r: emitted["eq:tilder"].scaled_radius(r, eps),
    time: emitted["eq:TtildetoT"].TtildetoT(eps, 1),
  };
}

/** Scaled time in which the belt takes a block that sticks to the fold; null where none sticks. */
function wayToFold(s) {
  const ends = folds(s.mu, s.alpha);
  return ends && s.z0 > ends[0] && s.z0 < ends[1] ? (s.z0 - ends[0]) / s.time : null;
}

/** The numbers of one position of the sliders. */
function numbers(sliders) {
  const s = scaled(sliders);
  const { kappa, r, time } = s;
  if (!isFriction(s)) {
    const { aMinus, aPlus, name } = regionOf(s.aminus, s.aplus);
    const none = { folds: null, wayToFold: null, step: null, smooth: null };
    const unknown = { logTime: null, occupation: null, logOutside: null };
    const { logT, logError, logExit, share } = passage(s);
    const found = { logExact: logT, logOwnError: logError, logExit, share, points: zeros(s) };
    return { kappa, r, time, region: name, aMinus, aPlus, ...none, ...unknown, ...found };
  }
  const found = region(s.alpha, s.z0);
  const slides = found.name === "sliding";
  const logExact = logOf(s, "eq:Ttilde", "log_escape_time");
  return {
    kappa,
    r,
    time,
    region: found.name,
    aMinus: found.aMinus,
    aPlus: found.aPlus,
    points: criticalPoints(s.mu, s.alpha, s.z0),
    folds: folds(s.mu, s.alpha),
    wayToFold: wayToFold(s),
    step: multiplier(s, s.z0),
    smooth: smoothMultiplier(s, s.z0),
    logTime: logTime(s, s.z0),
    logExact,
    // The emitted exact time has log T to 1e-12 of it, or to 1e-12 where that is small.
    logOwnError: logExact === null ? null : Math.log(1e-12 * Math.max(1, Math.abs(logExact))),
    logExit: logOf(s, "eq:C", "log_exit_probability"),
    occupation: slides ? emitted["eq:P"].occupation(s.kappa, s.mu, s.alpha, s.z0) : null,
    logOutside: slides ? emitted["eq:P"].log_complement(s.kappa, s.mu, s.alpha, s.z0) : null,
  };
}

/** An emitted function of the friction drift; null where double precision does not tell it. */
function logOf(s, label, name) {
  try {
    return emitted[label][name](s.kappa, s.r, s.mu, s.alpha, s.z0);
  } catch (error) {
    if (!(error instanceof RangeError)) throw error;
    return null;
  }
}


/** Zeros of phi in (-1, 1) of any drift, as `criticalPoints` has them: by signs and bisection. */
function zeros(s) {
  const [phi, V] = [along("phi", s), along("V", s)];
  const u = even(-1, 1, 2001);
  const found = [];
  for (let k = 1; k < u.length; k++) {
    let [low, high] = [u[k - 1], u[k]];
    const rises = phi(high) > 0;
    // A zero at the layer's end is a tangency, and no well.
    const atEnd = [low, high].some((x) => Math.abs(x) === 1 && phi(x) === 0);
    if (atEnd || phi(low) > 0 === rises) continue;
    for (let turn = 0; turn < 60; turn++) {
      const middle = (low + high) / 2;
      if (phi(middle) > 0 === rises) high = middle;
      else low = middle;
    }
    // Bisection never moves a zero that is a place of the grid itself.
    const u0 = phi(low) === 0 ? low : high;
    found.push({ u: u0, kind: rises ? "barrier" : "well", V: V(u0) });
  }
  return found;
}

function logSum(x, y) {
  const high = Math.max(x, y);
  return high === -Infinity ? high : high + Math.log1p(Math.exp(-Math.abs(x - y)));
}

/**
 * Logarithms of (e^(ga) - 1)/g and of its integral over the way from 0 to a: of the stretches
 * outside the layer, where the drift is constant.
 */
function outside(g, a) {
  const x = g * a;
  if (Math.abs(x) < 1e-4) return [Math.log(a * (1 + x / 2)), Math.log((a * a) / 2 * (1 + x / 3))];
  if (x > 0) {
    const grown = x + Math.log1p(-Math.exp(-x)) - Math.log(g);
    return [grown, x - 2 * Math.log(g) + Math.log1p(-(1 + x) * Math.exp(-x))];
  }
  return [Math.log(Math.expm1(x) / g), Math.log((Math.expm1(x) - x) / (g * g))];
}

/**
 * log T, log C (C the chance of leaving through -r), and the share of time spent at u, of any drift.
 *
 * With sigma(u) the integral of e^(lam (V(v) - V(u))) between u and the end on its side of the
 * start, Green's function gives lam (C sigma) on the left and lam ((1 - C) sigma) on the right as
 * the time spent at u (positive-form, positive-density). In the layer by Simpson's rule on panels in
 * which lam V changes by a quarter at most, and again on panels twice as long: 15 times what both
 * differ by is left. Null where the noise is too weak for that.
 */
function passage(s, panels = null) {
  const lam = 2 / s.kappa ** 2;
  const [phi, V] = [along("phi", s), along("V", s)];
  if (panels === null) {
    const steepest = Math.max(...even(-1, 1, 401).map((u) => Math.abs(phi(u))));
    // A multiple of 8: Simpson's rule takes an even number of panels on each side, and of half as many.
    const count = 8 * Math.ceil(Math.max(50, lam * steepest));
    if (count > 200000) return { logT: null, logError: null, logExit: null, share: null };
    const [fine, rough] = [passage(s, count), passage(s, count / 2)];
    const apart = Math.abs(fine.logT - rough.logT) + 1e-12 * Math.max(1, Math.abs(fine.logT));
    return { ...fine, logError: Math.log(apart) };
  }
  const sides = [-1, 1].map((side) => sigmas(s, side, panels, lam, phi, V));
  const [left, right] = sides.map((one) => one.sigma[panels / 2]);
  // S(0, r)/S(-r, r) and its complement.
  const chances = [right - logSum(left, right), left - logSum(left, right)];
  const logT = Math.log(lam) + logSum(chances[0] + sides[0].whole, chances[1] + sides[1].whole);
  const share = [];
  const every = Math.max(1, panels / 400);
  for (const [at, side] of [-1, 1].entries()) {
    const { sigma, before } = sides[at];
    const density = (log) => Math.exp(Math.log(lam) + chances[at] + log - logT);
    const mine = even(-REACH, -1, 20).slice(0, -1).map((u) => [u * -side, density(before(-u - 1))]);
    for (let k = 0; k <= panels / 2; k += every) {
      const n = Math.round(k);
      mine.push([side * (1 - (2 * n) / panels), density(sigma[n])]);
    }
    share.push(...(side < 0 ? mine : mine.reverse()));
  }
  return { logT, logExit: chances[0], share };
}

/** log sigma from the end on one side to the start, and of its integral. */
function sigmas(s, side, panels, lam, phi, V) {
  const h = 2 / panels;
  // The drift away from the end, which makes sigma grow where it is positive.
  const g = lam * -side * phi(side * s.r);
  const [edge, whole] = outside(g, s.r - 1);
  const sigma = [edge];
  let height = lam * V(side);
  let [odd, even_] = [-Infinity, -Infinity];
  for (let k = 1; k <= panels / 2; k++) {
    const u = side * (1 - k * h);
    const [middle, next] = [lam * V(u + (side * h) / 2), lam * V(u)];
    const panel = (h / 6) * (Math.exp(height - next) + 4 * Math.exp(middle - next) + 1);
    sigma.push(logSum(sigma[k - 1] + height - next, Math.log(panel)));
    height = next;
    if (k % 2) odd = logSum(odd, sigma[k]);
    else if (k < panels / 2) even_ = logSum(even_, sigma[k]);
  }
  const ends = logSum(sigma[0], sigma[panels / 2]);
  const simpson = logSum(logSum(ends, odd + Math.log(4)), even_ + Math.log(2)) + Math.log(h / 3);
  return { sigma, whole: logSum(whole, simpson), before: (x) => outside(g, s.r - 1 - x)[0] };
}

function even(from, to, count) {
  return Array.from({ length: count }, (_, k) => from + ((to - from) * k) / (count - 1));
}

/** phi and V as lists of [u, value]. */
function landscape(sliders) {
  const u = even(-REACH, REACH, 211);
  const [phi, V] = [along("phi", sliders), along("V", sliders)];
  return { phi: u.map((x) => [x, phi(x)]), V: u.map((x) => [x, V(x)]) };
}

/** The stationary density as a list of [u, value], closer where a well is; null if none. */
function density(sliders) {
  const s = scaled(sliders);
  if (!isFriction(s) || region(s.alpha, s.z0).name !== "sliding") return null;
  const u = even(-REACH, REACH, 141);
  for (const point of criticalPoints(s.mu, s.alpha, s.z0)) {
    const slope = Math.abs(emitted["fr1"].friction_slope(point.u, s.mu, s.alpha));
    const width = s.kappa / Math.sqrt(2 * slope);
    if (point.kind === "well") u.push(...even(point.u - 5 * width, point.u + 5 * width, 61));
  }
  const within = u.filter((x) => Math.abs(x) <= REACH).sort((a, b) => a - b);
  const value = emitted["eq:pss"].stationary_density;
  return within.map((x) => [x, value(x, s.kappa, s.mu, s.alpha, s.z0)]);
}

/** z0 in stretches between the jumps of the paper's formula, where the drift crosses. */
function springs(s) {
  const ends = [1 - s.alpha, 1 + s.alpha, ...(folds(s.mu, s.alpha) ?? [])];
  const inside = ends.filter((x) => SPRING[0] < x && x < SPRING[1]);
  const marks = [SPRING[0], ...inside.sort((a, b) => a - b), SPRING[1]];
  const found = [];
  for (let k = 0; k + 1 < marks.length; k++) {
    // Not the ends: there the formula jumps, or has no value.
    const gap = (marks[k + 1] - marks[k]) * 1e-4;
    if (!(gap > 1e-7)) continue;
    const [from, to] = [marks[k] + gap, marks[k + 1] - gap];
    if (logTime(s, (from + to) / 2) === null) continue;
    // Closer towards the ends, where the formula has its logarithms.
    found.push(even(0, Math.PI, 61).map((t) => from + ((to - from) * (1 - Math.cos(t))) / 2));
  }
  return found;
}

/** log10 T by the paper's formula, and both multipliers, against the axis. */
function againstAxis(sliders, axis) {
  if (!isFriction(sliders)) return { time: [], step: [], smooth: [], belt: [] };
  if (axis !== "kappa") return againstSpring(sliders);
  const values = (of) => {
    const curve = places(sliders, axis, 61).map(([x, s]) => [x, of(s)]);
    return curve.some(([, y]) => y === null) ? [] : [curve];
  };
  const log10 = (log) => (log === null ? null : log / Math.LN10);
  const way = wayToFold(scaled(sliders));
  return {
    time: values((s) => log10(logTime(s, s.z0))),
    step: values((s) => multiplier(s, s.z0)),
    smooth: values((s) => smoothMultiplier(s, s.z0)),
    belt: way === null ? [] : [NOISE.map((x) => [x, Math.log10(way)])],
  };
}

/** Places of an axis, evenly: what stands on it, and the scaled variables there. */
function places(sliders, axis, count) {
  return even(...AXES[axis], count).map((x) => [
    x,
    scaled({ ...sliders, [axis]: axis === "kappa" ? 10 ** x : x }),
  ]);
}

/** log10 T by the paper's formula, and both multipliers, against z0. */
function againstSpring(sliders) {
  const s = scaled(sliders);
  const found = springs(s);
  const ends = folds(s.mu, s.alpha);
  const born = ends ? found : [];
  // Where a block sticks; its way to the fold as a time.
  const sticks = ends ? even(ends[0], Math.min(ends[1], SPRING[1]), 122).slice(1, -1) : [];
  return {
    time: found.map((curve) => curve.map((z) => [z, logTime(s, z) / Math.LN10])),
    step: born.map((curve) => curve.map((z) => [z, multiplier(s, z)])),
    smooth: born.map((curve) => curve.map((z) => [z, smoothMultiplier(s, z)])),
    belt: ends ? [sticks.map((z) => [z, Math.log10(wayToFold({ ...s, z0: z }))])] : [],
  };
}

/**
 * [x, log10 T, C], exact, against the axis: curves that grow by one point a step, so that the page
 * can draw between. Of friction against z0 at every third of the places of the formula: nothing jumps here.
 * Elsewhere at 41 places, and between them where a curve bends by more than a line's width.
 */
function* exactAgainstAxis(sliders, axis) {
  const spring = isFriction(sliders) && axis === "z0";
  const s = scaled(sliders);
  const stretches = spring
    ? springs(s).map((z) => z.filter((_, k) => k % 3 === 0).map((z0) => [z0, { ...s, z0 }]))
    : [places(sliders, axis, 41)];
  const curves = [];
  for (const stretch of stretches) {
    const curve = [];
    curves.push(curve);
    for (const [x, at] of stretch) {
      const point = exactPoint(x, at);
      if (point) curve.push(point);
      yield curves;
    }
    for (let turn = 0; turn < 6 && !spring; turn++) {
      for (const x of bends(curve)) {
        const value = axis === "kappa" ? 10 ** x : x;
        const point = exactPoint(x, scaled({ ...sliders, [axis]: value }));
        if (point) curve.push(point);
        yield curves;
      }
      curve.sort((a, b) => a[0] - b[0]);
    }
  }
  return curves;
}

/** [x, log10 T, C] at scaled variables, C null of friction; null where there is no T. */
function exactPoint(x, s) {
  const { logT, logExit } = isFriction(s)
    ? { logT: logOf(s, "eq:Ttilde", "log_escape_time"), logExit: null }
    : passage(s);
  return logT === null ? null : [x, logT / Math.LN10, logExit === null ? null : Math.exp(logExit)];
}

/**
 * Middles of the stretches on either side of a point that lies off the line through its neighbours by
 * more than 1/300 of its plot's height, in log10 T or in C.
 */
function bends(curve) {
  const middles = new Set();
  for (const at of [1, 2]) {
    const y = curve.map((point) => point[at]);
    const height = at === 2 ? 1 : Math.max(...y) - Math.min(...y);
    for (let k = 1; k + 1 < curve.length; k++) {
      const [a, b, c] = [k - 1, k, k + 1].map((n) => curve[n][0]);
      const line = y[k - 1] + ((y[k + 1] - y[k - 1]) * (b - a)) / (c - a);
      if (!(Math.abs(y[k] - line) > height / 300)) continue;
      middles.add((a + b) / 2).add((b + c) / 2);
    }
  }
  return middles;
}

/** C of the friction drift against the axis: what there is to see where no well can be born. */
function exitAgainstAxis(sliders, axis) {
  const exit = (s) => logOf(s, "eq:C", "exit_probability");
  return [places(sliders, axis, 161).map(([x, s]) => [x, exit(s)]).filter(([, y]) => y !== null)];
}
