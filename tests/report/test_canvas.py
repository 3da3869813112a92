"""Pictures for a screen and for a paper: sizes, styles, words within the picture, colours for all readers."""

import itertools
import json
import re
from importlib.resources import files

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.text import Annotation, Text

from support.results import config
from vedette import metrics
from vedette.cli import main
from vedette.errors import ConfigError
from vedette_report.drawing import canvas
from vedette_report.drawing.brought import Drawing
from vedette_report.drawing.chart import draw
from vedette_report.drawing.errors import errors
from vedette_report.drawing.picture import picture
from vedette_report.findings import Chart, Curve, Panel
from vedette_report.summary.words import summary

SEEN_BY = {
    "all": np.eye(3),
    "protanopes": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopes": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
}
"""Linear RGB as it looks to them: Machado, Oliveira and Fernandes, IEEE T-VCG 15 (2009) 1291, severity 1."""
TOLD_APART = 12.0
"""Distance in CIELAB of colours that are told apart at a glance; one that is just noticed is 2.3."""
INCHES = {"one": 3.5, "two": 7.16, "screen": 12.0}


def lab(colour, seen):
    """A colour of sRGB, as someone sees it, in CIELAB under D65."""
    given = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    linear = np.where(given <= 0.04045, given / 12.92, ((given + 0.055) / 1.055) ** 2.4)
    to_xyz = [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
    xyz = np.array(to_xyz) @ np.clip(np.array(seen) @ linear, 0, 1) / [0.95047, 1.0, 1.08883]
    x, y, z = np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16) / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def closest(colours):
    """The least distance of two of the colours, to those who see them worst."""
    return min(
        np.linalg.norm(lab(one, seen) - lab(other, seen))
        for seen in SEEN_BY.values()
        for one, other in itertools.combinations(colours, 2)
    )


@pytest.mark.parametrize("name", ["TRACKS", "MODES"])
def test_colour_blind_readers_tell_the_colours_apart(name):
    assert closest(getattr(canvas, name)) >= TOLD_APART
    assert min(closest([colour, "#ffffff"]) for colour in getattr(canvas, name)) >= TOLD_APART


def test_the_measure_finds_colours_that_they_confuse():
    assert closest(["#cc79a7", "#44aa99"]) < 5 < TOLD_APART < closest(["#0072b2", "#d55e00"])
    assert closest(["#d55e00", "#d55e00"]) == 0


def test_the_style_and_the_pages_have_these_colours():
    assert tuple(canvas.colour(i) for i in range(12)) == canvas.TRACKS
    script = (files("vedette_report.page") / "compare.js").read_text()
    looks = re.findall(r'legible\("(#\w+)"\), fill: .*, dash: \[(.*)\]', script)
    assert tuple(colour for colour, _ in looks) == canvas.TRACKS[:4]
    assert len({dash for _, dash in looks}) == 4


def charts():
    x = np.linspace(0.1, 10.0, 30)
    long = "the standard deviation that a filter states of its errors"
    curves = tuple(
        Curve(f"{name} filter", x, level + np.sin(x), doubt=np.ones(30)) for level, name in enumerate(["a", "one", "an"])
    )
    yield Chart("one", "A title", (Panel("100 runs; bands: two standard errors", "time [s]", "error [m]", curves),))
    own = tuple(
        Panel(f"panel {i}", "time [s]", "NEES over the number of axes", (Curve(f"{long} {i}", x, x),)) for i in range(3)
    )
    yield Chart("three", "A title", own)
    yield Chart("logs", "A title", (Panel("", "sigma [m/s^2]", "error [m]", curves, log=True, log_across=True),) * 2)


def out_of_the_picture(made):
    """The words that are cut off at an edge of the picture."""
    made.draw_without_rendering()
    width, height = made.bbox.size
    found = []
    for text in made.findobj(Text):
        if not text.get_visible() or not text.get_text().strip() or isinstance(text, Annotation):
            continue
        if re.fullmatch(r"\W*[\d.]+|\$.*\$", text.get_text()):
            continue  # a number of an axis: those beyond its ends are not drawn
        box = text.get_window_extent()
        if box.x0 < -2 or box.y0 < -2 or box.x1 > width + 2 or box.y1 > height + 2:
            found.append(text.get_text())
    return found


@pytest.mark.parametrize("columns", INCHES)
@pytest.mark.costly
def test_pictures_are_as_wide_as_they_should_be_and_cut_no_word(scene, columns):
    with canvas.styled(canvas.Look(columns=columns)):
        drawn = [errors(*scene), *map(draw, charts())] + ([picture(*scene)] if columns == "one" else [])
        for made in drawn:
            assert made.get_figwidth() == INCHES[columns]
            assert out_of_the_picture(made) == []
            sizes = {text.get_fontsize() for text in made.findobj(Text) if text.get_text().strip() and text.get_visible()}
            assert min(sizes) >= (6 if columns != "screen" else 8)
            assert all(axes.get_window_extent().height > 0.1 * made.bbox.height / len(made.axes) for axes in made.axes)


