"""All pages that are made rather than written."""

from __future__ import annotations

from pathlib import Path

from derivations.report import derive
from website import api, explorer, formulas, layers, notebooks
from website.plotting import curves, definitions, identities, moving, plots


def all_plots() -> tuple[plots.Plot | plots.Picture, ...]:
    """Of every label that has something to plot."""
    made = (curves, identities, definitions, moving)
    return (*(plot for m in made for plot in m.all_plots()), *definitions.pictures())


def all_pages(derivations: Path) -> dict[str, str]:
    """File name -> text; checks the derivations whose records are not in `derivations`."""
    records = derive(None, derivations)
    drawn = all_plots()
    return {
        **formulas.pages(records, drawn, definitions.NOTHING),
        **plots.files(drawn),
        **api.pages(),
        **explorer.pages(),
        **layers.pages(),
        **notebooks.files(),
    }
