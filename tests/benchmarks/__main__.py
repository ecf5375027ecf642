"""Measure symasym against its peers and print the tables of docs/speed.md.

    python -m tests.benchmarks [--long] [--cap SECONDS] [--only PART ...] [--write FILE]

Without --long the quadratures that take minutes are left out. --write puts the tables
between the two markers of a Markdown file, which must be there; with --only the other parts stay.
"""

from __future__ import annotations

import argparse
import math
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from mpmath import mp, mpf

import symasym as sa
from symasym.base.files import write_bytes
from symasym.workshop.report import peers
from symasym.workshop.report.pages import table
from symasym.workshop.report.pages import time_text as _time
from symasym.workshop.report.timing import (
    capped,
    interleaved,
    load,
    machine,
    peaks,
    python,
    seconds,
    wall,
)

START, END = "<!-- measured: start -->", "<!-- measured: end -->"

R = 10
Z0 = np.linspace(-2.0, -1e-6, 400)[:, None]
KAPPAS = np.array([0.1, 0.2, 0.5, 1.0])
SHAPES: tuple[Any, ...] = (3, "1/2")
STIFF = ("1e-8", "1e-6", "1e-4", "1e-2", "0.05", "0.1", "1", "1e2", "1e4")


class Row(NamedTuple):
    """One line of the summary: the ratio measured, and what it should be."""

    what: str
    measured: float
    target: float
    at_least: bool
    note: str = ""

    def cells(self) -> list[str]:
        return [self.what, self.note + _number(self.measured)]

    def missed(self) -> str:
        """What is missed, for who measures; empty where the ratio is as it should be."""
        bound = f"at {'least' if self.at_least else 'most'} {_number(self.target)}"
        met = self.measured >= self.target if self.at_least else self.measured <= self.target
        return "" if met else f"{self.what}: {_number(self.measured)}, should be {bound}"


class Part(NamedTuple):
    rows: list[Row]
    text: list[str]


def _number(x: float) -> str:
    return f"{x:,.0f}" if x >= 100 else f"{x:.3g}"


def _friction(z0: Any = "-0.3", mu: Any = 3) -> sa.Drift:
    return sa.friction(mu=mu, alpha=1, z0=z0)


# -- 30 digits --------------------------------------------------------------------------------


def thirty_digits(options: argparse.Namespace) -> Part:
    c = peers.coefficients(3, "-0.3")
    rows, lines = [], []
    for kappa, arb_target in (("1", None), ("0.3", 50), ("0.1", 1000)):

        def ours(kappa: str = kappa) -> Any:
            return sa.escape_time(_friction(), kappa, R, dps=30)

        # Bound to 45 digits in ball arithmetic, by another engine than the one timed.
        proved = sa.escape_time(_friction(), kappa, R, dps=45, full=True)
        ours()
        noise = Fraction(kappa)
        arb = [
            lambda tuned=tuned, noise=noise: peers.arb_escape_time(c, noise, R, 30, tuned)
            for tuned in (False, True)
        ]
        runs = 2 if kappa == "0.1" else 7
        t_ours, t_arb, _, t_tuned, _ = interleaved(ours, arb[0], ours, arb[1], ours, runs=runs)
        found: list[tuple[str, float, Any, int | None]] = [
            ("Arb, nested `acb.integral`", t_arb, _middle(arb[0]()), arb_target),
            ("the same, exponentials joined", t_tuned, _middle(arb[1]()), None),
        ]
        if options.long:
            for form, (name, target) in _MPMATH.items():
                time, value = capped(
                    lambda form=form, noise=noise: peers.mpmath_escape_time(c, noise, R, 30, form),
                    options.cap,
                )
                found.append((name, time, value, target))
                t_ours = min(t_ours, *(seconds(ours) for _ in range(15)))
        for name, time, value, target in found:
            if target:
                what = f"30 digits, kappa = {kappa}: time of {name}, over ours"
                note = "more than " if value is None else ""
                rows.append(Row(what, time / t_ours, target, True, note))
        found.insert(0, ("symasym", t_ours, ours(), None))
        for name, time, value, _ in found:
            ended = value is not None
            lines.append(
                [
                    kappa,
                    name,
                    _time(time) if ended else f"stopped after {_time(time)}",
                    _number(time / t_ours),
                    _digits(value, proved) if ended else "",
                ]
            )
    text = [
        "T at mu = 3, alpha = 1, z0 = -3/10, r = 10, from 0. Right digits are counted against a "
        "ball of 45 digits that `exact/balls.py` proves.",
        table(["kappa", "by", "time", "times ours", "right digits"], lines),
        _pari(),
    ]
    if not options.long:
        text.append("Nested `mpmath.quad` was left out; `--long` includes it.")
    return Part(rows, text)


