"""What holds for the package as a whole: imports, README, continuous integration."""

from __future__ import annotations

import importlib
import inspect
import re
import subprocess
import sys
import tomllib
from importlib import resources
from pathlib import Path

import pytest

import symasym as sa

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()
HEAVY = ("sympy", "matplotlib", "mpmath", "flint", "tqdm", "scipy", "dask")
RUN = "python3 -m venv .venv && .venv/bin/pip install . && .venv/bin/symasym reproduce"
TEST = "python3 -m venv .venv && .venv/bin/pip install -e '.[test]' && .venv/bin/pytest"


def loaded_by(code: str) -> set[str]:
    """Which of the heavy packages a fresh interpreter has loaded after `code`."""
    report = f"\nimport sys; print([name for name in {HEAVY} if name in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", code + report], check=True, capture_output=True, text=True
    )
    return set(re.findall(r"\w+", done.stdout.splitlines()[-1]))


def test_import_loads_nothing_heavy() -> None:
    assert loaded_by("import symasym") == set()


def test_float64_needs_neither_sympy_nor_matplotlib() -> None:
    scene = "sa.escape_time(sa.friction(mu=3, alpha=1, z0=[-1.0, -0.4]), 0.1, 10)"
    assert not loaded_by(f"import symasym as sa; {scene}") & {"sympy", "matplotlib"}


def test_expansions_need_neither_sympy_nor_matplotlib() -> None:
    drift = "import symasym as sa; d = sa.friction(mu=3, alpha=1, z0='-0.4')"
    for call in (
        "sa.escape_time(d, 9, 10, method='strong_noise')",
        "sa.exit_probability(d, '0.05', 10, method='laplace', log=True)",
    ):
        assert not loaded_by(f"{drift}; {call}") & {"sympy", "matplotlib"}


def test_digits_need_neither_sympy_nor_matplotlib() -> None:
    scene = "sa.escape_time(sa.friction(mu=3, alpha=1, z0='-0.4'), '0.1', 10, dps=30)"
    assert not loaded_by(f"import symasym as sa; {scene}") & {"sympy", "matplotlib"}


def test_every_public_name_is_there_and_documented() -> None:
    for name in sa.__all__:
        assert getattr(sa, name).__doc__, name


def test_signatures_say_what_a_verb_takes_and_returns() -> None:
    verbs = [x for name in sa.__all__ if inspect.isfunction(x := getattr(sa, name))]
    assert len(verbs) > 20
    for verb in verbs:
        signature = inspect.signature(verb)
        assert signature.return_annotation not in ("Any", inspect.Signature.empty), verb.__name__
        for given in signature.parameters.values():
            options = given.kind is inspect.Parameter.VAR_KEYWORD
            assert options or given.annotation != "Any", (verb.__name__, given.name)


def test_every_error_is_a_symasym_error() -> None:
    errors = [thing for thing in vars(sa).values() if isinstance(thing, type)]
    errors = [thing for thing in errors if issubclass(thing, Exception)]
    assert len(errors) >= 6
    assert all(issubclass(error, sa.SymasymError) for error in errors)


def test_readme_has_the_two_commands() -> None:
    assert re.findall(r"^    (python3 .*)$", README, re.MULTILINE) == [RUN, TEST]


def test_readme_shows_the_expansion_as_it_is_written() -> None:
    lines = sa.expand(sa.Drift.general(), "T", order=1).latex().splitlines()
    assert lines[1].replace("&", "") in README.splitlines()


def test_continuous_integration_runs_what_readme_says() -> None:
    script = (ROOT / ".ci" / "run").read_text()
    pattern = re.search(r"sed -n 's/(.*?)/", script)
    assert pattern is not None
    expression = pattern[1].replace(r"\(", "(").replace(r"\)", ")")
    assert re.findall(expression, README, re.MULTILINE) == [RUN, TEST]
    assert '"${commands[0]}"' in script
    assert '"${commands[1]}"' in script


def test_pictures_are_small() -> None:
    for picture in (ROOT / "docs" / "images").iterdir():
        assert picture.stat().st_size < 200_000, picture


def test_what_is_not_python_is_in_the_package() -> None:
    for name in ("py.typed", "symasym.mplstyle"):
        assert (resources.files("symasym") / name).is_file()


def test_declared_requirements_are_the_designed_ones() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    names = {re.match(r"[\w-]+", entry)[0] for entry in project["dependencies"]}  # type: ignore[index]
    assert names == {
        "matplotlib", "mpmath", "numpy", "python-flint", "scipy", "sympy", "tqdm"
    }  # fmt: skip
    assert set(project["optional-dependencies"]) == {"cluster", "test", "docs", "publish"}


def test_every_public_name_is_loaded_when_asked_for() -> None:
    import symasym

    assert set(symasym._HOMES) == set(symasym.__all__)
    for name in symasym.__all__:
        assert getattr(symasym, name).__name__ == name
    with pytest.raises(AttributeError, match="nothing"):
        _ = symasym.nothing


def test_a_module_does_not_hide_the_verb_of_its_name() -> None:
    import symasym

    for name in ("formula", "plan", "sensitivity"):
        importlib.import_module(f"symasym.{name}")
        assert callable(getattr(symasym, name))
