"""The commands of the workshop: ``symasym reproduce``, ``figure``, ``verify``, ``report``."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Any

from symasym.base.errors import InputError
from symasym.base.files import write_bytes


def reproduce(*, out: str = "build", only: Any = (), dps: int = 50, force: bool = False) -> None:
    """Make the paper's figures, reference values, standard problems and the derivations.

    They are written to build unless --out says otherwise; what is up to date stays.

    examples:
      symasym reproduce --only phase
      symasym reproduce --dps 30 --out build
    """
    from symasym.workshop import reproduce as workshop

    folder = Path(out)
    for stage, seconds in workshop.reproduce(folder, only or None, dps, force):
        spent = "up to date" if seconds is None else f"{seconds:.1f} s"
        files = ", ".join(str(folder / name) for name in stage.files)
        if len(stage.files) >= 5:
            files = f"{folder / stage.name}, {stage.steps} derivations whose checks pass"
        print(f"{stage.name}: {files} ({spent})", flush=True)
    if worst := workshop.worst_disagreement(folder):
        record, off, scenes = worst
        print(
            f"The paper's formula is farthest from the exact escape time at mu = "
            f"{record['x']['mu']}, kappa = {record['physical']['kappa']}, "
            f"z0 = {record['x']['z0']}: {float(record['paper']):.6g} instead of "
            f"{float(record['mid']):.6g}, "
            f"{100 * off:.3g} % off (the worst of the {scenes} scenes of the reference table)."
        )
        frozen, whole = workshop.frozen_and_whole()
        print(
            "T has z frozen: at mu = 3, kappa = 0.01, z0 = -0.4 it is "
            f"{frozen:.4g} units of eps, and the whole oscillator, whose belt moves z, releases "
            f"the block after {whole:.4g}."
        )


def figure(name: str | None = None, *, out: Any = ()) -> None:
    """Draw one of the paper's figures from the model and print its caption.

    It is written to NAME.png and NAME.svg, or to the .png, .svg and .pdf files of --out, which
    may be repeated. Without a name the figures are listed.

    examples:
      symasym figure fric1 -o fric1.svg
      symasym figure phase
    """
    from symasym.workshop.figures import FIGURES, KINDS, encode

    if name is None:
        for known, draw in FIGURES.items():
            print(f"{known:16} {str(draw.__doc__).partition(chr(10))[0]}")
        return
    if name not in FIGURES:
        raise InputError(f"{name} is no figure; the figures are {', '.join(FIGURES)}.")
    files = out or [f"{name}.png", f"{name}.svg"]
    for file in files:
        if Path(file).suffix[1:] not in KINDS:
            raise InputError(f"{file!r} has no ending that is drawn; end it in .png, .svg or .pdf.")
    drawn = FIGURES[name]()
    for file in files:
        write_bytes(file, encode(drawn, Path(file).suffix[1:]))
        print(Path(file))
    print(textwrap.fill(str(drawn.get_label()), 100))


def verify(*, level: str = "quick", seed: int = 1) -> int:
    """Hold every method's stated error against the truth, on all scenes.

    Status 1 if an error is above the stated one.

    examples:
      symasym verify
      symasym verify --level full --seed 2
    """
    from symasym.workshop import check

    found, table = check.verify(level, seed)
    print(table)
    return 0 if all(r.holds for r in found) else 1


def report(*, scene: Any = (), quick: bool = False, out: str = "build/report") -> int:
    """Measure error against run time, of all methods and other programs.

    Status 1 if one of our methods claims more digits than are right.

    examples:
      symasym report --quick
      symasym report --scene "friction k=1"
    """
    from symasym.workshop import check

    found, paths = check.report(out, scene or None, quick)
    for path in paths:
        print(path)
    for r in (wrong := [r for r in found if not r.holds]):
        print(f"{r.scene}, {r.method}: states {r.stated:.2g}, is off by {r.error:.2g}")
    return 1 if wrong else 0
