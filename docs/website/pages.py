"""All pages that are made rather than written."""

from __future__ import annotations

from pathlib import Path

from derivations.derive import derive
from website import (
    api,
    curves,
    definitions,
    explorer,
    formulas,
    identities,
    layers,
    notebooks,
    plots,
)


def all_plots() -> tuple[plots.Plot | plots.Picture, ...]:
    """Of every label that has something to plot."""
    compared = (*curves.all_plots(), *identities.all_plots(), *definitions.all_plots())
    return (*compared, *definitions.pictures())


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
