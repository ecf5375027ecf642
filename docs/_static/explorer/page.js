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

/** What a slider stands for: its value, or the preferred number that it counts to from 1. */
function sliderText(input) {
  if (!input.hasAttribute("data-decades")) return Number(input.value).toFixed(2);
  const count = Number(input.value);
  const power = Math.floor(count / DECADE.length);
  return String(Number(`${DECADE[count - DECADE.length * power]}e${power}`));
}

/** The sliders as an address has them (#mu=2&kappa=0.05); one is set to the nearest it can show. */
function fromAddress() {
  const given = new URLSearchParams(location.hash.slice(1));
  for (const input of form.querySelectorAll("input")) {
    const value = Number(given.get(input.name) ?? NaN);
    if (!Number.isFinite(value)) continue;
    if (!input.hasAttribute("data-decades")) {
      input.value = value;
    } else if (value > 0) {
      const power = Math.floor(Math.log10(value) + 1e-9);
      const digits = value / 10 ** power;
      const off = DECADE.map((one) => Math.abs(one - digits));
      input.value = DECADE.length * power + off.indexOf(Math.min(...off));
    }
  }
}

/** The address of what is shown. */
function toAddress() {
  history.replaceState(null, "", `#${new URLSearchParams(sliderValues())}`);
}

/** The values that the sliders show: what is computed with is what is read. */
function sliderValues() {
  const found = {};
  for (const input of form.querySelectorAll("input")) {
    const text = sliderText(input);
    found[input.name] = Number(text);
    const shown = text.replace("-", "−");
    input.parentElement.querySelector("output").textContent = shown;
    input.setAttribute("aria-valuetext", text);
  }
  return found;
}

function short(x, count = 4) {
  if (x === null) return NONE;
  return Number(x.toPrecision(count)).toString().replace("-", "−");
}

/** e^log to four digits, whatever its size, as HTML. */
function fromLog(log) {
  if (log === null) return NONE;
  const log10 = log / Math.LN10;
  if (log10 > -3 && log10 < 5) return short(Math.exp(log));
  let power = Math.floor(log10);
  let digits = (10 ** (log10 - power)).toFixed(3);
  if (digits === "10.000") [digits, power] = ["1.000", power + 1];
  return `${digits} × 10<sup>${String(power).replace("-", "−")}</sup>`;
}

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

/** The way to the fold in time, marked where T, which has z frozen, is longer than it. */
function dragged(n) {
  if (n.wayToFold === null) return NONE;
  const longer = n.logExact !== null && n.logExact > Math.log(n.wayToFold);
  return short(n.wayToFold) + (longer ? " — T is not the block’s time" : "");
}

/** Relative error of a formula, both logarithms given. */
function relative(log, exact) {
  if (log === null || exact === null) return NONE;
  const ratio = log - exact;
  if (ratio === 0) return "0";
  // Beyond e^30 the 1 that is taken off has no digit.
  return fromLog(ratio > 30 ? ratio : Math.log(Math.abs(Math.expm1(ratio))));
}

function rows(n) {
  const height = n.points.length === 2 ? Math.abs(n.points[1].V - n.points[0].V) : null;
  const physical = n.logExact === null ? null : n.logExact + Math.log(n.time);
  return {
    "κ, scaled: κ/√ε": short(n.kappa),
    "r, scaled: r/ε": short(n.r),
    // Sums of multiples of 1/100, without their rounding.
    "a⁻, a⁺": [n.aMinus, n.aPlus].map((a) => short(Number(a.toFixed(9)))).join(", "),
    "folds z0⁽⁺⁾, z0⁽⁻⁾": n.folds ? n.folds.map((z) => short(z)).join(", ") : NONE,
    "height of the barrier": short(height),
    "Stokes multiplier, and as a step": `${short(n.smooth)}, ${short(n.step)}`,
    "T, scaled, z frozen": fromLog(n.logExact),
    "until the belt has z at the fold z0⁽⁺⁾": dragged(n),
    "T, physical: ε times that": fromLog(physical),
    "T, scaled, by the paper’s formula": fromLog(n.logTime),
    "relative error of the paper’s formula": relative(n.logTime, n.logExact),
    "T, scaled, by the uniform formula": fromLog(n.logUniform),
    "relative error of the uniform formula": relative(n.logUniform, n.logExact),
    "P, share of time in the layer": n.occupation?.toPrecision(4) ?? NONE,
    "1 − P": fromLog(n.logOutside),
  };
}