_MPMATH = {
    "printed": ("`mpmath.quad`, nested as printed", None),
    "cut": ("`mpmath.quad`, nested, split at the kinks", 5000),
    "scaled": ("`mpmath.quad`, nested, split and scaled", 5000),
    "tuned": ("the same, inner pieces factored out", None),
}


def _middle(ball: Any) -> Any:
    with mp.workdps(60):
        return mpf(ball.mid().str(50, radius=False))


def _digits(value: Any, proved: Any) -> str:
    with mp.workdps(60):
        error = (abs(value - proved.value) + proved.error) / proved.value
        return str(max(0, int(-mp.log10(error))))


def _pari() -> str:
    if shutil.which("gp"):
        return "PARI/GP is here, but this table does not time it."
    return "PARI/GP (`gp`) is not installed on this machine and was not measured."


# -- more digits ------------------------------------------------------------------------------


def many_digits(options: argparse.Namespace) -> Part:
    counts = (30, 100, 300, 1000, 3000, 10000)

    def at(dps: int) -> Callable[[], Any]:
        return lambda: sa.escape_time(_friction(), "0.3", R, dps=dps)

    short = interleaved(*map(at, counts[:4]), runs=25)
    long = interleaved(at(100), *map(at, counts[4:]), runs=3)
    times = dict(zip(counts, short + long[1:], strict=True))
    times[100] = min(times[100], long[0])
    span = [n for n in counts if n >= 100]
    logs = [math.log10(times[n]) for n in span]
    whole = (logs[-1] - logs[0]) / 2
    steps = [
        (b - a) / math.log10(n / m)
        for m, n, a, b in zip(span, span[1:], logs, logs[1:], strict=False)
    ]
    cells = [[str(n), _number(times[n] / times[30])] for n in counts[1:]]
    return Part(
        [
            Row("1,000 digits over 30 digits, kappa = 0.3", times[1000] / times[30], 40, False),
            Row("exponent of the time's growth, 100 to 10,000 digits", whole, 1.8, False),
        ],
        [
            "The same scene at kappa = 0.3, and the time of 30 digits in turn with them.",
            table(["digits", "over 30 digits"], cells),
            f"The steepest step between neighbours has the exponent {max(steps):.2f}.",
        ],
    )


# -- float64 ----------------------------------------------------------------------------------


