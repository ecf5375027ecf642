"""The notation sheet holds every formula, once, and compiles."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from derivations.report import sheet, tex
from symasym.commands.main import main
from symasym.formula import formula, labels
from symasym.records import definitions
from tests.latex import compiled, needs_latex


@pytest.fixture(scope="module")
def document() -> str:
    return sheet()


def bare(latex: str) -> str:
    """Without what only breaks lines."""
    for layout in (r"\begin{gathered}", r"\end{gathered}", r" ,\quad ", "{}", "\\\\\n"):
        latex = latex.replace(layout, "")
    return re.sub(r"\s", "", re.sub(r"\\mathrm\{(\w+)\}", r"\1", latex))


def test_every_formula_stands_under_its_label(document: str) -> None:
    found = re.findall(
        r"\\begin\{equation\}\n\\label\{(.*?)\}\n(.*?)\n\\end\{equation\}", document, re.DOTALL
    )
    assert sorted(label for label, _ in found) == sorted(labels())
    for label, latex in found:
        assert bare(latex) == bare(formula(label).latex()), label


def test_every_formula_says_how_exact_it_is(document: str) -> None:
    for label in labels():
        title, error = (tex(text) for text in (formula(label).title, formula(label).error))
        name = label.replace("_", r"\_")
        assert document.count(f"\\formula{{{title}}}{{{name}}}{{{error}}}\n") == 1


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("relative O(kappa^2), where a+ > 0", r"relative $O(\kappa^{2})$, where $a^+ > 0$"),
        ("D = V(u2) - V(u1)", "$D = V(u_2) - V(u_1)$"),
        ("e^{-lam V} is a well's weight", r"$e^{-\lambda V}$ is a well's weight"),
        ("the Fokker-Planck share, 50 %", r"the Fokker-Planck share, 50 \%"),
        ("u_m <= r^2", r"$u_m \le r^{2}$"),
        ("exp(3 a- r/(2 kappa^2)) or", r"$e^{3 a^- r/(2 \kappa^{2})}$ or"),
        ("sqrt(eps), at most", r"$\sqrt{\varepsilon}$, at most"),
        ("A lower bound on a drift a", "A lower bound on a drift $a$"),
        ("a+^2 (strong), a well in (0, r)", "$(a^+)^{2}$ (strong), a well in $(0, r)$"),
        ("J'' over (kappa small)", "$J''$ over ($\\kappa$ small)"),
        ("from 1e-1 to 3e-2 of |u|", r"from $10^{-1}$ to $3 \times 10^{-2}$ of $\lvert u\rvert$"),
        ("drift < 0, c_j = V^(j)(u1)", "drift $<$ 0, $c_j = V^{(j)}(u_1)$"),
        ("N_- and |dT/dt| << 1", r"$N_-$ and $\lvert dT /dt \rvert \ll 1$"),
        ("I_(n,j), V_m and Pi", r"$I_{n,j}$, $V(u_m)$ and $\Pi$"),
        ("u = a + b s + ..., far off ...", r"$u = a + b s + \dots$, far off ..."),
    ],
)
def test_formulas_in_words(text: str, wanted: str) -> None:
    assert tex(text) == wanted


def test_the_command_prints_it(document: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", "--all", "--latex"]) == 0
    assert capsys.readouterr().out == document


def test_all_without_latex(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", "--all"]) == 0
    printed = capsys.readouterr().out
    assert all(f"{label}: {formula(label).title}\n" in printed for label in labels())
    assert all(f"\n{label}: {x['reason']}\n\n{x['text']}\n" in printed
               for label, x in definitions().items())  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ([], "no formula is named"),
        (["--all", "fr1"], "fr1 does not go with --all"),
        (["--all", "--steps"], "--steps does not go with --all"),
    ],
)
def test_what_does_not_go_together(
    capsys: pytest.CaptureFixture[str], arguments: list[str], told: str
) -> None:
    assert main(["show", *arguments]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1


@needs_latex
def test_it_compiles_within_its_margins(document: str, tmp_path: Path) -> None:
    (tmp_path / "formulas.tex").write_text(document, encoding="utf-8")
    compiled(tmp_path / "formulas.tex")
    # References are known in a second run.
    said = compiled(tmp_path / "formulas.tex")
    assert "multiply defined" not in said
    assert "Overfull" not in said
    assert (tmp_path / "formulas.pdf").stat().st_size > 10_000
