"use strict";
// Copy buttons beside code and for the TeX of a formula; brackets that stay with theirs; the erratum that a link leads to; one node
// of the graph with what it rests on, and what rests on it.
(() => {
  const copied = async (button, text) => {
    const before = button.textContent;
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      // Pages from the file system may have no clipboard.
      const area = document.createElement("textarea");
      area.value = text;
      document.body.append(area);
      area.select();
      document.execCommand("copy");
      area.remove();
    }
    button.textContent = "copied";
    setTimeout(() => { button.textContent = before; }, 1500);
  };

  const buttons = () => {
    for (const block of document.querySelectorAll("div.highlight")) {
      const button = document.createElement("button");
      button.type = "button";
      button.className = "copy";
      button.textContent = "copy";
      button.addEventListener("click", () => {
        const text = block.querySelector("pre").textContent;
        // Of a session only what is typed.
        const typed = text.split("\n").filter((line) => /^(>>>|\.\.\.|\$) /.test(line));
        copied(button, typed.length ? typed.map((l) => l.replace(/^\S+ /, "")).join("\n") : text);
      });
      block.prepend(button);
    }
    for (const button of document.querySelectorAll("button[data-copy]")) {
      button.addEventListener("click", () => copied(button, button.dataset.copy));
    }
    for (const button of document.querySelectorAll("button[data-permalink]")) {
      button.addEventListener("click", () => copied(button, location.href.split("#")[0]));
    }
  };

  // As docs/website/graph.py draws: boxes of this size, rows this far apart.
  const [WIDTH, HEIGHT, ROW] = [138, 22, 34];

  // An arrow's path (M x y, C x y x y x y, H x) with its heights changed.
  const moved = (path, change) => {
    let [command, k] = ["", 0];
    return path.split(" ").map((part) => {
      if (/[A-Z]/.test(part)) {
        [command, k] = [part, 0];
        return part;
      }
      return command !== "H" && k++ % 2 ? change(Number(part)) : part;
    }).join(" ");
  };

  const focus = () => {
    const graph = document.querySelector(".graph[data-focus]");
    if (!graph) return;
    const name = decodeURIComponent(location.hash).replace(/^#focus-/, "");
    const edges = [...graph.querySelectorAll("path")];
    const reach = (from, to) => {
      const found = new Set([name]);
      for (let size = 0; size !== found.size;) {
        size = found.size;
        for (const edge of edges) if (found.has(edge.dataset[from])) found.add(edge.dataset[to]);
      }
      return found;
    };
    const below = reach("to", "from");
    const above = reach("from", "to");
    const known = [...graph.querySelectorAll("a")].some((a) => a.dataset.node === name);
    for (const a of graph.querySelectorAll("a")) {
      const kept = !known || below.has(a.dataset.node) || above.has(a.dataset.node);
      a.classList.toggle("aside", !kept);
      a.classList.toggle("chosen", known && a.dataset.node === name);
    }
    for (const edge of edges) {
      const { from, to } = edge.dataset;
      const kept = (below.has(from) && below.has(to)) || (above.has(from) && above.has(to));
      edge.classList.toggle("aside", known && !kept);
    }
    // Cut to what is kept, at its own size, without the rows that are empty now.
    const svg = graph.querySelector("svg");
    svg.dataset.whole ||= svg.getAttribute("viewBox");
    let [x, y, width, height] = svg.dataset.whole.split(" ").map(Number);
    const nodes = [...svg.querySelectorAll("a")];
    const middle = (a) => a.querySelector("rect").y.baseVal.value + HEIGHT / 2;
    for (const edge of edges) edge.dataset.d ||= edge.getAttribute("d");
    const places = new Map();
    if (known) {
      const kept = nodes.filter((a) => !a.classList.contains("aside"));
      const heights = new Set(kept.map(middle));
      for (const edge of edges) {
        if (!edge.classList.contains("aside")) moved(edge.dataset.d, (v) => heights.add(v) && v);
      }
      const from = [...heights].sort((a, b) => a - b);
      for (const [k, v] of from.entries()) {
        places.set(v, k ? places.get(from[k - 1]) + Math.min(ROW, v - from[k - 1]) : v);
      }
      const boxes = kept.map((a) => a.querySelector("rect").x.baseVal.value);
      x = Math.min(...boxes) - 8;
      y = from[0] - HEIGHT / 2 - 8;
      width = Math.max(...boxes) + WIDTH + 8 - x;
      height = places.get(from.at(-1)) + HEIGHT / 2 + 8 - y;
    }
    const place = (v) => places.get(v) ?? v;
    for (const a of nodes) {
      a.setAttribute("transform", `translate(0 ${place(middle(a)) - middle(a)})`);
    }
    for (const edge of edges) edge.setAttribute("d", moved(edge.dataset.d, place));
    svg.setAttribute("viewBox", `${x} ${y} ${width} ${height}`);
    svg.setAttribute("width", width);
    svg.setAttribute("height", height);
    graph.scrollLeft = 0;
    if (known) graph.querySelector("a.chosen").scrollIntoView({ block: "nearest", inline: "nearest" });
    const hint = document.querySelector("#graph-hint");
    if (hint) hint.hidden = graph.scrollWidth <= graph.clientWidth;
    const select = document.querySelector("#graph-focus");
    if (select) select.value = known ? name : "";
  };

  // No line ends between a bracket and the formula in it, nor at a hyphen of a short piece of code,
  // where browsers break it.
  const joined = () => {
    for (const code of document.querySelectorAll("span.pre")) {
      code.classList.toggle("whole", code.textContent.length <= 16);
    }
    for (const formula of document.querySelectorAll("span.math")) {
      const before = formula.previousSibling;
      if (before?.nodeType !== Node.TEXT_NODE || !/[(\[]$/.test(before.data)) continue;
      const [whole, inside] = [document.createElement("span"), document.createElement("span")];
      [whole.className, inside.className] = ["joined", "inside"];
      whole.append(before.data.slice(-1), inside);
      before.data = before.data.slice(0, -1);
      formula.replaceWith(whole);
      inside.append(formula);
    }
  };

  // A figure leads to its file, which the browser shows as large as it is.
  const enlarge = () => {
    for (const image of document.querySelectorAll(".content img")) {
      if (image.closest("a")) continue;
      const link = document.createElement("a");
      link.href = image.src;
      link.className = "enlarge";
      link.title = "enlarge";
      image.replaceWith(link);
      link.append(image);
    }
  };

  // What a link to an erratum leads to, its details or their heading, is open.
  const open = () => {
    const place = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    const details = place && (place.matches("details") ? place : place.querySelector(":scope > details"));
    if (details?.id.startsWith("erratum-")) {
      details.open = true;
      details.closest("section").scrollIntoView();
    }
  };

  document.addEventListener("DOMContentLoaded", () => {
    buttons();
    joined();
    enlarge();
    const select = document.querySelector("#graph-focus");
    if (select) {
      select.addEventListener("change", () => {
        history.replaceState(null, "", select.value ? `#focus-${select.value}` : "#");
        focus();
      });
    }
    for (const shown of [focus, open]) {
      addEventListener("hashchange", shown);
      shown();
    }
  });
})();
