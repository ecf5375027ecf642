"""The figures can be read: nothing is cut off or written over, in colour and in grey."""

from __future__ import annotations

import inspect
import itertools
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from PIL import Image

import symasym as sa
from symasym.commands.main import main
from symasym.workshop import figures
from symasym.workshop.figures.style import colors, style

# Every figure as it is in the paper, and some with other parameters.
CASES = [
    *((name, {}) for name in figures.FIGURES),
    ("flows", {"mu": 1}),
    ("flows", {"mu": 5, "eps": "0.2"}),
    ("potentialSketch", {"mu": 6, "alpha": 2, "sliding": "1/2"}),
    ("frictionOsc", {"z": "-0.4"}),
    ("fricforce", {"mu": "0.7"}),
    ("phase", {"alpha": 2}),
    ("fric1", {"mu": 2}),
    ("fric2", {"mu": ["0.6", 4], "kappa": "0.05"}),
]


def test_the_papers_figures_are_there() -> None:
    paper = "fil flows potentialSketch frictionOsc phase fricforce fric1 fric2"
    assert set(paper.split()) <= set(figures.FIGURES)


@pytest.fixture(scope="module", params=CASES, ids=lambda case: "-".join([case[0], *case[1]]))
def figure(request: pytest.FixtureRequest) -> Figure:
    name, values = request.param
    points = {"fric1": 40, "fric2": 40, "stokes": 12, "release": 5, "regimes": 2}
    coarse = {"points": points[name]} if name in points else {}
    found = figures.FIGURES[name](**coarse, **values)
    with style():
        FigureCanvasAgg(found).draw()
    return found


def extent(text: Text) -> Bbox:
    """Where the words are, an annotation's arrow left out."""
    return Text.get_window_extent(text)


def written(figure: Figure) -> list[Text]:
    """Every text that is seen."""
    seen = [
        text
        for text in figure.findobj(Text)
        if text.get_text().strip() and text.get_visible() and extent(text).width > 0
    ]
    # Ticks beyond the limits are kept by matplotlib and not drawn.
    ticks = {
        id(label)
        for axes in [*figure.axes, *itertools.chain(*(a.child_axes for a in figure.axes))]
        for axis, low, high in ((axes.xaxis, *axes.get_xlim()), (axes.yaxis, *axes.get_ylim()))
        for tick in axis.get_major_ticks()
        for label in (tick.label1, tick.label2)
        if not low - 1e-9 <= tick.get_loc() <= high + 1e-9 or not axes.axison
    }
    return [text for text in seen if id(text) not in ticks]


def test_no_text_is_cut_off(figure: Figure) -> None:
    page = figure.bbox
    texts = written(figure)
    assert len(texts) >= 4
    for text in texts:
        box = extent(text)
        assert box.x0 >= page.x0 - 1, text
        assert box.x1 <= page.x1 + 1, text
        assert box.y0 >= page.y0 - 1, text
        assert box.y1 <= page.y1 + 1, text


def test_no_text_is_over_another(figure: Figure) -> None:
    for one, other in itertools.combinations(written(figure), 2):
        a, b = (extent(text).padded(-0.5) for text in (one, other))
        assert not a.overlaps(b), (one, other)


def test_text_is_large_enough(figure: Figure) -> None:
    assert min(text.get_fontsize() for text in written(figure)) >= 7


def test_a_caption_goes_with_every_figure(figure: Figure) -> None:
    caption = figure.get_label()
    assert 80 < len(caption) < 700
    assert caption.endswith(".")
    assert "  " not in caption


def test_the_picture_in_the_docs_is_todays(figure: Figure, request: pytest.FixtureRequest) -> None:
    name, values = request.node.callspec.params["figure"]
    if not values:
        with Image.open(Path(__file__).parents[2] / "docs" / "images" / f"{name}.png") as picture:
            assert picture.text["Description"] == figure.get_label()


# -- colours --------------------------------------------------------------------------------------


