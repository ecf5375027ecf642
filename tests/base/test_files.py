"""Files are whole or not there, and reference values keep their promise."""

from __future__ import annotations

import errno
import json
import os
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf

from symasym import OutputError
from symasym.base.estimate import Estimate, interval_text
from symasym.base.files import read_json, reference_value, write_bytes


def fail_with(error: BaseException) -> Any:
    def function(*_: object, **__: object) -> None:
        raise error

    return function


def test_a_file_is_written_with_its_folder(tmp_path: Path) -> None:
    target = tmp_path / "a" / "b" / "out.txt"
    write_bytes(target, b"first")
    write_bytes(target, b"second")
    assert target.read_bytes() == b"second"
    assert os.listdir(target.parent) == ["out.txt"]


@pytest.mark.parametrize("step", ["fsync", "replace"])
@pytest.mark.parametrize(
    ("error", "raised"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), OutputError),
        (KeyboardInterrupt(), KeyboardInterrupt),
    ],
)
def test_a_failure_leaves_what_was_there(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    step: str,
    error: BaseException,
    raised: type[BaseException],
) -> None:
    target = tmp_path / "out.txt"
    write_bytes(target, b"before")
    monkeypatch.setattr(os, step, fail_with(error))
    with pytest.raises(raised):
        write_bytes(target, b"after")
    assert target.read_bytes() == b"before"
    assert os.listdir(tmp_path) == ["out.txt"]


def test_places_that_cannot_be_written_are_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "folder").mkdir()
    for target, reason in (
        (tmp_path / "file" / "out.txt", "file"),
        (tmp_path / "folder", "directory"),
    ):
        with pytest.raises(OutputError, match=reason) as caught:
            write_bytes(target, b"")
        assert str(target) in str(caught.value)
        assert "\n" not in str(caught.value)
    assert sorted(os.listdir(tmp_path)) == ["file", "folder"]


def test_unreadable_json_counts_as_none(tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    assert read_json(path) is None
    path.write_text('{"half')
    assert read_json(path) is None
    path.write_text('{"whole": 1}')
    assert read_json(path) == {"whole": 1}


@given(st.fractions().filter(bool), st.integers(-250, 250), st.integers(1, 60), st.integers(0, 30))
def test_the_true_value_lies_within_the_printed_radius(
    value: Fraction, exponent: int, dps: int, guard: int
) -> None:
    truth = value * Fraction(10) ** exponent
    with mp.workdps(dps + guard):
        rounded = mpf(truth.numerator) / truth.denominator
        error = abs(rounded) * mpf(10) ** -(dps + guard - 1)
    mid, rad = interval_text(rounded, error, dps, more=True)
    assert abs(Fraction(mid) - truth) <= Fraction(rad)
    # And no wider than the error plus one unit in the last digit.
    last_digit = abs(truth) * Fraction(10) ** -(dps - 1)
    assert Fraction(rad) <= Fraction(102, 100) * (
        Fraction(10) ** (1 - dps - guard) * abs(truth) * 2 + last_digit
    )


def test_a_reference_value_is_text_only() -> None:
    found = Estimate(mpf(2) ** 5000, mpf(2) ** 4900, "estimate", "exact")
    record = reference_value({"z0": "-0.4"}, found, 12)
    assert json.loads(json.dumps(record)) == record
    assert record["x"] == {"z0": "-0.4"}
    assert abs(Fraction(record["mid"]) / 2**5000 - 1) < Fraction(1, 10**11)
    assert record["error_kind"] == "estimate"
    assert record["dps"] == 12
    assert set(record["versions"]) >= {"symasym", "python", "mpmath"}
