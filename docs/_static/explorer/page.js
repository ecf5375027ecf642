// The sliders, the numbers in words, and when to draw.
"use strict";

const explorer = document.getElementById("oscillator");
const form = explorer.querySelector("form");
const LAYER = [-1, 1];
const NONE = "–";

/** Preferred numbers: a decade in twenty steps (R''20). */
const DECADE = [
  1, 1.1, 1.2, 1.4, 1.6, 1.8, 2, 2.2, 2.5, 2.8, 3, 3.5, 4, 4.5, 5, 5.5, 6, 7, 8, 9,
];

/** Of a slider and the field beside it. */
const RANGES = [...form.querySelectorAll('input[type="range"]')];
const fieldOf = (range) => range.parentElement.querySelector('input[type="text"]');
const isDecades = (range) => range.hasAttribute("data-decades");

/** What is computed with, as text: the value of a slider, or a number that was typed. */
const shown = {};

/** The value that a position of a slider stands for, or the preferred number that it counts to. */
function atPosition(range, position) {
  if (!isDecades(range)) return Number(position);
  const power = Math.floor(position / DECADE.length);
  return Number(`${DECADE[position - DECADE.length * power]}e${power}`);
}

/** A value as the field shows it. */
function fieldText(range, value) {
  const even = !isDecades(range) && Math.abs(100 * value - Math.round(100 * value)) < 1e-9;
  return even ? value.toFixed(2) : String(value);
}

/** Take a value, and put the slider to the nearest that it has; false beyond the slider's ends. */
function take(range, value) {
  const ends = [range.min, range.max].map((end) => atPosition(range, Number(end)));
  if (!(ends[0] <= value && value <= ends[1])) return false;
  shown[range.name] = fieldText(range, value);
  if (!isDecades(range)) {
    range.value = value;
    return true;
  }
  const power = Math.floor(Math.log10(value) + 1e-9);
  const off = DECADE.map((one) => Math.abs(one - value / 10 ** power));
  range.value = DECADE.length * power + off.indexOf(Math.min(...off));
  return true;
}

/** The number that a text says, such as −0.4 or −7/9; NaN if it says none. */
function numberOf(text) {
  const parts = text.replaceAll("−", "-").split("/");
  const values = parts.map((part) => (part.trim() === "" ? NaN : Number(part)));
  return parts.length > 2 ? NaN : values[0] / (values[1] ?? 1);
}

/** What was typed, or stands in the address, and no slider reaches. */
let refused = [];

/** Take a number as text, or say which ones there are. */
function read(range, name, text) {
  const taken = take(range, numberOf(text));
  const ends = [range.min, range.max].map((end) => atPosition(range, Number(end)));
  if (!taken) refused.push(`${name} = ${text} (from ${ends[0]} to ${ends[1]})`.replaceAll("-", "−"));
  return taken;
}

/** A number that was typed. */
function typed(range) {
  const field = fieldOf(range);
  const taken = read(range, range.labels[0].textContent, field.value.trim());
  field.setCustomValidity(taken ? "" : "See the sentence below.");
  field.setAttribute("aria-invalid", String(!taken));
}

/** The address names physical numbers as the page does. */
const PHYSICAL = { kappa: "kappa_p", r: "r_p" };
const addressOf = (name) => PHYSICAL[name] ?? name;

/** The address (#mu=2&kappa_p=0.05) of what is shown is taken over; what it lacks stays. */
function fromAddress() {
  const given = new URLSearchParams(location.hash.slice(1));
  refused = [];
  for (const name of ["drift", "axis"]) {
    const list = form.elements[name];
    if ([...list.options].some((one) => one.value === given.get(name))) list.value = given.get(name);
  }
  for (const range of RANGES) {
    const name = addressOf(range.name);
    const text = given.get(name);
    if (name !== range.name && given.has(range.name)) {
      refused.push(`${range.name} = ${given.get(range.name)} (write ${name}, which is physical)`);
    }
    if (text !== null && text.trim() !== "") read(range, name, text.trim());
  }
}

/** The address of what is shown. */
function toAddress() {
  const values = Object.entries(sliderValues()).map(([name, value]) => [addressOf(name), value]);
  const address = new URLSearchParams([...values, ["axis", form.elements.axis.value]]);
  history.replaceState(null, "", `#${address}`);
}

