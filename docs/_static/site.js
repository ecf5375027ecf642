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

  // As docs/website/graph.py draws.
  const [WIDTH, HEIGHT, ROW, GAP, LANE, MARGIN] = [117, 22, 56, 5, 10, 2];

  const curve = (way) => {
    let [x, y] = [way[0][0], MARGIN + way[0][1] * ROW + HEIGHT];
    const path = [`M ${x} ${y}`];
    for (const [below, row] of way.slice(1)) {
      const top = MARGIN + row * ROW;
      const half = (y + top) / 2;
      path.push(`C ${x} ${half} ${below} ${half} ${below} ${top}`, `V ${top + HEIGHT}`);
      [x, y] = [below, top + HEIGHT];
    }
    return path.slice(0, -1).join(" ");
  };

  // The points of an attribute "x row x row …".
  const points = (text) => {
    const numbers = text.split(" ").map(Number);
    return numbers.flatMap((x, k) => (k % 2 ? [] : [[x, numbers[k + 1]]]));
  };

  // The title of a box of the graph, above it.
  const tell = (a) => {
    const [label, title] = ["text", "title"].map((part) => a.querySelector(part).textContent);
    document.querySelector("#graph-title").textContent = `${label}: ${title}`;
  };

  const focus = () => {
    const graph = document.querySelector(".graph[data-focus]");
    if (!graph) return;
    const name = decodeURIComponent(location.hash).replace(/^#focus-/, "");
    const edges = [...graph.querySelectorAll("path[data-way]")];
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
    // What is kept moves together: the rows that have any of it, and in each row its boxes and lanes.
    const svg = graph.querySelector("svg");
    const rows = new Map();
    const room = ([x, row], width) => {
      if (!rows.has(row)) rows.set(row, new Map());
      rows.get(row).set(x, Math.max(width, rows.get(row).get(x) ?? 0));
    };
    const kept = (selector) =>
      [...svg.querySelectorAll(selector)].filter((e) => !e.classList.contains("aside"));
    for (const a of kept("a")) room(points(a.dataset.at)[0], WIDTH + GAP);
    for (const edge of kept("path[data-way]")) {
      for (const bend of points(edge.dataset.way)) room(bend, LANE);
    }
    const sum = (row) => [...row.values()].reduce((a, b) => a + b, 0);
    const widest = Math.max(...[...rows.values()].map(sum));
    const places = new Map();
    for (const [k, row] of [...rows.keys()].sort((a, b) => a - b).entries()) {
      let x = MARGIN + (widest - sum(rows.get(row))) / 2;
      for (const [old, width] of [...rows.get(row)].sort((a, b) => a[0] - b[0])) {
        places.set(`${old} ${row}`, [x + width / 2, k]);
        x += width;
      }
    }
    const place = ([x, row]) => places.get(`${x} ${row}`);
    for (const a of kept("a")) {
      const old = points(a.dataset.at)[0];
      const [x, row] = place(old);
      a.setAttribute("transform", `translate(${x - old[0]} ${(row - old[1]) * ROW})`);
    }
    for (const edge of kept("path[data-way]")) {
      edge.setAttribute("d", curve(points(edge.dataset.way).map(place)));
    }
    const [width, height] = [widest + 2 * MARGIN, (rows.size - 1) * ROW + HEIGHT + 2 * MARGIN];
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    svg.setAttribute("width", width);
    svg.setAttribute("height", height);
    graph.dataset.focus = known ? name : "";
    graph.scrollLeft = 0;
    if (known) {
      const chosen = graph.querySelector("a.chosen");
      tell(chosen);
      chosen.scrollIntoView({ block: "center", inline: "center" });
    }
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

  // Paths in tables break behind a slash and nowhere else.
  const slashed = () => {
    for (const code of document.querySelectorAll("td span.pre")) {
      const parts = code.textContent.split(/(?<=\/)/);
      code.parentElement.classList.toggle("path", parts.length > 1);
      code.replaceChildren(...parts.flatMap((part, k) => (k ? [document.createElement("wbr"), part] : [part])));
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
    slashed();
    enlarge();
    const select = document.querySelector("#graph-focus");
    if (select) {
      select.addEventListener("change", () => {
        history.replaceState(null, "", select.value ? `#focus-${select.value}` : "#");
        focus();
      });
    }
    for (const a of document.querySelectorAll(".graph a")) {
      for (const event of ["mouseenter", "focus"]) a.addEventListener(event, () => tell(a));
    }
    for (const shown of [focus, open]) {
      addEventListener("hashchange", shown);
      shown();
    }
    // The browser goes to the address's place when all is loaded.
    addEventListener("load", focus);
  });
})();
