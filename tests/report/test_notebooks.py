"""What a notebook shows of scores, reports of consistency and studies: tables without what does not exist."""

from html.parser import HTMLParser

import pytest

import vedette
from support.paths import EXAMPLES
from vedette.config.files import read_file
from vedette.metrics import Score
from vedette.testing import consistency
from vedette_report.recorded import recorded_consistency
from vedette_study.plan import plan
from vedette_study.study import perform

CONFIG = EXAMPLES / "harbour.toml"


class Rows(HTMLParser):
    """The captions and the rows of the tables of a page."""

    def __init__(self, text):
        super().__init__()
        self.captions, self.cells, self._into = [], [], None
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self._into = {"caption": self.captions, "th": self.cells, "td": self.cells}.get(tag)
        if self._into is not None:
            self._into.append("")

    def handle_endtag(self, tag):
        self._into = None

    def handle_data(self, data):
        if self._into is not None:
            self._into[-1] += data

    @property
    def rows(self):
        return dict(zip(self.cells[::2], self.cells[1::2], strict=True))


@pytest.fixture(scope="module")
def experiment():
    return vedette.load(CONFIG, overrides=["source.duration=40"])


def test_a_score_shows_its_figures_and_each_object(experiment):
    result = experiment.run()
    score = vedette.metrics.judge(result.tracks, result.recording.truth, result.scans, experiment.judge)
    page = Rows(score._repr_html_())
    assert page.captions[0] == f"Score over {score.scans} scans"
    assert set(page.captions[1:]) == {path.name for path in result.recording.truth}
    assert f"{score.gospa_m:.4g}" in page.cells
    assert "None" not in page.cells
    assert Rows(Score(scans=3, tracks=0)._repr_html_()).rows == {"scans": "3", "tracks": "0"}


def test_a_report_of_consistency_shows_what_is_wrong_first():
    steady = {
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
        "sensors": {"s": {"kind": "cartesian_position", "sigma": 5.0}},
        "associator": {"kind": "nearest"},
        "birth": {"kind": "given"},
        "lifecycle": {"kind": "single_target"},
        "gate": "off",
    }
    tracker = vedette.build(steady)
    world = vedette.build({**steady, "sensors": {"s": {"kind": "cartesian_position", "sigma": 10.0}}})
    prior = {"x": (0.0, 10.0), "y": (0.0, 10.0), "vx": (0.0, 3.0), "vy": (0.0, 3.0)}
    report = consistency(tracker, prior=prior, runs=40, scans=20, world=world)
    page = Rows(report._repr_html_())
    assert page.captions[0].startswith("NOT consistent: 40 runs")
    assert page.cells[0].startswith("WRONG: ")
    assert len(page.rows) >= len(report.verdicts)


def test_a_recorded_track_shows_its_figures(experiment):
    shown = [Rows(one._repr_html_()).rows for one in recorded_consistency(experiment)]
    assert all(float(rows["nis"]) > 0 for rows in shown)


def test_a_study_shows_a_table_a_point():
    found = perform(
        plan(
            {"experiment": read_file(CONFIG), "runs": 2, "seed": 1, "sweep": {"sensors.radar.sigma_range": [5.0, 9.0]}},
            ["source.duration=40"],
        )
    )
    page = Rows(found._repr_html_())
    assert "2 runs at each of 2 points" in page.captions[0]
    assert len(page.captions) == 3
    assert all(page.cells)
