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


D = "import symasym as sa; d = sa.friction(mu=3, alpha=1, z0='-0.4'); "


@pytest.mark.parametrize(
    ("code", "without"),
    [
        ("import symasym", {*HEAVY}),
        (f"{D}sa.escape_time(d, 0.1, 10)", {"matplotlib"}),
        (f"{D}sa.exit_probability(d, '0.05', 10, method='laplace', log=True)", {"matplotlib"}),
    ],
)
def test_what_a_call_loads(code: str, without: set[str]) -> None:
    assert not loaded_by(code) & without


def test_every_public_name_is_there_and_documented() -> None:
    for name in sa.__all__:
        thing = getattr(sa, name)
        assert thing.__doc__, name
        assert thing.__name__ == name
        if inspect.isfunction(thing):
            returned = inspect.signature(thing).return_annotation
            assert returned is not inspect.Signature.empty, name
    with pytest.raises(AttributeError, match="nothing"):
        _ = sa.nothing


def test_every_error_is_a_symasym_error() -> None:
    errors = [thing for thing in vars(sa).values() if isinstance(thing, type)]
    errors = [thing for thing in errors if issubclass(thing, Exception)]
    assert len(errors) >= 6
    assert all(issubclass(error, sa.SymasymError) for error in errors)


def test_readme_has_the_two_commands() -> None:
    assert re.findall(r"^    (python3 .*)$", README, re.MULTILINE) == [RUN, TEST]


def test_continuous_integration_runs_what_readme_says() -> None:
    script = (ROOT / ".ci" / "run").read_text()
    pattern = re.search(r"sed -n 's/(.*?)/", script)
    assert pattern is not None
    expression = pattern[1].replace(r"\(", "(").replace(r"\)", ")")
    assert re.findall(expression, README, re.MULTILINE) == [RUN, TEST]
    assert '"${commands[0]}"' in script
    assert '"${commands[1]}"' in script


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


def test_a_module_does_not_hide_the_verb_of_its_name() -> None:
    for name in ("formula", "plan", "sensitivity"):
        importlib.import_module(f"symasym.{name}")
        assert callable(getattr(sa, name))
