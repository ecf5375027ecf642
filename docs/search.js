// Of Sphinx's search: what comes first, and formulas without their TeX.

const wordsOf = (text) => text.toLowerCase().split(/[^\p{Letter}\p{Number}_]+/u).filter((word) => word);
const asked = wordsOf(new URLSearchParams(location.search).get("q") ?? "");

/** The place of a page in the sidebar, where the guide stands before the formulas and the reference. */
const inSidebar = (page) => {
  const links = [...document.querySelectorAll(".sidebar-tree a")].map((a) => a.getAttribute("href"));
  const at = links.indexOf(`${page}.html`);
  return at < 0 ? links.length : at;
};

const GREEK = {
  alpha: "α", beta: "β", delta: "δ", epsilon: "ε", varepsilon: "ε", zeta: "ζ", kappa: "κ", lambda: "λ",
  mu: "μ", pi: "π", sigma: "σ", tau: "τ", phi: "ϕ", psi: "ψ", Delta: "Δ", Sigma: "Σ",
};
const SIGNS = { to: "→", infty: "∞", le: "≤", ge: "≥", int: "∫", sqrt: "√", cdot: "·", sim: "∼", times: "×" };

/** TeX as text, nearly as it is read. */
function withoutTex(text) {
  return text
    .replace(/\\([A-Za-z]+) ?/g, (_, name) => GREEK[name] ?? SIGNS[name] ?? "")
    .replace(/\\[()[\]]|[{}]|\\,/g, "");
}

var Scorer = {
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
  // The pages of the guide, the glossary and the public names; formulas and what is a record; members
  // of classes. Among equals the sidebar's order.
  score: (item) => {
    const [page, title, , , score, , kind] = item;
    const guide = !page.includes("/") && !["errata", "CHANGELOG", "house"].includes(page);
    const titled = wordsOf(title);
    const own = asked.every((word) => titled.includes(word));
    const nearly = asked.every((word) => titled.some((other) => other.startsWith(word)));
    // A word of a heading has 15, the heading itself is better than its page; a part of a word has 2.
    let found = kind === "title" ? 41 : score >= 15 ? 40 : score >= 5 ? 5 : -15;
    if (kind === "object") found = title.split(".").length > 2 ? -20 : score > 11 ? 45 : 15;
    else if (kind === "index") found = 52;
    else if (nearly && !title.includes(" > ")) found = own ? 60 : 50;
    if (kind !== "object" && !guide) found -= 25;
    item[1] = withoutTex(title);
    return found - 0.001 * inSidebar(page);
  },
};

document.addEventListener("DOMContentLoaded", () => {
  // The text of a page, or of the glossary's row, from which a result's lines are taken.
  Search.htmlToText = (html, anchor) => {
    const whole = new DOMParser().parseFromString(html, "text/html");
    const main = whole.querySelector('[role="main"]');
    for (const left of main.querySelectorAll(".headerlink, script, style, .highlight, div.math")) left.remove();
    const part = anchor ? main.querySelector(anchor) : null;
    const row = part?.closest("tr");
    const text = row ? [...row.cells].slice(0, 2).map((cell) => cell.textContent).join(": ") : null;
    return withoutTex(text ?? (part || main).textContent).replace("\u200b", "");
  };
});