/** The drift and the values that the fields show: what is computed with is what is read. */
function sliderValues() {
  const drift = form.elements.drift.value;
  const found = { drift };
  form.elements.axis.options[0].textContent = drift === "friction" ? "z₀" : "a⁺";
  for (const range of RANGES) {
    const place = range.parentElement;
    place.hidden = place.dataset.for !== undefined && !place.dataset.for.split(" ").includes(drift);
    const text = shown[range.name];
    const field = fieldOf(range);
    if (document.activeElement !== field) field.value = text.replace("-", "−");
    range.setAttribute("aria-valuetext", text);
    if (!place.hidden) found[range.name] = Number(text);
  }
  return found;
}

/** What the lower plots are drawn against: z0, aplus or kappa. */
function axisOf(sliders) {
  if (form.elements.axis.value === "kappa") return "kappa";
  return sliders.drift === "friction" ? "z0" : "aplus";
}

function short(x, count = 4) {
  if (x === null) return NONE;
  return Number(x.toPrecision(count)).toString().replace("-", "−");
}

/** e^log to so many digits, whatever its size, as HTML. */
function fromLog(log, digits = 4) {
  if (log === null) return NONE;
  const log10 = log / Math.LN10;
  if (log10 > -3 && log10 < 5) return short(Math.exp(log), digits);
  let power = Math.floor(log10);
  let mantissa = (10 ** (log10 - power)).toFixed(digits - 1);
  if (mantissa.startsWith("10")) [mantissa, power] = [(1).toFixed(digits - 1), power + 1];
  return `${mantissa} × 10<sup>${String(power).replace("-", "−")}</sup>`;
}

/** A number that is not negative, as HTML. */
const sized = (x) => (x ? fromLog(Math.log(x)) : short(x));

const REGION = {
  crossing: (n) => `Crossing, to the ${n.aPlus > 0 ? "right" : "left"}.`,
  sliding: () => "Sliding: both sides drive into the layer, and there is a steady state.",
  "repelling sliding": () => "Repelling sliding: both sides drive out of the layer.",
  tangency: () => "A tangency: one side’s drift is 0, which belongs to no region.",
};

/** The region and what the layer holds, in words. */
function inWords(n) {
  const wells = n.points.map((p) => `a ${p.kind} at u = ${short(p.u)}`);
  const layer = wells.length ? `In the layer: ${wells.join(", ")}.` : "No well in the layer.";
  return `${REGION[n.region](n)} ${layer}`;
}

/** How much of λD, the height of the barrier, changes while T passes: D changes with z as u₂ − u₁. */
function changed(n) {
  if (n.wayToFold === null || n.logExact === null || n.points.length !== 2) return NONE;
  const rate = (2 / n.kappa ** 2) * n.time * Math.abs(n.points[1].u - n.points[0].u);
  const log = Math.log(rate) + n.logExact;
  return fromLog(log, 2) + (log > Math.log(0.1) ? " — T and C are not the block’s" : "");
}

/** Relative error of a formula, both logarithms given. */
function relative(log, exact) {
  if (log === null || exact === null) return NONE;
  const ratio = log - exact;
  if (ratio === 0) return "0";
  // Beyond e^30 the 1 that is taken off has no digit.
  return fromLog(ratio > 30 ? ratio : Math.log(Math.abs(Math.expm1(ratio))));
}

function rows(n, frozen) {
  const height = n.points.length === 2 ? Math.abs(n.points[1].V - n.points[0].V) : null;
  const physical = n.logExact === null ? null : n.logExact + Math.log(n.time);
  return {
    "κ, scaled: κₚ/√ε": short(n.kappa),
    "r, scaled: rₚ/ε": short(n.r),
    // Sums of multiples of 1/100, without their rounding.
    "a⁻, a⁺": [n.aMinus, n.aPlus].map((a) => short(Number(a.toFixed(9)))).join(", "),
    "folds z₀⁽⁺⁾, z₀⁽⁻⁾": n.folds ? n.folds.map((z) => short(z)).join(", ") : NONE,
    // A difference of potentials of size 1.
    "height of the barrier": height < 1e-10 && height !== null ? "below 10<sup>−10</sup>" : short(height),
    "Stokes multiplier, and as a step": `${sized(n.smooth)}, ${short(n.step)}`,
    [`T, scaled${frozen}`]: fromLog(n.logExact),
    "relative error of T itself, at most about": fromLog(n.logOwnError, 2),
    "time for the belt to carry z to the fold z₀⁽⁺⁾": sized(n.wayToFold),
    "change of λD while T passes, ελ|∂D/∂z₀|T": changed(n),
    "Tₚ = ε T, physical": fromLog(physical),
    "T, scaled, by the paper’s formula": fromLog(n.logTime),
    "relative error of the paper’s formula": relative(n.logTime, n.logExact),
    "C, chance of leaving through −r": fromLog(n.logExit),
    "P, share of time in the layer": n.occupation?.toPrecision(4) ?? NONE,
    "1 − P": fromLog(n.logOutside),
  };
}

