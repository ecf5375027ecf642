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
    const select = document.querySelector("#graph-focus");
    if (select) select.value = known ? name : "";
  };

  document.addEventListener("DOMContentLoaded", () => {
    buttons();
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
