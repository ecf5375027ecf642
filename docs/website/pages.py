"""All pages that are made rather than written."""

from __future__ import annotations

from pathlib import Path

from symasym.derive_command import derive
from website import api, curves, explorer, formulas, plots


def all_pages(derivations: Path) -> dict[str, str]:
    """File name -> text; checks the derivations whose records are not in `derivations`."""
    records = derive(None, derivations)
    drawn = curves.all_plots()
    return {
        **formulas.pages(records, [plot.label for plot in drawn]),
        **plots.files(drawn),
        **api.pages(),
        **explorer.pages(),
    }