const AXIS_NAMES = { z0: "z₀", aplus: "a⁺", kappa: "log₁₀ κₚ" };

/** The axis of the lower plots, with the folds and what is shown now. */
function axisPlot(sliders, n) {
  const axis = axisOf(sliders);
  const here = axis === "kappa" ? Math.log10(sliders.kappa) : sliders[axis];
  const lines = axis === "z0" ? n.folds ?? [] : [];
  return { x: AXES[axis], xlabel: AXIS_NAMES[axis], lines, here };
}

/** log10 T: the formulas, and of the exact curve what there is by now. */
function timePlot(sliders, n, { time: paper, belt }, exact) {
  const solid = exact.filter((curve) => curve.length > 1);
  const axis = axisPlot(sliders, n);
  const crosses = n.region === "crossing" || axisOf(sliders) !== "z0";
  const now = n.logExact === null ? [] : [[axis.here, n.logExact / Math.LN10, "dot"]];
  // Where the drift slides T may be far above all that is drawn.
  const all = [...paper, ...solid, ...(crosses ? now.map((point) => [point]) : [])];
  // Against kappa T soon is beyond all numbers.
  const most = axisOf(sliders) === "kappa" ? Math.max(16, 1.5 * (now[0]?.[1] ?? 0)) : Infinity;
  const low = all.map((curve) => curve.filter(([, v]) => v <= most));
  const y = low.flat().length ? heights(low) : [0, 1];
  const inside = (curves) =>
    curves.map((curve) => curve.filter(([, v]) => y[0] <= v && v <= y[1])).filter((c) => c.length > 1);
  const others = n.folds === null && !paper.length
    ? ""
    : ", the paper’s formula (dashed)";
  const here = now.length && now[0][1] > y[1]
    ? `; here (arrow), above the frame, it is ${(n.logExact / Math.LN10).toFixed(1)}`
    : "";
  const grey = belt.length
    ? "; grey: the time in which the belt carries z to the fold; where T lies above it, the block is released earlier"
    : "";
  return {
    ...axis,
    curves: inside(solid),
    dashed: inside(paper),
    belt: inside(belt),
    y,
    points: now.filter(([, v]) => v >= y[0]),
    ylabel: "log₁₀ T",
    caption: `log₁₀ T against ${axis.xlabel}: exact (solid${axis.xlabel === "z₀" ? ", not drawn where the drift slides" : ""})${others}${here}${grey}`,
  };
}

/** The steady state, or, where there is none, where the time before escape is spent. */
function densityPlot(sliders, n, u) {
  const p = density(sliders);
  if (p) {
    return { ...u, ylabel: "p", curves: [p], y: heights([p], [0]), caption: "Stationary density p(u)" };
  }
  const share = n.share === undefined ? passage(scaled(sliders)).share : n.share;
  const none = n.region === "sliding" ? "D" : "No steady state here: d";
  const caption = `${none}ensity of the time spent at u before escape`;
  if (share === null) return { none: "the noise is too weak for the page’s quadrature", caption };
  return { ...u, ylabel: "density", curves: [share], y: heights([share], [0]), caption };
}

/** The multipliers, or, where no well can be born, the chance of leaving through -r. */
function multiplierPlot(sliders, n, { step, smooth }, exact) {
  const axis = axisPlot(sliders, n);
  const y = [-0.1, 1.1];
  if (smooth.length) {
    const points = n.smooth === null ? [] : [[axis.here, n.smooth, "dot"]];
    const caption = `Stokes multiplier against ${axis.xlabel}: smooth (solid), the paper’s step (dashed)`;
    return { ...axis, ylabel: "S", curves: smooth, dashed: step, y, points, caption };
  }
  const points = n.logExit === null ? [] : [[axis.here, Math.exp(n.logExit), "dot"]];
  const caption = `C, the chance of leaving through −r, against ${axis.xlabel}`;
  const curves = isFriction(sliders)
    ? exitAgainstAxis(sliders, axisOf(sliders))
    : exact.map((curve) => curve.map(([x, , exit]) => [x, exit]));
  const drawn = curves.filter((one) => one.length > 1);
  return { ...axis, ylabel: "C", curves: drawn, y, points, caption };
}