def grid(options: argparse.Namespace) -> Part:
    drifts = [_friction(Z0, mu) for mu in SHAPES]
    points = len(SHAPES) * Z0.size * KAPPAS.size

    def ours() -> list[Any]:
        return [sa.escape_time(drift, KAPPAS, R, log=True) for drift in drifts]

    values = ours()
    random = np.random.default_rng(options.seed)
    each = 20 if options.long else 8
    sample = [
        (s, i, k)
        for k in range(KAPPAS.size)
        for s, i in zip(
            random.integers(len(SHAPES), size=each),
            random.integers(Z0.size, size=each),
            strict=True,
        )
    ]
    with mp.workdps(40):
        exact = {
            (s, i, k): mp.log(
                sa.escape_time(_friction(float(Z0[i, 0]), SHAPES[s]), float(KAPPAS[k]), R, dps=25)
            )
            for s, i, k in sample
        }

    def error(found: dict[Any, float]) -> float:
        return max(float(abs(found[p] - x) / max(1, abs(x))) for p, x in exact.items())

    t_ours = min(seconds(ours) for _ in range(9))
    lines, fastest = [], math.inf
    for factorised in (False, True):
        for epsrel in (1.49e-8, 1e-12):
            found, times, warned = {}, {}, 0
            for s, i, k in sample:
                c = peers.coefficients(SHAPES[s], float(Z0[i, 0]))
                with warnings.catch_warnings(record=True) as caught:
                    warnings.simplefilter("always")

                    settings = c, float(KAPPAS[k]), R, epsrel, factorised

                    def peer(settings: Any = settings) -> float:
                        return peers.scipy_log_escape_time(*settings)

                    found[s, i, k] = peer()
                    times[s, i, k] = seconds(peer)
                    warned += bool(caught)
            t_ours = min(t_ours, *(seconds(ours) for _ in range(3)))
            total = statistics.fmean(times.values()) * points
            worst = error(found)
            if worst <= 1e-12 and not factorised:
                fastest = min(fastest, total)
            name = "`dblquad`, rectangles factored into `quad`s" if factorised else "`dblquad`"
            lines.append([f"{name}, epsrel {epsrel:g}", total, worst, warned])
    cells = [
        [name, _time(total), _number(total / t_ours), f"{worst:.1e}", str(warned)]
        for name, total, worst, warned in lines
    ]
    of_ours = error({(s, i, k): float(values[s][i, k]) for s, i, k in sample})
    cells.insert(0, ["symasym", _time(t_ours), "1", f"{of_ours:.1e}", "0"])
    per_kappa = ", ".join(
        f"{_time(min(seconds(f) for _ in range(5)) / Z0.size / len(SHAPES))} at {kappa:g}"
        for kappa in KAPPAS
        for f in [lambda kappa=kappa: [sa.escape_time(d, kappa, R, log=True) for d in drifts]]
    )

    return Part(
        [
            Row(
                f"float64, {points:,} points: time of `dblquad` over ours",
                fastest / t_ours,
                1000,
                True,
            ),
        ],
        [
            f"log T at {points:,} points: {Z0.size} values of z0 from -2 to -1e-6, kappa = 0.1, "
            f"0.2, 0.5, 1, mu = 3 and 1/2. `dblquad` was run on {len(sample)} of them, as many for "
            "each kappa, and its time scaled up; errors are relative (absolute where log T is "
            "below 1), against 25 digits, the worst of those points.",
            table(["by", "all points", "times ours", "worst error", "points with warnings"], cells),
            f"A point takes us {per_kappa}.",
        ],
    )


# -- NumPy by hand ----------------------------------------------------------------------------


_C_MAIN = """
#include <stdio.h>
#include <time.h>

int main(void)
{
    const double kappas[] = {KAPPAS};
    for (int k = 0; k < (int)(sizeof kappas / sizeof *kappas); k++) {
        double least = 1e300, total = 0;
        for (int run = 0; run < 7; run++) {
            const clock_t start = clock();
            for (int i = 0; i < 800; i++)
                total += log_Ttilde(kappas[k], RADIUS, i % 2 ? 3 : 0.5, 1, -2 + i / 400.001);
            const double spent = (double)(clock() - start) / CLOCKS_PER_SEC / 800;
            least = spent < least ? spent : least;
        }
        printf("%.17g %.17g\\n", least, total);
    }
}
"""


def in_c(kappas: Sequence[float]) -> list[float]:
    """Seconds a point of the exact time as emitted C, compiled with -O2; nan without a compiler."""
    compiler = shutil.which("cc")
    if compiler is None:
        return [math.nan] * len(kappas)
    text = sa.emit("eq:Ttilde", "c", drift=sa.friction()) + _C_MAIN
    text = text.replace("KAPPAS", ", ".join(map(repr, kappas))).replace("RADIUS", str(R))
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "time"
        place.with_suffix(".c").write_text(text)
        command = [compiler, "-O2", "-o", str(place), f"{place}.c", "-lm"]
        subprocess.run(command, check=True)
        told = subprocess.run([str(place)], check=True, capture_output=True, text=True).stdout
    return [float(line.split()[0]) for line in told.splitlines()]


