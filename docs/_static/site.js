"use strict";
// Copy buttons beside code and for the TeX of a formula; one node of the graph with what it rests
// on, and what rests on it.
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
      block.append(button);
    }
    for (const button of document.querySelectorAll("button[data-copy]")) {
      button.addEventListener("click", () => copied(button, button.dataset.copy));
    }
    for (const button of document.querySelectorAll("button[data-permalink]")) {
      button.addEventListener("click", () => copied(button, location.href.split("#")[0]));
    }
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
    // Cut to what is kept, at its own size.
    const svg = graph.querySelector("svg");
    svg.dataset.whole ||= svg.getAttribute("viewBox");
    let [x, y, width, height] = svg.dataset.whole.split(" ").map(Number);
    if (known) {
      const boxes = [...svg.querySelectorAll("a:not(.aside), path:not(.aside)")].map((e) => e.getBBox());
      x = Math.min(...boxes.map((b) => b.x)) - 8;
      y = Math.min(...boxes.map((b) => b.y)) - 8;
      width = Math.max(...boxes.map((b) => b.x + b.width)) + 8 - x;
      height = Math.max(...boxes.map((b) => b.y + b.height)) + 8 - y;
    }
    svg.setAttribute("viewBox", `${x} ${y} ${width} ${height}`);
    svg.setAttribute("width", width);
    svg.setAttribute("height", height);
    if (known) graph.querySelector("a.chosen").scrollIntoView({ block: "nearest", inline: "center" });
    const select = document.querySelector("#graph-focus");
    if (select) select.value = known ? name : "";
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

  document.addEventListener("DOMContentLoaded", () => {
    buttons();
    enlarge();
    const select = document.querySelector("#graph-focus");
    if (select) {
      select.addEventListener("change", () => {
        history.replaceState(null, "", select.value ? `#focus-${select.value}` : "#");
        focus();
      });
    }
    addEventListener("hashchange", focus);
    focus();
  });
})();