/** The plots of one position of the sliders: name -> what `drawn` takes, or why there is none. */
function plots(sliders, n, against) {
  const { phi, V } = landscape(sliders);
  const u = { x: [-REACH, REACH], xlabel: "u", layer: LAYER };
  const within = n.points.map((point) => [point.u, point.V, point.kind]);
  const zeros = n.points.map((point) => [point.u, 0, point.kind]);
  return {
    V: { ...u, ylabel: "V", curves: [V], y: heights([V]), points: within },
    phi: { ...u, ylabel: "ϕ", curves: [phi], y: heights([phi], [0]), zero: true, points: zeros },
    density: densityPlot(sliders, n, u),
    time: timePlot(sliders, n, against, []),
    step: multiplierPlot(sliders, n, against, []),
  };
}

function show(figure, plot) {
  let svg = figure.querySelector("svg");
  if (!svg) {
    svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    svg.setAttribute("role", "img");
    figure.prepend(svg);
  }
  const place = figure.querySelector("figcaption");
  if (plot.caption) place.textContent = plot.caption;
  const { width, height } = svg.getBoundingClientRect();
  svg.setAttribute("aria-label", place.textContent + (plot.none ? `: ${plot.none}` : ""));
  svg.innerHTML = plot.none
    ? `<text text-anchor="middle" x="${width / 2}" y="${height / 2}">${plot.none}</text>`
    : drawn(plot, width, height);
}

function update() {
  const sliders = sliderValues();
  const n = numbers(sliders);
  const left = refused.length ? ` Not taken: ${refused.join(", ")}.` : "";
  explorer.querySelector("#explorer-region").textContent = inWords(n) + left;
  // Of the other drifts there is no paper's formula, and no fold.
  const frozen = isFriction(sliders) ? ", z frozen" : "";
  const items = Object.entries(rows(n, frozen)).filter(
    ([, value]) => isFriction(sliders) || ![NONE, `${NONE}, ${NONE}`].includes(value),
  );
  explorer.querySelector("dl").innerHTML = items
    .map(([name, value]) => `<div><dt>${name}</dt><dd>${value}</dd></div>`)
    .join("");
  const against = againstAxis(sliders, axisOf(sliders));
  const made = plots(sliders, n, against);
  for (const figure of explorer.querySelectorAll("figure")) show(figure, made[figure.dataset.plot]);
  exactly(sliders, n, against);
}

/** Draw again what holds exact curves. */
function showExact(sliders, n, against, exact) {
  const figure = (name) => explorer.querySelector(`figure[data-plot="${name}"]`);
  show(figure("time"), timePlot(sliders, n, against, exact));
  if (!isFriction(sliders)) show(figure("step"), multiplierPlot(sliders, n, against, exact));
  figure("time").removeAttribute("aria-busy");
}

/** How many exact curves were begun; one that is not the last is given up. */
let begun = 0;
/** The last exact curve and what it is for: its axis only says where on it one is. */
let known = { of: "", curves: [] };
/** The exact curve, point by point between frames: some ten times the work of all the rest. */
function exactly(sliders, n, against) {
  const mine = ++begun;
  const figure = explorer.querySelector('figure[data-plot="time"]');
  const axis = axisOf(sliders);
  const of = JSON.stringify({ ...sliders, [axis]: axis });
  if (known.of === of) {
    showExact(sliders, n, against, known.curves);
    return;
  }
  const steps = exactAgainstAxis(sliders, axis);
  figure.setAttribute("aria-busy", "true");
  const more = () => {
    if (mine !== begun) return;
    const until = performance.now() + 12;
    let step = steps.next();
    while (!step.done && performance.now() < until) step = steps.next();
    if (!step.done) {
      setTimeout(more);
      return;
    }
    known = { of, curves: step.value };
    showExact(sliders, n, against, step.value);
  };
  setTimeout(more);
}

let waiting = false;
/** Draw before the next frame, once, however many events there were. */
function soon() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    update();
  });
}

function fromSliders() {
  for (const range of RANGES) shown[range.name] = fieldText(range, atPosition(range, Number(range.value)));
}

for (const range of RANGES) {
  range.addEventListener("input", () => {
    shown[range.name] = fieldText(range, atPosition(range, Number(range.value)));
    fieldOf(range).setCustomValidity("");
  });
  fieldOf(range).addEventListener("change", () => {
    typed(range);
    soon();
  });
  fieldOf(range).addEventListener("blur", soon);
}
form.addEventListener("input", () => {
  refused = [];
  soon();
});
form.addEventListener("submit", (event) => event.preventDefault());
form.addEventListener("change", toAddress);
// The sliders go back after the event.
form.addEventListener("reset", () =>
  setTimeout(() => {
    fromSliders();
    soon();
    toAddress();
  }),
);
addEventListener("hashchange", () => {
  fromAddress();
  soon();
});
new ResizeObserver(soon).observe(explorer);
fromSliders();
fromAddress();
update();
