// A small plot as SVG text; its colours are in explorer.css.
"use strict";

const MARGIN = { left: 60, right: 16, top: 10, bottom: 38 };

/** Round numbers in [low, high], three at least and at most seven. */
function ticks(low, high) {
  const power = Math.floor(Math.log10((high - low) / 2));
  const count = (step) => Math.floor(high / step + 1e-9) - Math.ceil(low / step - 1e-9) + 1;
  const step = [5, 2, 1, 0.5, 0.2].map((s) => s * 10 ** power).find((s) => count(s) >= 3);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) {
    found.push((k * step).toFixed(decimals).replace(/^-(0(\.0*)?)$/, "$1").replace("-", "−"));
  }
  return found;
}

function position(text) {
  return Number(text.replace("−", "-"));
}

/** The range of y that shows all curves with some room; `least` is within it, if given. */
function heights(curves, least) {
  const all = curves.flat().map((p) => p[1]);
  const low = Math.min(...all, ...(least ?? []));
  const high = Math.max(...all, ...(least ?? []));
  const room = 0.08 * (high - low) || Math.max(0.5, 0.08 * Math.abs(high));
  return [low - room, high + room];
}

/**
 * The inside of an SVG of this size.
 *
 * plot: x and y (ranges), xlabel, ylabel, curves (lists of points); and, where it has them, layer
 * (a band in x), zero (a line at y = 0), lines (dashed, at x), here (a line at x), points
 * ([x, y, class]; one above the frame is an arrow at its top), belt, dashed and dotted (more curves,
 * under and over the others).
 */
function drawn(plot, width, height) {
  const right = width - MARGIN.right;
  const bottom = height - MARGIN.bottom;
  const at = (range, from, to) => (v) =>
    from + ((v - range[0]) / (range[1] - range[0])) * (to - from);
  const x = at(plot.x, MARGIN.left, right);
  const y = at(plot.y, bottom, MARGIN.top);
  const px = (v) => v.toFixed(2);
  const upright = (v, kind) =>
    `<line class="${kind}" x1="${px(x(v))}" x2="${px(x(v))}" y1="${MARGIN.top}" y2="${bottom}"/>`;
  const parts = [];
  if (plot.layer) {
    const [a, b] = plot.layer.map(x);
    const size = `width="${px(b - a)}" height="${bottom - MARGIN.top}"`;
    parts.push(`<rect class="layer" x="${px(a)}" y="${MARGIN.top}" ${size}/>`);
  }
  const size = `width="${right - MARGIN.left}" height="${bottom - MARGIN.top}"`;
  parts.push(`<rect class="frame" x="${MARGIN.left}" y="${MARGIN.top}" ${size}/>`);
  for (const t of ticks(...plot.x)) {
    const place = `x="${px(x(position(t)))}" y="${bottom + 15}"`;
    parts.push(`<text text-anchor="middle" ${place}>${t}</text>`);
  }
  for (const t of ticks(...plot.y)) {
    const place = `x="${MARGIN.left - 5}" y="${px(y(position(t)) + 4)}"`;
    parts.push(`<text text-anchor="end" ${place}>${t}</text>`);
  }
  const middle = (MARGIN.left + right) / 2;
  parts.push(`<text text-anchor="middle" x="${middle}" y="${height - 5}">${plot.xlabel}</text>`);
  const [left, half] = [14, (MARGIN.top + bottom) / 2];
  const turned = `transform="rotate(-90 ${left} ${half})"`;
  parts.push(`<text text-anchor="middle" x="${left}" y="${half}" ${turned}>${plot.ylabel}</text>`);
  if (plot.zero && plot.y[0] < 0 && plot.y[1] > 0) {
    const ends = `x1="${MARGIN.left}" x2="${right}" y1="${px(y(0))}" y2="${px(y(0))}"`;
    parts.push(`<line class="zero" ${ends}/>`);
  }
  for (const v of plot.lines ?? []) {
    if (plot.x[0] < v && v < plot.x[1]) parts.push(upright(v, "line"));
  }
  if (plot.here !== undefined) parts.push(upright(plot.here, "here"));
  const path = (curve) => curve.map(([u, v]) => `${px(x(u))} ${px(y(v))}`).join("L");
  for (const curve of plot.belt ?? []) parts.push(`<path class="belt" d="M${path(curve)}"/>`);
  for (const curve of plot.curves) parts.push(`<path class="curve" d="M${path(curve)}"/>`);
  for (const curve of plot.dashed ?? []) parts.push(`<path class="dashed" d="M${path(curve)}"/>`);
  for (const curve of plot.dotted ?? []) parts.push(`<path class="dotted" d="M${path(curve)}"/>`);
  for (const [u, v, kind] of plot.points ?? []) {
    const [cx, top] = [x(u), MARGIN.top];
    const arrow = `${px(cx - 6)},${top + 11} ${px(cx + 6)},${top + 11} ${px(cx)},${top + 1}`;
    parts.push(
      v > plot.y[1]
        ? `<polygon class="${kind}" points="${arrow}"/>`
        : `<circle class="${kind}" cx="${px(cx)}" cy="${px(y(v))}" r="5"/>`,
    );
  }
  return parts.join("");
}
