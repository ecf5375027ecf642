"""The explorer's page: the emitted formulas put into it as a script that files may load."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import symasym as sa
from symasym.emit import Source

DOCS = Path(__file__).parent.parent
#: What the explorer takes the place of: a sentence for who reads docs/explorer.md, and the mark.
MARK = "The sliders and five plots are on the built site.\n<!-- the explorer -->"
#: Drifts beside it, of which the page has phi and V.
OTHERS = {"tanh": sa.tanh(), "hill": sa.hill(), "sine": sa.sine()}
#: Formulas that hold a drift, with the friction oscillator's in them, and those of its own.
WITH_DRIFT = ("eq:phi", "eq:V", "eq:Ttilde", "eq:Ttildesmall", "eq:S", "eq:pss", "eq:P", "eq:C")
PLAIN = (
    "eq:phifric0", "regions", "fr1", "turning-points", "folds", "eq:tildexykappa", "eq:tilder",
    "eq:TtildetoT",
)  # fmt: skip


def pages() -> dict[str, str]:
    """File name -> text: what is written in docs/explorer.md, and the explorer in it."""
    text = (DOCS / "explorer.md").read_text("utf-8")
    if MARK not in text:
        raise ValueError(f"docs/explorer.md has no lines {MARK!r}, where the explorer is to be")
    controls = (Path(__file__).parent / "explorer.html").read_text("utf-8")
    # The formulas before the scripts that call them.
    script = f"<script>\n{formulas()}</script>\n"
    raw = f"````{{raw}} html\n{script}{controls}````"
    return {"explorer.md": text.replace(MARK, raw)}


def formulas() -> str:
    """JavaScript that defines `emitted`: label -> the functions emitted for it."""
    scopes = "\n".join(_scope(label, source) for label, source in sources().items())
    return f'"use strict";\nconst emitted = {{}};\n\n{scopes}'


def sources() -> Mapping[str, Source]:
    """Label, or label and method -> the module that `symasym.emit` writes."""
    drift = sa.friction()
    return {
        **{label: sa.emit(label, "javascript", drift=drift) for label in WITH_DRIFT},
        **{
            f"{name} {label}": sa.emit(label, "javascript", drift=other)
            for name, other in OTHERS.items()
            for label in ("eq:phi", "eq:V")
        },
        **{label: sa.emit(label, "javascript") for label in PLAIN},
    }


def _scope(label: str, source: Source) -> str:
    """A module as a function's scope, with its helper `zeros` where it has that.

    Browsers load no module from the file system; modules of different formulas
    share names (V), which a scope of its own keeps apart.
    """
    code = re.sub(r"^export (?=function )", "", str(source), flags=re.MULTILINE)
    if re.search(r"^(export|import)\b|</script", code, re.MULTILINE):
        raise ValueError(f"the module of {label} holds what a script in a page cannot")
    names = [*source.functions, *(["zeros"] if "\nfunction zeros(" in code else [])]
    return f'emitted["{label}"] = (() => {{\n{code}\nreturn {{ {", ".join(names)} }};\n}})();\n'