def linear(color: str) -> np.ndarray:
    share = np.array([int(color[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def lab(rgb: np.ndarray) -> np.ndarray:
    """CIE L*a*b* of linear sRGB, white point D65."""
    to_xyz = [[0.41246, 0.35758, 0.18044], [0.21267, 0.71515, 0.07217], [0.01933, 0.1192, 0.9503]]
    xyz = np.array(to_xyz) @ np.clip(rgb, 0, 1) / [0.95047, 1, 1.08883]
    x, y, z = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


# Machado, Oliveira and Fernandes (2009), severity 1.
VISIONS = {
    "normal": np.eye(3),
    "protanopia": [[0.1523, 1.0526, -0.2049], [0.1145, 0.7863, 0.0992], [-0.0039, -0.0481, 1.052]],
    "deuteranopia": [[0.3673, 0.8606, -0.228], [0.2801, 0.6725, 0.0474], [-0.0118, 0.0429, 0.9689]],
    "tritanopia": [[1.2555, -0.0767, -0.1788], [-0.0784, 0.9308, 0.1476], [0.0047, 0.6914, 0.3039]],
}


@pytest.mark.parametrize("vision", VISIONS)
def test_colours_stay_apart_for_every_vision(vision: str) -> None:
    with style():
        seen = [lab(np.asarray(VISIONS[vision]) @ linear(color)) for color in colors()]
    assert len(seen) == 4
    assert min(np.hypot.reduce(a - b) for a, b in itertools.combinations(seen, 2)) > 25


def test_colours_stay_apart_in_grey() -> None:
    with style():
        lightness = [lab(linear(color))[0] for color in colors()]
    assert np.all(np.diff(lightness) > 9)
    assert lightness[-1] < 70  # still to be seen on white


# -- files and the command ------------------------------------------------------------------------


def test_every_kind_of_file_holds_the_caption() -> None:
    figure = figures.fricforce(mu=2)
    caption = figure.get_label()
    svg = figures.encode(figure, "svg")
    texts = [element.text for element in ET.fromstring(svg).iter() if element.text]
    assert caption in texts
    assert caption.encode() in figures.encode(figure, "png")
    pdf = figures.encode(figure, "pdf")
    assert pdf.startswith(b"%PDF")
    assert caption[:40].encode() in pdf
    assert pdf == figures.encode(figures.fricforce(mu=2), "pdf")
    with pytest.raises(figures.style.InputError, match="kind is 'gif'"):
        figures.encode(figure, "gif")


def test_a_figure_reads_its_numbers_first() -> None:
    """Every parameter of every figure: a number, several where the default is a tuple."""
    for draw in figures.FIGURES.values():
        for name, parameter in inspect.signature(draw).parameters.items():
            for value in ("1e400", 10**400, np.array([[1.0]]), "x", True, float("nan")):
                with pytest.raises(sa.InputError, match=name):
                    draw(**{name: value})
            if not isinstance(parameter.default, tuple):
                with pytest.raises(sa.InputError, match=f"{name} is"):
                    draw(**{name: [1, 2]})
    with pytest.raises(sa.InputError, match="fil cannot be drawn with alpha = 1e-30; give values"):
        figures.fil("1e-30")


def test_the_command_lists_the_figures(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["figure"]) == 0
    listed = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in listed] == list(figures.FIGURES)


def test_the_command_draws_what_it_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["figure", "fricforce", "--set", "mu=2,4", "--set", "alpha=1/2"]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("fricforce.png\nfricforce.svg\n")
    wanted = figures.fricforce(mu=[2, 4], alpha="1/2")
    assert printed.split("\n", 2)[2].split() == wanted.get_label().split()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["fricforce.png", "fricforce.svg"]
    for kind in ("png", "svg"):
        assert Path(f"fricforce.{kind}").read_bytes() == figures.encode(wanted, kind)
    few = ["figure", "fric2", "--set", "points=9", "--set", "mu=1", "-o", "a/b.pdf", "-o", "c.svg"]
    assert main(few) == 0
    assert Path("a/b.pdf").read_bytes()[:4] == b"%PDF"
    assert 'id="exact-mu-1-kappa-0.01"' in Path("c.svg").read_text()


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["fric9"], "fric9 is no figure; the figures are fil, flows,"),
        (["phase", "--set", "mu=1"], "mu is no parameter of phase; its parameters are alpha."),
        (["phase", "--set", "alpha"], "--set is 'alpha'"),
        (["phase", "--set", "alpha=x"], "alpha is 'x'"),
        (["fric2", "--set", "points=1.5"], "points is '1.5'"),
        (["fric2", "--set", "mu=1,,2"], "mu is ''"),
        (["phase", "-o", "phase.gif"], "'phase.gif' has no ending that is drawn"),
        (["phase", "-o", "phase"], "'phase' has no ending that is drawn"),
        (["phase", "-o", "file/phase.png"], "cannot be written"),
    ],
)
def test_what_the_command_refuses(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    told: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("mine")
    assert main(["figure", *arguments]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith("symasym: ")
    assert told in printed.err
    assert printed.err.count("\n") == 1
    assert [p.name for p in tmp_path.iterdir()] == ["file"]