def by_hand(options: argparse.Namespace) -> Part:
    rows: list[Row] = []
    lines = []
    kappas = (1.0, 0.5, 0.2, 0.1, 0.05)
    emitted = dict(zip(kappas, in_c(kappas), strict=True))
    both = np.array([[3.0], [0.5]])
    many = ((np.linspace(-2.0, -1e-6, n), both, runs) for n, runs in ((400, 15), (2000, 5)))
    for z0, mu, runs in ((-0.3, 3.0, 50), *many):
        drift = _friction(z0, mu)
        c = np.array(np.broadcast_arrays(1 - z0, -1 - mu, 0.0, mu)).reshape(4, -1)
        for kappa in kappas:
            peer = partial(peers.numpy_log_escape_time, c, kappa, R)
            value = partial(sa.escape_time, drift, kappa, R, log=True)
            exact = np.ravel(value())
            for panels in (3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192):
                with np.errstate(all="ignore"):
                    found = peers.numpy_log_escape_time(c[:, ::9], kappa, R, panels)
                size = np.maximum(1.0, np.abs(exact[::9]))
                worst = float(np.max(np.abs(found - exact[::9]) / size))
                if worst <= 1e-12:
                    break
            times = interleaved(partial(peer, panels), value, partial(value, full=True), runs=runs)
            points, ratio = f"{c.shape[1]:,}", times[0] / times[2]
            if worst <= 1e-12 and c.shape[1] > 1:
                what = f"{points} points, kappa = {kappa:g}: NumPy by hand over ours with errors"
                rows.append(Row(what, ratio, 1.5, True))
            each = [*(_time(t / c.shape[1]) for t in times), _time(emitted[kappa])]
            about = [points, f"{kappa:g}", str(panels), f"{worst:.0e}" if worst else "0"]
            lines.append([*about, *each, _number(ratio)])
    head = ["points", "kappa", "panels a side", "its error", "by hand", "ours", "with errors"]
    text = (
        "log T for mu = 3 and 1/2 and values of z0 from -2 to -1e-6, at one point for mu = 3 and "
        "z0 = -0.3; times a point. By hand: "
        "Gauss-Legendre panels of 16 nodes on each side of the start, three or as many as 1e-12 "
        "needs (by comparison with ours at each ninth point; no error of its own), cumulative "
        "integrals by a matrix, panels joined in logarithms, tails in closed form. The ratio is of "
        "that to ours with errors. Emitted C: the exact time of 800 points, one call a point, "
        "compiled with -O2."
    )
    return Part(rows, [text, table([*head, "emitted C", "ratio"], lines)])


# -- memory -----------------------------------------------------------------------------------

_WARM = """
import numpy as np
import symasym as sa
sa.escape_time(sa.friction(mu=3, alpha=1, z0=[-1.0, -0.4]), 0.1, 10, log=True)
z0 = np.linspace(-2, -1e-6, 250_000)[:, None]
"""
_MILLION = """
T = sa.escape_time(
    sa.friction(mu=3, alpha=1, z0=z0), [0.1, 0.2, 0.5, 1.0], 10, log=True
)
assert T.size == 1_000_000
"""


def memory(options: argparse.Namespace) -> Part:
    found = peaks(_WARM, _MILLION)
    if found is None:
        return Part([], ["Measured on Linux only."])
    time, used, before = found
    return Part(
        [Row("memory of 1,000,000 points in float64, GiB", used / 1024, 1, False)],
        [
            "1,000,000 points (the grid above with 250,000 values of z0, mu = 3) in a process "
            f"of its own took {_time(time)} and {used:.0f} MiB at the peak, on top of the "
            f"{before:.0f} MiB of the interpreter, NumPy and symasym, result included.",
        ],
    )


# -- stiffness --------------------------------------------------------------------------------


def stiffness(options: argparse.Namespace) -> Part:
    many = _friction(np.linspace(-2.0, -1e-6, 1000))
    ways: dict[str, Callable[[str], Any]] = {
        "float64, one point": lambda kappa: sa.escape_time(_friction(), kappa, R, log=True),
        "float64, 1,000 points": lambda kappa: sa.escape_time(many, kappa, R, log=True),
        "50 digits": lambda kappa: sa.escape_time(_friction(), kappa, R, dps=50),
    }
    rows, columns = [], {}
    for name, way in ways.items():
        calls = [lambda kappa=kappa, way=way: way(kappa) for kappa in STIFF]
        for call in calls:
            call()
        times = dict(zip(STIFF, interleaved(*calls, runs=15), strict=True))
        columns[name] = times
        slowest = max(times, key=times.__getitem__)
        what = f"{name}: slowest kappa from 1e-8 to 1e4 (it is {slowest}) over kappa = 0.05"
        rows.append(Row(what, times[slowest] / times["0.05"], 8, False))
    cells = [
        [kappa, *(f"{_time(t[kappa])} ({t[kappa] / t['0.05']:.2g})" for t in columns.values())]
        for kappa in STIFF
    ]
    return Part(
        rows,
        [
            "mu = 3, r = 10, z0 = -3/10 or 1,000 values from -2 to -1e-6; in brackets the ratio to "
            "kappa = 0.05.",
            table(["kappa", *ways], cells),
        ],
    )


