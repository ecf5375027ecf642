// Settings of MathJax; docs/build.py places the parts that are loaded here.
window.MathJax = {
  loader: {
    // Not the ready-made bundles: they start workers for speech, which a file may not. Hidden
    // MathML serves screen readers instead.
    load: ["core", "input/tex", "output/svg", "a11y/assistive-mml"],
    paths: { fonts: "[mathjax]/fonts" },
  },
  // A formula that TeX does not take shows as an error; it must not pass as text.
  tex: { packages: { "[-]": ["noerrors", "noundefined"] } },
  // TeX's letters are wider than those of the text at the same height.
  output: { scale: 0.92, displayOverflow: "linebreak", linebreaks: { inline: true } },
  // What Sphinx marks as mathematics, and nothing else.
  options: { ignoreHtmlClass: ".*", processHtmlClass: "math" },
  startup: {
    ready() {
      // Left by assistive-mml for a menu that is not loaded, and warned of.
      delete MathJax.config.options.menuOptions;
      MathJax.startup.defaultReady();
      // Without this a good break is no better than any other.
      MathJax.startup.output.linebreaks.PENALTY.goodbreak = (penalty) => penalty - 10000;
      // A short formula in a line of text stays whole.
      MathJax.startup.input[0].preFilters.add(({ math }) => {
        if (!math.display && math.math.length <= 32) math.math = `{${math.math}}`;
      });
      // What is measured here is not broken into lines; a formula little wider than the page shrinks.
      const { output } = MathJax.startup;
      output.preFilters.add(({ math, document }) => {
        math.width ??= math.metrics.containerWidth / output.options.scale;
        math.metrics.containerWidth = math.width;
        output.containerWidth = 1e6;
        const share = (output.getBBox(math, document).w * output.pxPerEm) / math.width;
        if (math.display && share < 1.2) math.root.attributes.set("overflow", "scale");
      });
      // Cases shrink to the width of the page: a line break would part a value from its condition.
      MathJax.startup.input[0].postFilters.add(({ data }) => {
        const rows = data.root.childNodes[0];
        // Not between a left side and the first relation, where a line would hold the left alone.
        const first = rows.childNodes.findIndex((node) => node.isKind("mo") && node.texClass === 3);
        if (first === 1) rows.childNodes[first].attributes.set("linebreak", "nobreak");
        data.root.walkTree((node) => {
          // Between two formulas, and not inside one.
          if (node.isKind("mspace") && /^[12]em$/.test(node.attributes.get("width"))) {
            node.attributes.set("linebreak", "goodbreak");
          }
          if (node.isKind("mtable")) data.root.attributes.set("overflow", "scale");
        });
      });
    },
  },
};
