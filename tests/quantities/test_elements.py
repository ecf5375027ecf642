"""Elements of arrays: refused ones are named or left out, and digits element by element."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

import symasym as sa

FRICTION = sa.friction(3, 1, "-0.4")
#: A verb, its options, and noises of which those that are False have no value.
REFUSED: list[tuple[Any, sa.Drift, dict[str, Any], dict[float, bool]]] = [
    # T is 1e1000000 at the first; the error of log T is beyond 1000 at the last.
    (
        sa.escape_time,
        FRICTION,
        {"r": 10},
        {1e-3: False, 0.1: True, 1e-4: False, 1.0: True, 1e-9: False},
    ),
    (sa.escape_time, FRICTION, {"r": 10}, {0.1: True, -1.0: False, 0.2: True, np.nan: False}),
    (
        sa.escape_time,
        FRICTION,
        {"r": 10, "method": "laplace"},
        {0.05: True, 3.0: False, 0.06: True, 2.0: False},
    ),
    (
        sa.escape_time,
        FRICTION,
        {"r": 10, "method": "strong_noise", "order": 2},
        {0.05: False, 30.0: True, 0.06: False, 200.0: True},
    ),
    (sa.occupation, sa.linear(1, -1), {"complement": True}, {0.01: False, 1.0: True}),
    (sa.stationary_density, sa.linear(1, -1), {"y": 3}, {0.01: False, 1.0: True}),
]


@pytest.mark.parametrize(("verb", "drift", "options", "noises"), REFUSED)
def test_refused_elements(
    verb: Any, drift: sa.Drift, options: dict[str, Any], noises: dict[float, bool]
) -> None:
    kappa, good = np.array(list(noises)), np.array(list(noises.values()))
    first = int(np.argmin(good))
    with pytest.raises(sa.SymasymError, match=rf"^at index \({first}\), .*errors='nan'"):
        verb(drift, kappa, **options)
    alone = np.array([verb(drift, float(k), **options) for k in kappa[good]])
    found = verb(drift, kappa[:, None], **options, errors="nan")
    assert found.shape == (len(kappa), 1)
    assert (np.isnan(found[:, 0]) == ~good).all()
    np.testing.assert_allclose(found[good, 0], alone, rtol=1e-9)
    estimate = verb(drift, kappa, **options, errors="nan", full=True)
    assert (estimate.mask == ~good).all()
    assert np.isfinite(estimate.error[good]).all()
    assert (np.abs(estimate.value[good] - alone) <= estimate.error[good] + 1e-9 * alone).all()
    one = float(kappa[first])
    if one > 0:
        assert np.isnan(verb(drift, one, **options, errors="nan"))
        assert verb(drift, one, **options, errors="nan", full=True).mask


def test_drifts_that_are_refused() -> None:
    drift = sa.linear([1.0, -1.0, 2.0], -1)
    with pytest.raises(sa.RegionError, match=r"^at index \(1\)"):
        sa.occupation(drift, 1)
    share = sa.occupation(drift, 1, errors="nan", full=True)
    assert share.mask.tolist() == [False, True, False]
    assert share.value[2] == sa.occupation(sa.linear(2, -1), 1)


LINE = sa.linear(1, -1)
#: Calls of which some elements are refused, and which: as a question's, or each by itself.
SOME: dict[str, tuple[Any, list[bool]]] = {
    "logarithm": (
        lambda **o: sa.escape_time(sa.Drift("log(2 + b*u)").bind(b=[1, 3]), 1, 2, **o),
        [True, False],
    ),
    "power": (
        lambda **o: sa.escape_time(sa.Drift("(2 + b*u)**(1/3)").bind(b=[3, 1]), 1, 2, **o),
        [False, True],
    ),
    "pole": (
        lambda **o: sa.escape_time(sa.Drift("1/(2 + b*u)").bind(b=[1, 3]), 1, 2, **o),
        [True, False],
    ),
    "kappa": (lambda **o: sa.escape_time(LINE, [0.5, -1, 0.6], 2, **o), [True, False, True]),
    "text": (lambda **o: sa.escape_time(LINE, [0.5, "abc"], 2, **o), [True, False]),
    "radius": (lambda **o: sa.exit_probability(LINE, 1, [2, -2], **o), [True, False]),
    "start": (lambda **o: sa.escape_time(LINE, 1, 1, start=[-2, 0], **o), [False, True]),
    "position": (lambda **o: sa.stationary_density(LINE, [0.5, -1], 0, **o), [True, False]),
    "tangency": (
        lambda **o: sa.escape_time(sa.linear([1, 0], 2), 0.1, 2, method="laplace", order=1, **o),
        [True, False],
    ),
    "paper's start": (
        lambda **o: sa.escape_time(FRICTION, 0.1, 10, start=[0, 0.5], method="paper", **o),
        [True, False],
    ),
}


@pytest.mark.parametrize(
    ("name", "digits"),
    [
        *((name, digits) for name in SOME for digits in ({}, {"dps": 15})),
        ("kappa", {"dps": 15, "workers": 2}),
        ("pole", {"dps": 15, "workers": 2}),
    ],
)
def test_refused_elements_of_any_kind(name: str, digits: dict[str, Any]) -> None:
    ask, good = SOME[name]
    with pytest.raises(sa.SymasymError, match=rf"^at index \({good.index(False)}\), "):
        ask(**digits)
    found = ask(errors="nan", **digits)
    assert [x == x for x in found] == good
    estimate = ask(errors="nan", full=True, **digits)
    assert (~estimate.mask).tolist() == good


@pytest.mark.parametrize("errors", ["raise", "nan"])
def test_what_refuses_all_elements_names_none(errors: str) -> None:
    for ask, why in (
        (lambda **o: sa.escape_time(LINE, [0.1, 0.5], 2, method="paper", **o), "a- = 1 and a"),
        (lambda **o: sa.exit_probability(LINE, [0.5, -1], 9, method="paper", **o), "a- = 1 and a"),
        (lambda **o: sa.escape_time(LINE, [-1, -2], 2, dps=15, **o), "(at index .0., )?kappa is -"),
    ):
        with pytest.raises(sa.SymasymError, match=f"^{why}") as caught:
            ask(errors=errors)
        assert "errors='nan'" not in str(caught.value)


def test_what_is_wrong_for_all_is_said() -> None:
    many: Any = np.array([0.1, 0.2])
    for options, wrong in (
        ({"order": 99, "method": "laplace"}, "order is 99"),
        ({"method": "none"}, "method is"),
        ({"errors": "ignore"}, "errors is 'ignore'"),
        ({"workers": 2}, "workers is 2"),
        ({"start": [0, 0, 0]}, "broadcast"),
    ):
        with pytest.raises(sa.InputError, match=rf"^(the )?\D*{wrong}"):
            sa.escape_time(FRICTION, many, 10, **({"errors": "nan"} | options))
    with pytest.raises(sa.InputError, match="kappa is -[12]"):
        sa.escape_time(FRICTION, -many * 10, 10, errors="nan")


@pytest.mark.parametrize("workers", [None, 2])
def test_arrays_with_digits(workers: int | None) -> None:
    kappa = ["0.1", "1/3", 0.5]
    z0 = np.array([[-0.4], [-0.25]])
    found = sa.escape_time(sa.friction(3, 1, z0), kappa, 10, dps=30, full=True, workers=workers)
    assert found.value.shape == found.error.shape == (2, 3)
    for j, z in enumerate(z0[:, 0]):
        for k, noise in enumerate(kappa):
            alone = sa.escape_time(sa.friction(3, 1, z), noise, 10, dps=30, full=True)
            assert found.value[j, k] == alone.value
            assert found.error[j, k] == alone.error
            assert isinstance(found.value[j, k], mpmath.mpf)
    assert found.error_kind == alone.error_kind


def test_a_script_that_cannot_be_imported_is_told(tmp_path: Path) -> None:
    script = tmp_path / "own.py"
    script.write_text(
        "import symasym as sa\n"
        "print(sa.escape_time(sa.linear(1, -1), [0.5, 1], 2, dps=20, workers=2))\n"
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=120)
    assert done.returncode == 1
    last = done.stderr.rstrip().rpartition("\n")[2]
    assert last.startswith("symasym.base.errors.SymasymError: workers is 2, and a process")
    assert "if __name__ == '__main__':" in last


def test_refused_elements_with_digits() -> None:
    with pytest.raises(sa.InputError, match=r"^at index \(1\), kappa is -1"):
        sa.escape_time(FRICTION, ["0.1", -1], 10, dps=20)
    drift = sa.linear([1, -1], -1)
    share = sa.occupation(drift, 1, dps=20, errors="nan")
    assert share[0] == sa.occupation(sa.linear(1, -1), 1, dps=20)
    assert mpmath.isnan(share[1])
    assert sa.occupation(drift, 1, dps=20, errors="nan", full=True).mask.tolist() == [False, True]


def test_a_probability_that_prints_1_points_to_its_complement() -> None:
    slides, leaves = sa.hill(1, -1, 0.5, n=2), sa.linear(-1, -1)
    for found in (
        sa.occupation(slides, 0.1, full=True),
        sa.occupation(slides, [1, 0.1], full=True),
        sa.occupation(slides, [1, 0.1], full=True, errors="nan"),
        sa.exit_probability(leaves, 0.1, 10, full=True, dps=10),
        sa.exit_probability(leaves, [0.1, -1], 10, full=True, dps=10, errors="nan"),
    ):
        assert found.notes[0].endswith("is 1 to these digits; complement=True has the rest")
    back = sa.exit_probability(sa.linear(1, 1), 0.1, 10, full=True, complement=True)
    assert back.notes == ("1 - C is 1 to these digits; leave complement out for the rest",)
    for found in (
        sa.occupation(slides, 1, full=True),
        sa.occupation(slides, 0.1, full=True, complement=True),
        sa.occupation(slides, 0.1, full=True, log=True),
        sa.escape_time(slides, 1, 1, full=True),
    ):
        assert found.notes == ()