def uniform(options: argparse.Namespace) -> Part:
    method: dict[str, Any] = {"method": "uniform", "order": 0, "log": True}
    count = 100_000
    z0, exponents = np.linspace(-2, -1e-6, count), np.linspace(-5.0, 0.0, count)
    cases = {
        "one drift": (_friction("-0.7"), np.geomspace(0.01, 0.1, count)),
        "400 drifts, 250 kappas": (
            _friction(z0[:: count // 400, None]),
            np.geomspace(0.01, 0.1, 250),
        ),
        "each its own drift": (_friction(z0), 0.05),
    }
    rows, cells = [], []
    for name, (drift, kappa) in cases.items():
        once, value, full, exact = interleaved(
            partial(np.exp, exponents),
            partial(sa.escape_time, drift, kappa, R, **method),
            partial(sa.escape_time, drift, kappa, R, full=True, **method),
            partial(sa.escape_time, drift, kappa, R, log=True),
            runs=3,
        )
        rows.append(
            Row(f"uniform, order 0, 1e5 points, {name}, over `np.exp`", value / once, 100, False)
        )
        times = [_time(x / count) for x in (value, full, exact)]
        cells.append([name, *times, _number(value / once), _number(exact / value)])
    head = ["100,000 points", "uniform", "with errors", "exact", "over `np.exp`", "exact over it"]
    return Part(rows, [table(head, cells)])


_FIRST = """
import time
import numpy as np, symasym as sa
drift, kappa = sa.friction(mu=3, alpha=1, z0="-0.3"), np.array([0.01, 0.02])
start = time.process_time()
sa.escape_time(drift, kappa, 10, method="laplace", order=5, log=True)
print(time.process_time() - start)
"""


def _first_call() -> float:
    """Least of five fresh processes, without the imports that any call takes."""
    return min(float(python(_FIRST)) for _ in range(5))


# -- import -----------------------------------------------------------------------------------


def importing(options: argparse.Namespace) -> Part:
    codes = ("pass", "import numpy", "import symasym")
    rounds = [
        [wall(lambda code=code: python(code)) for code in codes] for _ in range(options.imports)
    ]
    bare, of_numpy, of_ours = (statistics.median(times) for times in zip(*rounds, strict=True))
    return Part(
        [
            Row(
                "`import symasym` over `import numpy`, whole process",
                of_ours / of_numpy,
                1.2,
                False,
            )
        ],
        [
            f"Medians of {options.imports} fresh processes each, in turn: Python alone "
            f"{_time(bare)}, `import numpy` {_time(of_numpy)}, `import symasym` {_time(of_ours)}.",
        ],
    )


PARTS: dict[str, tuple[str, Callable[[argparse.Namespace], Part]]] = {
    "thirty": ("30 digits", thirty_digits),
    "digits": ("More digits", many_digits),
    "grid": ("float64", grid),
    "hand": ("NumPy by hand", by_hand),
    "memory": ("Memory", memory),
    "stiffness": ("Stiffness", stiffness),
    "uniform": ("Uniform", uniform),
    "import": ("Import", importing),
}


def measured(options: argparse.Namespace) -> str:
    rows, texts = [], []
    for name in options.only or PARTS:
        title, part = PARTS[name]
        before = load()
        print(f"{title} …", file=sys.stderr, flush=True)
        found = part(options)
        rows += found.rows
        for missed in filter(None, map(Row.missed, found.rows)):
            print(missed, file=sys.stderr)
        seen = f"Load average {before} before, {load()} after."
        texts.append("\n\n".join([f"### {title}", *found.text, seen]))
    summary = table(["ratio", "measured"], [row.cells() for row in rows])
    return "\n\n".join([machine(), summary, *texts])


def renewed(old: str, new: str) -> str:
    """`old` with the rows and parts that `new` has, and the others as they were."""
    (top, rows, parts), (_, new_rows, new_parts) = _taken_apart(old), _taken_apart(new)
    lines = [new_rows.pop(name, line) for name, line in rows.items()] + [*new_rows.values()]
    texts = [new_parts.pop(title, text) for title, text in parts.items()] + [*new_parts.values()]
    return "\n\n".join([f"{top}\n" + "\n".join(lines), *texts])


def _taken_apart(tables: str) -> tuple[str, dict[str, str], dict[str, str]]:
    """What comes before the rows of the summary, the rows by their ratios, the parts by titles."""
    summary, *parts = tables.strip().split("\n\n### ")
    top, line, rows = summary.partition("| --- | --- |")
    by_ratio, above = {}, ""
    for row in rows.strip().splitlines():
        name = row.split("|")[1].strip()
        # "The same" goes with the row above it.
        above = above + name if name.startswith("the same") else name
        by_ratio[above] = row
    return top + line, by_ratio, {p.partition("\n")[0]: f"### {p.strip()}" for p in parts}


_SYMBOLS = {"kappa": r"\kappa", "mu": r"\mu", "alpha": r"\alpha", "z0": "z_0", "r": "r"}
_NUMBER = r"-?\d+(?:\.\d+)?(?:e[+-]?\d+|/\d+)?"
#: Code and formulas already set; a symbol with or without a value; powers of ten; words.
_TEX = re.compile(
    r"(?P<apart>`[^`]*`|\$[^$]*\$)"
    rf"|\b(?P<name>kappa|mu|alpha|z0|r(?= = ))\b(?: = (?P<value>{_NUMBER}))?"
    r"|\bkappas\b|\blog T\b|\bT(?= at\b)|\bA(?=, )"
    r"|(?<![\w.`-])-?\d+(?:\.\d+)?e[+-]?\d+\b|(?<= )-\d+(?:[./]\d+)?(?=[ ,])"
)


def in_tex(tables: str) -> str:
    """The tables with symbols and powers of ten as TeX; what is TeX already stays."""

    def number(text: str) -> str:
        mantissa, e, power = text.partition("e")
        if not e:
            return text
        ten = f"10^{{{int(power)}}}"
        return {"1": ten, "-1": f"-{ten}"}.get(mantissa, rf"{mantissa} \times {ten}")

    def shown(found: re.Match[str]) -> str:
        text = found[0]
        if found["apart"]:
            return text
        if name := found["name"]:
            value = f" = {number(found['value'])}" if found["value"] else ""
            return f"${_SYMBOLS[name]}{value}$"
        if text == "kappas":
            return r"values of $\kappa$"
        return rf"${text}$".replace("log", r"\log") if text[-1] in "TA" else f"${number(text)}$"

    return _TEX.sub(shown, tables)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description=__doc__)
    parser.add_argument("--long", action="store_true", help="quadratures that take minutes as well")
    parser.add_argument("--cap", type=float, default=300.0, help="seconds until a peer is stopped")
    parser.add_argument("--only", nargs="+", choices=PARTS, help="these parts only")
    parser.add_argument("--write", type=Path, metavar="FILE", help="put the tables into this page")
    parser.add_argument("--seed", type=int, default=2, help="of the sample of points")
    parser.add_argument("--imports", type=int, default=21, help="processes that import")
    options = parser.parse_args(arguments)
    if not options.write:
        print(measured(options))
        return
    page = options.write.read_text()
    before, _, rest = page.partition(START)
    after = rest.partition(END)[2]
    if not rest or END not in rest:
        parser.error(f"{options.write} has no lines {START} and {END}; add them.")
    tables = in_tex(measured(options))
    if options.only:
        tables = renewed(rest.partition(END)[0], tables)
    write_bytes(options.write, f"{before}{START}\n\n{tables}\n\n{END}{after}".encode())


if __name__ == "__main__":
    main()