@pytest.mark.parametrize("form", ["png", "svg", "pdf"])
@pytest.mark.costly
def test_every_format_is_written_with_its_title_for_a_paper_too(tmp_path, form):
    look = canvas.Look(form, "one")
    path = tmp_path / look.file("chart")
    with canvas.styled(look):
        canvas.save(draw(next(charts())), path)
    content = path.read_bytes()
    assert b"A title" in content
    if form == "svg":
        assert 'width="252pt"' in content.decode()


def test_a_style_of_one_s_own_is_on_top_and_ends_with_the_picture(tmp_path):
    path = tmp_path / "mine.mplstyle"
    path.write_text("font.size: 20\nlines.linewidth: 6\naxes.prop_cycle: cycler('color', ['ff0000', '00ff00'])\n")
    before = dict(mpl.rcParams)
    with canvas.styled(canvas.Look(style=path)):
        assert (canvas.letters(11), canvas.stroke(1.5), canvas.colour(2)) == (22.0, 6.0, "#ff0000")
        made = draw(next(charts()))
        assert made.axes[0].get_lines()[0].get_linewidth() == 6.0
    assert dict(mpl.rcParams) == before


@pytest.mark.parametrize(
    ("content", "piece"),
    [
        ("font.size: 8\nfont.sise: 3\n", r"font\.sise .*line 2"),
        ("lines.linewidth: thick\n", "line 1 .*Could not convert 'thick' to float"),
        (None, "No such file"),
    ],
)
def test_a_bad_style_is_refused_before_anything_runs(tmp_path, content, piece, capsys):
    path, out = tmp_path / "mine.mplstyle", tmp_path / "out"
    if content is not None:
        path.write_text(content)
    with pytest.raises(ConfigError, match=piece):
        canvas.read_style(path)
    (tmp_path / "config.json").write_text("{}")
    for command in (["run", str(tmp_path / "config.json")], ["reproduce", "vts"]):
        assert main([*command, "--style", str(path), "--out", str(out)]) == 2
    assert not out.exists()
    assert "--style" in capsys.readouterr().err


def test_the_title_of_the_nis_says_what_the_summary_says(scene):
    experiment, done = scene
    score = metrics.judge(
        done.tracks, done.recording.truth, done.scans, experiment.judge, experiment.tracker.gate.probability
    )
    words = " ".join(summary(experiment, done, score).split())
    nees, nis = (axes.get_title(loc="left") for axes in errors(*scene).axes[-2:])
    for title in (nees, nis):
        ratio, share = re.fullmatch(r"mean (\S+) times the expected one; (\S+) % of \S+ in the 95 % band", title).groups()
        assert f" {ratio} " in words
        assert f"{share} % of" in words


@pytest.mark.costly
def test_commands_that_draw_take_format_columns_and_style(tmp_path, monkeypatch):
    looks = []
    monkeypatch.setattr(Drawing, "of_run", lambda self, result, folder: looks.append(self.look) or [])
    monkeypatch.setattr(Drawing, "save", lambda self, kind, subject, path: looks.append(self.look))
    monkeypatch.setattr("vedette_study.commands.study.write_charts", lambda folder, charts, look: looks.append(look) or [])
    monkeypatch.setattr("vedette_study.commands.study.can_write", lambda *_: False)
    (tmp_path / "config.json").write_text(json.dumps(config()))
    (tmp_path / "mine.mplstyle").write_text("font.size: 9\n")
    (tmp_path / "study.json").write_text(json.dumps({"experiment": config(), "runs": 1}))
    look = ["--format", "svg", "--columns", "two", "--style", str(tmp_path / "mine.mplstyle"), "--set", "source.duration=40"]
    for command in ("run", "consistency", "study"):
        file = "study.json" if command == "study" else "config.json"
        assert main([command, str(tmp_path / file), *look, "--out", str(tmp_path / command)]) == 0
    assert looks == [canvas.Look("svg", "two", tmp_path / "mine.mplstyle")] * 3


@pytest.mark.costly
def test_characters_that_the_font_lacks_are_told_in_a_line(tmp_path, capsys):
    """Once each of them was a warning of the plotting library."""
    (tmp_path / "config.json").write_text(json.dumps(config(title="\u8239\u8236")), encoding="utf-8")
    assert main(["run", str(tmp_path / "config.json"), "--out", str(tmp_path / "out")]) == 0
    told = [line for line in capsys.readouterr().err.splitlines() if "font" in line]
    assert told
    assert all("picture" in line or "errors" in line for line in told)
    assert len(told) <= 2
