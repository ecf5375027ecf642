"""All derivations of the paper: coverage, checks, mutation, cache, pages."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from itertools import islice
from pathlib import Path

import pytest
import sympy

import symasym as sa
from derivations import registry, report, runner
from derivations.labels import DEFINITIONS, PAPER, REASONS, UNLABELLED
from symasym.base.errors import InputError
from symasym.commands import main as cli
from symasym.commands.show import pretty
from symasym.derivation import DerivationError, Identity, mutation_test
from symasym.derivation.mutation import mutants
from symasym.formula import formula
from tests.latex import compiled, needs_latex
from tests.processes import spent_by_children

ROOT = Path(__file__).parents[2]
# Beside the repository, or beside the folder that holds a worktree of it.
PAPER_SOURCE = next(
    (source for parent in ROOT.parents if (source := parent / "shared" / "paper.tex").is_file()),
    None,
)


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """A copy of the sources: keys of the cache are hashes, and someone may be editing."""
    folder = tmp_path_factory.mktemp("tree")
    _copy_sources(folder)
    return folder


def _copy_sources(folder: Path) -> None:
    for package in ("derivations", "symasym"):
        shutil.copytree(
            ROOT / package, folder / package, ignore=shutil.ignore_patterns("__pycache__")
        )


def _python(folder: Path, program: str, *arguments: str) -> str:
    """What a program prints that takes its modules from `folder`."""
    return subprocess.run(
        [sys.executable, "-c", program, *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder)},
        text=True,
        capture_output=True,
        check=True,
    ).stdout


_DERIVE = (
    "import sys, json; from pathlib import Path\n"
    "from derivations.report import derive\n"
    "found = derive(sys.argv[2:], Path(sys.argv[1]))\n"
    "print(json.dumps(found))\n"
)


@pytest.fixture(scope="module")
def records(tree):
    """Every derivation verified once, from nothing."""
    out = tree / "out"
    begun = spent_by_children()
    found = json.loads(_python(tree, _DERIVE, str(out)))
    return found, out, spent_by_children() - begun


def test_every_check_passes_in_time(records, capsys):
    found, _, seconds = records
    assert set(found) == set(registry.entries())
    assert all(step["passed"] for record in found.values() for step in record["steps"])
    with capsys.disabled():
        steps = sum(len(r["steps"]) for r in found.values())
        print(f"\n{len(found)} derivations, {steps} steps in {seconds:.1f} s")
    assert seconds < 120


def test_every_label_is_derived_or_has_a_reason():
    derived = set(registry.entries())
    for label in PAPER:
        assert (label in derived) != (label in REASONS), label
        if label in REASONS:
            assert len(REASONS[label]) > 20
    assert set(UNLABELLED) <= derived
    assert set(REASONS) <= set(PAPER)
    assert derived == (set(PAPER) - set(REASONS)) | set(UNLABELLED)
    assert len([label for label in PAPER if label.startswith("eq:")]) == 47


@pytest.mark.skipif(PAPER_SOURCE is None, reason="the paper's source is not beside the repo")
def test_the_list_of_labels_is_the_papers():
    text = PAPER_SOURCE.read_text(encoding="utf-8")
    printed = {
        label
        for label in re.findall(r"\\label\{([^}]*)\}", text)
        if not label.startswith(("fig:", "sec:", "sub:"))
    }
    assert printed == set(PAPER)


@pytest.mark.parametrize("every", [24, pytest.param(1, marks=pytest.mark.slow)])
def test_mutation_kills_every_step(every, capsys):
    derivations = [registry.build(label) for label in list(registry.entries())[::every]]
    killed, steps, changes, survivors = mutation_test(derivations)
    with capsys.disabled():
        print(f"\nmutation: {killed} of {steps} steps killed, {changes} changes")
        for survivor in survivors:
            print(f"  {survivor}")
    assert not survivors
    assert killed == steps


@pytest.mark.parametrize(
    "order", [2, *(pytest.param(n, marks=pytest.mark.slow) for n in (1, 3, 5, 8))]
)
@pytest.mark.parametrize("series", ["saddle-series", "saddle-start"])
def test_a_series_is_derived_to_the_order_asked_for(series, order, tmp_path):
    """Its steps pass and each dies of a change; its coefficients are those of `sa.expand`."""
    label = f"{series}-{order}"
    record = runner.run([label], tmp_path)[label]
    assert all(step["passed"] for step in record["steps"])
    derivation = registry.build(label)
    for step in derivation.steps:
        alive = [c for c, mutant in islice(mutants(step.result), 0, None, order**3)
                 if step.run(mutant).passed]  # fmt: skip
        assert not alive, step.name
    if series == "saddle-start":
        assert derivation.rests_on == (f"saddle-series-{order}",)
        # A = b u + c u^2, -V with the derivatives b and 2 c: R ~ B0/2 + O0 + ...
        e = sa.expand(
            sa.Drift("b*u + c*u**2"), "C", order=order, case="start=barrier", patience=120
        )
        of, (b, x) = {s.name: s for s in e.definitions}, sympy.symbols("b x", positive=True)
        c = sympy.Symbol("c", real=True)
        put = {of["V''(0)"]: -b, of["V'''(0)"]: -2 * c, of["x"]: x}
        half = (e.definitions[of["B0"]] / 2 + e.definitions[of["O0"]]).subs(put)
        values = {"c_2": b, "c_3": 2 * c, "lam": 1 / x}
        want = derivation.result.leading
        want = want.subs({s: values.get(s.name, 0) for s in want.free_symbols})
        assert sympy.simplify(half - want * sympy.sqrt(2 * sympy.pi * x / b)) == 0
        return
    # With a parabola for the barrier the rest is the well's.
    last = sa.expand(sa.Drift.general(), order=order, patience=120).terms[0].coefficients[-1]
    own = {s.name: s for s in derivation.result.leading.free_symbols}
    put = {}
    for s in last.free_symbols:
        j = int(s.name[3 : s.name.index(")")]) if "^" in s.name else s.name.count("'")
        put[s] = own.get(f"c_{j}", 0) if s.name.endswith("(u1)") else -1 if j == 2 else 0
    lam = derivation.result.variable
    assert (
        sympy.expand(last.subs(put) * 2**order - derivation.result.leading.coeff(lam, -order)) == 0
    )


def test_both_routes_to_the_escape_time_are_independent():
    assert "backward" not in registry.closure(["eq:Ttilde"])
    backward = registry.build("backward")
    first = backward.steps[0]
    assert first.name.startswith("first integral of (kappa^2/2) T''")
    assert backward.steps[-1].name == "the same as eq:Ttilde"


def test_the_table_of_regions_is_what_drifts_report():
    from derivations.sections.section4_reduction import REGIONS
    from symasym import linear

    names = {0: "repelling sliding", 1: "crossing", 2: "sliding"}
    for (minus, plus), number in zip(REGIONS, registry.build("regions").result, strict=True):
        assert linear(minus, 2 * plus).region == names[int(number)]


# -- the runner -----------------------------------------------------------------------------


def test_one_formula_runs_what_it_rests_on_and_nothing_else(tree, tmp_path):
    program = _DERIVE + (
        "modules = sorted(m for m in sys.modules if m.startswith('derivations.sections.section'))\n"
        "print(json.dumps(modules))\n"
    )
    found, modules = map(json.loads, _python(tree, program, str(tmp_path), "folds").splitlines())
    # Sections that define nothing it needs are not even imported.
    assert "derivations.sections.section6.well" not in modules
    assert list(found) == registry.closure(["folds"])
    assert set(found) == {
        "folds",
        "cubic",
        "beta",
        "turning-points",
        "eq:forcePerturbed",
        "eq:phifric0",
        "eq:osc3",
        "eq:osc2",
        "eq:phi",
        "eq:cont",
    }
    cache = tmp_path / "cache"
    assert {p.stem for p in cache.iterdir()} == {runner.slug(label) for label in found}


def test_a_second_run_checks_nothing(tree, records):
    _, out, _ = records
    program = (
        "import sys\n"
        "from derivations.__main__ import main\n"
        "status = main(['derive', '--out', sys.argv[1]])\n"
        "assert status == 0 and 'sympy' not in sys.modules\n"
    )
    assert "0.0 s of checks" in _python(tree, program, str(out))


_COUNT = (
    "import sys; sys.path.insert(0, '.')\n"
    "from pathlib import Path\n"
    "from derivations.runner import run\n"
    "cache = Path('cache')\n"
    "for text in sys.argv[1:] or [None]:\n"
    "    if text is not None:\n"
    "        (cache / 'eq-V.json').write_text(text)\n"
    "    found = run(['eq:osc2', 'eq:V', 'filippov'], cache)\n"
    "    print(*sorted(k for k, r in found.items() if not r['reused']))\n"
)


def _rerun(folder: Path) -> list[str]:
    """What is derived again after sources or files of the cache have changed."""
    return _python(folder, _COUNT).split()


def test_the_cache_is_never_stale(tmp_path):
    _copy_sources(tmp_path)
    assert _rerun(tmp_path) == ["eq:V", "eq:osc2", "filippov"]
    assert _rerun(tmp_path) == []
    # A line of one section: its derivations alone.
    section = tmp_path / "derivations" / "sections" / "section7_friction.py"
    section.write_text(section.read_text() + "\n# one more line\n")
    assert _rerun(tmp_path) == ["eq:osc2"]
    # A line of the engine: everything.
    engine = tmp_path / "symasym" / "derivation" / "proofs.py"
    engine.write_text(engine.read_text() + "\n# one more line\n")
    assert _rerun(tmp_path) == ["eq:V", "eq:osc2", "filippov"]
    # A damaged record is no record, nor is one that is missing, or another label's.
    record = tmp_path / "cache" / "eq-V.json"
    whole = record.read_text()
    anothers = (tmp_path / "cache" / "filippov.json").read_text()
    changed = whole.replace('"passed": true', '"passed": 1')
    damaged = ["{", "", "[]", "null", whole[:-40], changed, anothers]
    printed = _python(tmp_path, _COUNT, *damaged, whole).splitlines()
    assert printed == ["eq:V"] * len(damaged) + [""]
    record.unlink()
    assert _rerun(tmp_path) == ["eq:V"]
    assert _rerun(tmp_path) == []


def test_a_key_covers_every_source_it_can_reach():
    names = {path.name for path in runner.sources("derivations.sections.section7_friction")}
    assert {
        "section7_friction.py",
        "paper.py",
        "reduction.py",
        "proofs.py",
        "drift.py",
        "runner.py",
    } <= names
    assert "well.py" not in names
    assert "well.py" in {path.name for path in runner.sources("derivations.sections.section6.well")}


def test_a_broken_derivation_ends_with_the_step_and_a_point(monkeypatch):
    derivation = registry.build("fr1")
    step = derivation.steps[0]
    from dataclasses import replace

    # The paper's own slip put in the derivation's place.
    from derivations.paper import alpha, z0

    wrong = replace(step, result=1 - z0 + alpha)
    monkeypatch.setattr(derivation, "steps", [wrong, *derivation.steps[1:]])
    with pytest.raises(DerivationError) as error:
        derivation.verify()
    message = str(error.value)
    assert "fr1, step 'a+' (evaluate): the check (symbolic identity) fails" in message
    assert re.search(r"Left: -?\d.*Right: -?\d.*At: alpha = ", message)


def test_every_hypothesis_has_a_known_status():
    from symasym.derivation.chain import STATUSES

    for label in registry.entries():
        for line in registry.build(label).hypotheses:
            assert line.status in STATUSES
            assert line.status == "assumed" or line.check is not None


def test_every_step_is_a_relation_and_the_first_is_no_answer():
    """No step shows an expression alone, and none of the first states what is derived."""
    relation = re.compile(r"=|\\sim|\\to\b|\\le\b|\\ge\b|[<>]")
    for label in registry.entries():
        derivation = registry.build(label)
        shown = [step.latex(derivation.names) for step in derivation.steps]
        for row in (row for step in shown for row in step.split(r" ,\quad ")):
            assert relation.search(row), (label, row)
        assert shown[0] != derivation.latex(), label


def test_steps_use_what_they_rest_on():
    """Every label named in `use` is declared; nothing is declared that has no derivation."""
    for label, entry in registry.entries().items():
        derivation = registry.build(label)
        with pytest.raises(ValueError, match="without resting on it"):
            derivation.use("no such label")
        assert derivation.rests_on == entry.rests_on
        assert all(isinstance(s.check, object) and s.check.how() for s in derivation.steps)


# -- the pages ------------------------------------------------------------------------------


def test_trace(records):
    found, out, _ = records
    trace = json.loads((out / "trace.json").read_text(encoding="utf-8"))
    assert trace["schema"] == runner.SCHEMA == "symasym-derivation/1"
    assert {r["label"] for r in trace["derivations"]} == set(found)
    for record in trace["derivations"]:
        for step in record["steps"]:
            assert {
                "name",
                "rule",
                "kind",
                "how",
                "result",
                "latex",
                "passed",
                "detail",
                "seconds",
            } <= set(step)
            assert step["passed"] is True
            assert step["seconds"] >= 0


def test_a_page_and_a_snippet_per_label(records):
    found, out, _ = records
    for label, record in found.items():
        page = (out / f"{runner.slug(label)}.md").read_text(encoding="utf-8")
        assert page.startswith(f"# {label}: ")
        # With a capital letter, where a sentence begins.
        assert all(report.words(step["name"])[1:] in page for step in record["steps"])
        exact = ("difference is exactly 0", "holds exactly")
        equal = [s for s in record["steps"] if s["detail"].startswith(exact)]
        assert page.count("Checked symbolically") == len(
            [step for step in equal if step["kind"] == "symbolic identity"]
        )
        snippet = (out / f"{runner.slug(label)}.tex").read_text(encoding="utf-8")
        # A formula a step and one for the conclusion; cases stand apart.
        assert (
            len(re.findall(r"(?<!\\)\\\[", snippet)) == snippet.count("\\]") > len(record["steps"])
        )
    assert "lambda" not in "".join(p.read_text() for p in out.glob("*.md")).replace("\\lambda", "")


def test_a_few_labels_do_not_shrink_the_trace(tree, records):
    found, out, _ = records
    _python(tree, _DERIVE, str(out), "folds")
    trace = json.loads((out / "trace.json").read_text(encoding="utf-8"))
    assert len(trace["derivations"]) == len(found)


@needs_latex
def test_snippets_compile(records, tmp_path):
    found, out, _ = records
    names = [f"{runner.slug(label)}.tex" for label in found]
    for name in names:
        shutil.copy(out / name, tmp_path / name)
    inputs = "\n".join(f"\\input{{{name}}}" for name in names)
    (tmp_path / "all.tex").write_text(
        "\\documentclass{article}\n\\usepackage{amsmath}\n\\begin{document}\n"
        f"{inputs}\n\\end{{document}}\n",
        encoding="utf-8",
    )
    compiled(tmp_path / "all.tex")


def test_text_for_latex():
    assert report.tex_text("a_b <= 50% ^ {x}") == ("a\\_b $<$= 50\\% \\textasciicircum{} \\{x\\}")


# -- commands -------------------------------------------------------------------------------


def _command(*arguments: str, capsys) -> tuple[int, str, str]:
    status = cli.main(list(arguments))
    captured = capsys.readouterr()
    return status, captured.out, captured.err


def test_show(capsys):
    status, out, _ = _command("show", "eq:Ttildesmall", "--steps", capsys=capsys)
    assert status == 0
    assert "Assumes: " in out
    assert "1. sum (substitute; symbolic identity)" in out
    status, out, _ = _command("show", "folds", "--latex", capsys=capsys)
    assert out.strip().startswith("z_0^{(+)}")
    status, out, _ = _command("show", "saddle-series-3", "--steps", capsys=capsys)
    assert "Error: O(lam^-4)" in out
    assert "7. third correction (evaluate; symbolic identity)" in out
    # The verb knows it, too, and no other order.
    assert pretty(sa.formula("saddle-series-3")) in out
    assert sa.formula("saddle-series-3").trace[6]["name"] == "third correction"
    for label in ("saddle-series-9", "folds-1", "fr3", "saddle-series-"):
        with pytest.raises(InputError, match="is no formula"):
            sa.formula(label)


@pytest.mark.parametrize("label", REASONS)
def test_a_definition_is_shown_with_its_formula(label, capsys):
    status, out, _ = _command("show", label, capsys=capsys)
    assert status == 0
    text, reason = out.strip().split("\n\n")
    assert text == DEFINITIONS[label].text
    assert reason == REASONS[label]
    _, out, _ = _command("show", label, "--latex", capsys=capsys)
    assert out.strip() == DEFINITIONS[label].latex
    with pytest.raises(InputError, match="is not derived"):
        formula(label)
    assert DEFINITIONS[label].latex in "\n".join(report.definitions())


def test_derive_command(capsys, tmp_path):
    status, out, _ = _command("derive", "fr1", "--out", str(tmp_path), capsys=capsys)
    assert status == 0
    assert "a+ (evaluate; symbolic identity)" in out
    status, out, _ = _command("derive", "saddle-series-3", "--out", str(tmp_path), capsys=capsys)
    assert status == 0
    assert "third correction (evaluate; symbolic identity)" in out
    status, _, err = _command("derive", "saddle-series-9", "--out", str(tmp_path), capsys=capsys)
    assert status == 2
    assert "saddle-series-9 is no label" in err
    status, _, err = _command("derive", "eq:nothing", "--out", str(tmp_path), capsys=capsys)
    assert status == 2
    assert "eq:nothing is no label that is derived; symasym show --all lists them." in err
    status, _, err = _command("derive", "Ttilde", "--out", str(tmp_path), capsys=capsys)
    assert status == 2
    assert "perhaps you mean 'eq:Ttilde'." in err
    (tmp_path / "file").write_text("mine")
    status, _, err = _command("derive", "fr1", "--out", str(tmp_path / "file"), capsys=capsys)
    assert status == 2
    assert "cannot be written" in err
    assert cli.main(["show", "nothing"]) == 2


def test_derive_command_reports_a_failure(capsys, tmp_path, monkeypatch):
    from dataclasses import replace

    derivation = registry.build("filippov")
    step = replace(derivation.steps[0], check=Identity(lambda: 0 * derivation.steps[0].result))
    monkeypatch.setattr(derivation, "steps", [step])
    status, _, err = _command("derive", "filippov", "--out", str(tmp_path), capsys=capsys)
    assert status == 1
    assert "share of f+" in err


def test_nothing_is_kept_of_sources_edited_meanwhile(tmp_path, monkeypatch):
    monkeypatch.setattr(runner, "_BEGUN", float("inf"))  # no source is younger than that
    runner.run(["eq:osc2"], tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["eq-osc2.json"]
    (tmp_path / "eq-osc2.json").unlink()
    monkeypatch.setattr(runner, "_BEGUN", 0.0)  # every source is younger than this process
    assert runner.run(["eq:osc2"], tmp_path)["eq:osc2"]["reused"] is False
    assert not list(tmp_path.iterdir())
