"""The commands of formulas: ``symasym show``, ``emit``, ``derive``."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import symasym as sa
from symasym.base.errors import InputError
from symasym.drift.ready_made import named_drift

if TYPE_CHECKING:
    from symasym.derivation.derivation import Step
    from symasym.formula import Formula


def derive(labels: Any = (), *, out: str = "build/derivations") -> None:
    """Check the derivation of a label and of all it rests on (default: every one).

    Pages and trace are written to build/derivations unless --out says otherwise.

    examples:
      symasym derive
      symasym derive eq:Ttilde
    """
    from derivations import pages
    from symasym.base.files import progress
    from symasym.formula import formula
    from symasym.formula import labels as every

    for label in labels:
        formula(label)  # which refuses what is no label
    chosen = pages.with_roots(labels or every())
    with progress("derivations", len(chosen)) as bar:
        pages.derive(chosen, Path(out), bar.update)
    for label in labels or chosen:
        shown = formula(label)
        print(f"{label}: {shown.title}; {len(shown.steps)} steps hold; error: {shown.error}")
        for s in shown.steps if labels else ():
            print(f"  {s.name} (checked {s.check_kind}): {s.left} {s.relation} {s.right}")
    print(f"{len(chosen)} derivations hold; pages in {out}")


def emit(
    label: str,
    *,
    target: str,
    out: str | None = None,
    drift: str | None = None,
    expr: str | None = None,
    values: Any = (),
    order: int | None = None,
) -> None:
    """Write a formula as source code.

    Parameters that are set are put in; without --out it is printed.

    examples:
      symasym emit eq:Ttilde --target c --drift friction --set mu=3 --set alpha=1 -o time.c
      symasym emit expansion:T --target c --drift friction --order 2 -o time.c
    """
    given, made = dict(values), None
    if drift or expr:
        # What shapes a drift is needed to make it; `emit` binds the rest.
        shapes = r"c\d+" if drift == "polynomial" else r"waves|n"
        named = [name for name in given if drift and re.fullmatch(shapes, name)]
        made = named_drift(drift, expr, {name: given.pop(name) for name in named})
    if quantity := _quantity(label):
        made = (made or sa.Drift.general()).bind(**given)
        source = sa.expand(made, quantity, order=order).emit(target)
    elif order is not None:
        raise InputError(f"--order is of an expansion such as expansion:T, not {label}.")
    else:
        source = sa.emit(label, target, given, drift=made)
    if out is None:
        print(source, end="")
    else:
        print(source.write(out))


def _quantity(label: str | None) -> Any:
    """T of ``expansion:T``; of other labels an empty text."""
    kind, _, name = (label or "").partition(":")
    return name.replace("1-", "1 - ") if kind == "expansion" else ""


def show(
    label: str | None = None,
    *,
    everything: bool = False,
    latex: bool = False,
    steps: bool = False,
    drift: str | None = None,
    expr: str | None = None,
    values: Any = (),
    noise: str | None = None,
    order: int | None = None,
    start: str | None = None,
    case: str | None = None,
) -> None:
    """Print a formula.

    examples:
      symasym show fr1 --latex --steps
      symasym show expansion:T --drift friction --order 2
    """
    quantity = _quantity(label)
    options = {"noise": noise, "order": order, "start": start, "case": case}
    of = {"drift": drift, "expr": expr, "set": values, **options}
    if odd := [
        n for n, x in ({"all": everything, "steps": steps} if quantity else of).items() if x
    ]:
        raise InputError(f"--{odd[0]} does not go with {label or '--all'}; leave it out.")
    if (label is None) != everything:
        raise InputError("give a label, or --all.")
    from derivations.labels import DEFINITIONS
    from symasym.formula import formula, labels

    if quantity:
        made = sa.Drift.general()
        if (drift, expr) != (None, None):
            made = named_drift(drift, expr, dict(values))
        elif values:
            raise InputError("--set sets a drift's parameter; give --drift or --expr.")
        given: Any = {name: x for name, x in options.items() if x is not None}
        expansion = sa.expand(made, quantity, **given)
        print(expansion.latex() if latex else expansion)
    elif label in DEFINITIONS:
        shown, text = DEFINITIONS[label]
        print(shown if latex else f"{shown}\n\n{label} defines {text}.")
    elif everything and latex:
        from derivations.pages import document

        print(document(), end="")
    else:
        for each in labels() if label is None else [label]:
            _show(formula(each), latex, steps)


def _show(shown: Formula, latex: bool, steps: bool) -> None:
    """Print a formula, and what belongs to it unless only LaTeX is wanted."""
    if latex:
        print(shown.latex())
    else:
        print(f"{shown.label}: {_plain(shown.title)}\n")
        print(*(f"{_pretty(step)}\n" for step in shown.concluded), sep="\n")
        print(f"Error: {_plain(shown.error)}.")
        for line in (f"Here {shown.note}.",) * bool(shown.note) + shown.assumptions:
            print(_plain(line))
    for number, step in enumerate(shown.steps if steps else (), 1):
        print(f"{number}. {step.name}{': ' * bool(step.why)}{_plain(step.why)}\n   {step.latex()}")


def _pretty(step: Step) -> str:
    """A step drawn with characters, as wide as it needs."""
    import sympy

    from symasym.derivation.tex import tex

    def drawn(e: Any) -> str:
        names = {s: sympy.Symbol(_plain(tex(s))) for s in e.free_symbols}
        return str(sympy.pretty(e.xreplace(names), num_columns=10_000))

    if isinstance(step.left, str):
        left = step.left.removesuffix("=").strip()
        return f"{_plain(left)}{'' if left.endswith('sim') else ' ='}\n\n{drawn(step.right)}"
    relation = "==" if step.relation == "=" else step.relation
    return drawn(sympy.Rel(step.left, step.right, relation, evaluate=False))


def _plain(text: str) -> str:
    """A sentence, or a name, with its TeX as characters."""
    for sign, character in ((r"\le", "<="), (r"\ge", ">="), (r"\sim", "~"), (r"\to", "->")):
        text = re.sub(rf"\{sign}\b", character, text)
    return re.sub(r"\\(?:mathrm|tilde|hat|left|right|,|;)?|[{}$]", "", text)