/** log10 T against z0: the formulas, and of the exact curve what there is by now. */
function timePlot(sliders, n, { time: paper, uniform }, exact) {
  const shown = exact.filter((curve) => curve.length > 1);
  const now = n.logExact === null || !paper.length ? [] : [[sliders.z0, n.logExact / Math.LN10, "dot"]];
  const crosses = n.region === "crossing";
  return {
    ...spring(sliders, n),
    curves: shown,
    dashed: paper,
    dotted: uniform,
    y: heights([...paper, ...uniform, ...shown]),
    points: crosses ? now : [],
  };
}

function spring(sliders, n) {
  return { x: SPRING, xlabel: "z0", lines: n.folds ?? [], here: sliders.z0 };
}

/** The plots of one position of the sliders: name -> what `drawn` takes, or why there is none. */
function plots(sliders, n, against) {
  const { step, smooth } = against;
  const { phi, V } = landscape(sliders);
  const u = { x: [-REACH, REACH], xlabel: "u", layer: LAYER };
  const p = density(sliders);
  const within = n.points.map((point) => [point.u, point.V, point.kind]);
  const zeros = n.points.map((point) => [point.u, 0, point.kind]);
  const share = n.smooth === null ? [] : [[sliders.z0, n.smooth, "dot"]];
  return {
    V: { ...u, curves: [V], y: heights([V]), points: within },
    phi: { ...u, curves: [phi], y: heights([phi], [0]), zero: true, points: zeros },
    density: p ? { ...u, curves: [p], y: heights([p], [0]) } : "none: it does not slide here",
    time: timePlot(sliders, n, against, []),
    step: step.length
      ? { ...spring(sliders, n), curves: smooth, dashed: step, y: [-0.1, 1.1], points: share }
      : "none: for μ ≤ 1/2 no well is born",
  };
}

function show(figure, plot, caption) {
  let svg = figure.querySelector("svg");
  if (!svg) {
    svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    svg.setAttribute("role", "img");
    figure.prepend(svg);
  }
  const { width, height } = svg.getBoundingClientRect();
  const none = typeof plot === "string";
  svg.setAttribute("aria-label", none ? `${caption}: ${plot}` : caption);
  svg.innerHTML = none
    ? `<text text-anchor="middle" x="${width / 2}" y="${height / 2}">${plot}</text>`
    : drawn(plot, width, height);
}

function update() {
  const sliders = sliderValues();
  const n = numbers(sliders);
  explorer.querySelector("#explorer-region").textContent = inWords(n);
  const items = Object.entries(rows(n));
  explorer.querySelector("dl").innerHTML = items
    .map(([name, value]) => `<div><dt>${name}</dt><dd>${value}</dd></div>`)
    .join("");
  const against = againstSpring(sliders);
  const made = plots(sliders, n, against);
  for (const figure of explorer.querySelectorAll("figure")) {
    const caption = figure.querySelector("figcaption").textContent;
    show(figure, made[figure.dataset.plot], caption);
  }
  exactly(sliders, n, against);
}

/** How many exact curves were begun; one that is not the last is given up. */
let begun = 0;
/** The last exact curve and what it is for: z0 only says where on it one is. */
let known = { of: "", curves: [] };
/** The exact curve, point by point between frames: some ten times the work of all the rest. */
function exactly(sliders, n, against) {
  const mine = ++begun;
  const figure = explorer.querySelector('figure[data-plot="time"]');
  const caption = figure.querySelector("figcaption").textContent;
  const { z0, ...others } = sliders;
  const of = JSON.stringify(others);
  if (known.of === of) {
    show(figure, timePlot(sliders, n, against, known.curves), caption);
    figure.removeAttribute("aria-busy");
    return;
  }
  const steps = exactAgainstSpring(sliders);
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
    show(figure, timePlot(sliders, n, against, step.value), caption);
    figure.removeAttribute("aria-busy");
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

form.addEventListener("input", soon);
form.addEventListener("submit", (event) => event.preventDefault());
// The sliders go back after the event.
form.addEventListener("reset", () => setTimeout(soon));
form.addEventListener("change", toAddress);
form.addEventListener("reset", () => setTimeout(toAddress));
addEventListener("hashchange", () => {
  fromAddress();
  soon();
});
new ResizeObserver(soon).observe(explorer);
fromAddress();
update();
