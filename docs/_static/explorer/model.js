// What the explorer shows, in numbers. Every formula is in `emitted`, which the page holds: it is
// written by symasym.emit when the site is built. Here they are only called and put together.
"use strict";

const REGIONS = ["repelling sliding", "crossing", "sliding"];
/** How far the layer is shown: |u| up to this. */
const REACH = 1.75;
/** Ends of the slider of z0. */
const SPRING = [-3, 5];

/** The sign of what slider values make; these are multiples of 1/100, so less is rounding. */
function sign(x) {
  return Math.abs(x) < 1e-9 ? 0 : Math.sign(x);
}

/** Signs of a- and a+, and the name of the region. */
function region(alpha, z0) {
  const aMinus = emitted["eq:phifric0"].friction_left(alpha, z0);
  const aPlus = emitted["eq:phifric0"].friction_right(alpha, z0);
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

/** The natural logarithm of T, exact; null where double precision does not tell it. */
function logExact(s, z0) {
  try {
    return emitted["eq:Ttilde"].log_escape_time(s.kappa, s.r, s.mu, s.alpha, z0);
  } catch (error) {
    if (!(error instanceof RangeError)) throw error;
    return null;
  }
}

/** The natural logarithm of T by the uniform formula of order 0; null where it has no value. */
function logUniform(s, z0) {
  if (region(s.alpha, z0).name === "tangency") return null;
  try {
    return emitted["eq:Ttilde uniform"].log_uniform_time(s.kappa, s.r, s.mu, s.alpha, z0);
  } catch (error) {
    if (!(error instanceof RangeError)) throw error;
    return null;
  }
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

/** Slider values to scaled variables. */
function scaled({ mu, alpha, z0, kappa, eps, r }) {
  return {
    mu,
    alpha,
    z0,
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
  const found = region(s.alpha, s.z0);
  const slides = found.name === "sliding";
  return {
    kappa: s.kappa,
    r: s.r,
    time: s.time,
    region: found.name,
    aMinus: found.aMinus,
    aPlus: found.aPlus,
    points: criticalPoints(s.mu, s.alpha, s.z0),
    folds: folds(s.mu, s.alpha),
    wayToFold: wayToFold(s),
    step: multiplier(s, s.z0),
    smooth: smoothMultiplier(s, s.z0),
    logTime: logTime(s, s.z0),
    logExact: logExact(s, s.z0),
    logUniform: logUniform(s, s.z0),
    occupation: slides ? emitted["eq:P"].occupation(s.kappa, s.mu, s.alpha, s.z0) : null,
    logOutside: slides ? emitted["eq:P"].log_complement(s.kappa, s.mu, s.alpha, s.z0) : null,
  };
}

function even(from, to, count) {
  return Array.from({ length: count }, (_, k) => from + ((to - from) * k) / (count - 1));
}

/** phi and V as lists of [u, value]. */
function landscape(sliders) {
  const { mu, alpha, z0 } = sliders;
  const u = even(-REACH, REACH, 211);
  return {
    phi: u.map((x) => [x, emitted["eq:phi"].phi(x, mu, alpha, z0)]),
    V: u.map((x) => [x, emitted["eq:V"].V(x, mu, alpha, z0)]),
  };
}

/** The stationary density as a list of [u, value], closer where a well is; null if none. */
function density(sliders) {
  const s = scaled(sliders);
  if (region(s.alpha, s.z0).name !== "sliding") return null;
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

/** log10 T by the uniform formula, against z0: it goes on through the folds, to the tangencies. */
function uniformAgainstSpring(s, found) {
  const ends = folds(s.mu, s.alpha) ?? [];
  const all = [...found.flat(), ...ends].sort((a, b) => a - b);
  const curves = [[], []];
  for (const [k, z] of all.entries()) {
    // Every other place of the paper's formula will do, and each fold: nothing jumps here.
    if (k % 2 && !ends.includes(z)) continue;
    if (region(s.alpha, z).name !== "crossing") continue;
    const log = logUniform(s, z);
    if (log !== null) curves[z < 1 ? 0 : 1].push([z, log / Math.LN10]);
  }
  return curves.filter((curve) => curve.length > 1);
}

/** log10 T by the paper's formula and the uniform one, and both multipliers, against z0. */
function againstSpring(sliders) {
  const s = scaled(sliders);
  const found = springs(s);
  const born = folds(s.mu, s.alpha) ? found : [];
  return {
    time: found.map((curve) => curve.map((z) => [z, logTime(s, z) / Math.LN10])),
    uniform: uniformAgainstSpring(s, found),
    step: born.map((curve) => curve.map((z) => [z, multiplier(s, z)])),
    smooth: born.map((curve) => curve.map((z) => [z, smoothMultiplier(s, z)])),
  };
}

/**
 * log10 T, exact, against z0: curves that grow by one point a step, so that the page can draw between.
 * Every third of the places of the formula will do: nothing jumps here.
 */
function* exactAgainstSpring(sliders) {
  const s = scaled(sliders);
  const curves = [];
  for (const places of springs(s)) {
    const curve = [];
    curves.push(curve);
    for (let k = 0; k < places.length; k += 3) {
      const log = logExact(s, places[k]);
      if (log !== null) curve.push([places[k], log / Math.LN10]);
      yield curves;
    }
  }
  return curves;
}
