"""A run judged as it goes has the figures of its tracks judged at the end, to the last bit; mutants are caught."""

import attrs
import numpy as np
import pytest

import vedette
from support.histories import path
from support.ships import AROUND, RADAR, radar_and_beacon
from vedette import InputError, Space
from vedette.errors import PluginError
from vedette.metrics import FIGURES, Figure, Judge, RunningJudge, judge, tally
from vedette.metrics import running as judging_module
from vedette.metrics.coverage import LastCover
from vedette.metrics.tally import Fate, Total
from vedette.types import Gaussian

SHIPS = {  # nothing before 10 s, between 60 and 80 s, and after 130 s; one overtakes two
    "one": {"start": [0.0, 0.0], "speed": 6.0, "appears": 10.0, "disappears": 60.0},
    "two": {"start": [40.0, 3.0], "course": 0.02, "speed": 5.5, "appears": 12.0, "disappears": 55.0},
    "three": {"start": [-300.0, 200.0], "speed": 2.0, "appears": 80.0, "disappears": 130.0},
}
CONFIG = radar_and_beacon(
    SHIPS,
    duration=150.0,
    radar=RADAR | {"sigma": 8.0, "detection_probability": 0.5, "clutter_density": 3e-6},
    looks={"radar": AROUND, "beacon": {"interval": 15.0}},
    seed=5,
    estimator={"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
)
WHOLE_TRACKS = [
    figure.name
    for figure in FIGURES
    if figure.name.startswith(("trajectory_gospa", "ospa2", "mota", "motp", "idf1", "hota", "siap", "position_bound"))
]
"""Figures that need the histories of whole tracks."""
OPTIONS = {
    "usual": Judge(),
    "strict": Judge(cover_radius=12.0, lost_error=9.0, lost_scans=2, gospa_cutoff=20.0, gospa_order=1.0),
    "far and near": Judge(far=100.0, near=40.0, offset=[3.0, -2.0]),
    "wide": Judge(cover_radius=400.0),
    "one sensor": Judge(sensor="beacon", first_scan=3, last_scan=40),
}


@pytest.fixture(scope="module")
def run():
    experiment = vedette.load(CONFIG)
    return experiment, experiment.run(keep_states=True)


def judging_of(run, options, block, **further):
    """The judge of a run, after blocks of so many scans."""
    experiment, result = run
    tracker = experiment.tracker
    judging = RunningJudge(result.recording.truth, tracker.state, options, tracker.gate.probability, **further)
    for i, (scan, state) in enumerate(zip(result.scans, result.states, strict=True)):
        judging.add(scan, state.ids, state.confirmed, tracker.estimate(state), state.nis, state.hit, None)
        if i % block == block - 1:
            judging.finish_block()
    judging.finish_block()
    assert judging.finish_block() is None
    return judging


def running(run, options, block):
    return judging_of(run, options, block, keep=np.inf).score()


def check(run, options, block):
    experiment, result = run
    gate = experiment.tracker.gate.probability
    whole = judge(result.tracks, result.recording.truth, result.scans, options, gate)
    assert running(run, options, block) == whole


@pytest.fixture(scope="module")
def told(run):
    """The figures of all options, by the judge as it is."""
    return {name: running(run, options, 50) for name, options in OPTIONS.items()}


@pytest.mark.parametrize("block", [1, 13, 1000])
@pytest.mark.parametrize("options", OPTIONS)
@pytest.mark.by_turns
def test_the_figures_are_those_of_a_run_judged_whole(run, options, block):
    check(run, OPTIONS[options], block)


@pytest.mark.costly
def test_the_run_tells_the_options_apart(run):
    scores = {name: running(run, options, 13) for name, options in OPTIONS.items()}
    assert len({(score.gospa_m, score.position_rmse_m) for score in scores.values()}) >= len(scores) - 1
    assert scores["strict"].coverage < scores["usual"].coverage
    assert scores["usual"].truths[0].scans > 50
    assert scores["wide"].id_switches > 0
    assert scores["usual"].scans == 129, "from 10 s to 130 s, the time without an object in between"


def test_a_run_without_truth_or_without_tracks(run):
    experiment, result = run
    empty = evolve_truth(result, ())
    check((experiment, empty), Judge(), 13)
    space = experiment.tracker.state
    judging = RunningJudge(result.recording.truth, space, Judge())
    nothing = Gaussian(np.zeros((0, 4)), np.zeros((0, 4, 4)))
    for scan in result.scans:
        judging.add(scan, np.zeros(0, int), np.zeros(0, bool), nothing, np.zeros(0), np.zeros(0), None)
    judging.finish_block()
    whole = judge((), result.recording.truth, result.scans, Judge())
    assert judging.score() == attrs.evolve(whole, **dict.fromkeys(WHOLE_TRACKS))


@pytest.mark.costly
def test_figures_of_whole_tracks_are_left_out_beyond_what_may_be_kept(run):
    whole = running(run, OPTIONS["usual"], 13)
    assert all(getattr(whole, name) is not None for name in WHOLE_TRACKS if name != "position_bound_m")
    for most in (0.0, 1000.0):
        judging = judging_of(run, OPTIONS["usual"], 13, keep=most)
        assert judging.whole.dropped
        assert judging.score() == attrs.evolve(whole, **dict.fromkeys(WHOLE_TRACKS))
    assert not judging_of(run, OPTIONS["usual"], 13, keep=1e6).whole.dropped


@pytest.mark.parametrize("kept", [tally.KEPT, 300])
def test_a_total_is_the_sum_of_all_at_once(kept, monkeypatch):
    """To the last bit, but for those that came long before."""
    monkeypatch.setattr(tally, "KEPT", kept)
    numbers = np.random.default_rng(1).normal(size=(2, 5000)) * 1e3
    total, later = Total(), Total()
    for part in np.split(numbers[:, :4000], [1, 700, 1300], axis=1):
        total.add(part)
    later.add(numbers[:, 4000:])
    total.join(later)
    wanted = [np.sum(numbers[0]), np.sum(numbers[1])]
    assert total.value.tolist() == (wanted if kept > 5000 else pytest.approx(wanted))
    assert total.count == 5000


class Largest:
    """The largest position error so far."""

    def __init__(self):
        self.most = None

    def add(self, block):
        error = block.found.pairs().error[:, :2]
        if len(error):
            self.most = max(self.most or 0.0, float(np.max(np.linalg.norm(error, axis=-1))))

    def value(self):
        return self.most


def test_a_plugins_figure_is_one_more(run):
    largest = Figure("largest_error_m", "m", "largest position error", start=Largest)
    score = judging_of(run, OPTIONS["usual"], 13, figures=[largest]).score()
    assert score.position_rmse_m < score.more["largest_error_m"] < 50.0
    assert score.figures()["largest_error_m"] == score.more["largest_error_m"]
    broken = Figure("broken", "1", "fails", start=lambda: None)
    with pytest.raises(PluginError, match="broken"):
        judging_of(run, OPTIONS["usual"], 13, figures=[broken])


def evolve_truth(result, truth):
    return attrs.evolve(result, recording=attrs.evolve(result.recording, truth=truth))


def test_what_cannot_be_judged_is_said_before_the_run():
    with pytest.raises(InputError, match="must have a position axis"):
        RunningJudge((path("boat", [0.0, 1.0], np.zeros((2, 2))),), Space.of(vx="m/s", vy="m/s"), Judge())


def test_tracks_that_lack_axes_are_refused_by_their_name(run):
    result = run[1]
    track = attrs.evolve(result.tracks[0], mean=result.tracks[0].mean[:, :1], cov=result.tracks[0].cov[:, :1, :1])
    with pytest.raises(InputError, match=f"track {track.id}:"):
        judge([track], result.recording.truth, result.scans, Judge())


def test_what_is_known_of_tracks_that_ended_is_forgotten(run, monkeypatch):
    monkeypatch.setattr(judging_module, "_REMEMBERED", 0)
    monkeypatch.setattr(judging_module, "RETURNS", 5)
    judging = judging_of(run, OPTIONS["strict"], 5, keep=np.inf)
    assert judging._most > 0, "it forgot now and then"
    judging._forget()
    last = {track for state in run[1].states[-10:] for track in state.ids.tolist()}
    for known in (judging._seen, judging._confirmed, judging._held.owner, judging._held_longer.owner):
        assert set(known) <= last
    assert len(run[1].tracks) > 3
    assert judging.score().tracks == len(run[1].tracks)


def no_memory(self, scans, entries, gates):
    self._held = LastCover(len(self._truth))
    return usual_judged(self, scans, entries, gates)


def gaps_at_once(self, block, alive, known):
    usual_sum(self, block, alive, known)
    self._judged += self._later.count
    self._sets.join(self._later)
    self._later = Total()


def gaps_never(self, block, alive, known):
    usual_sum(self, block, alive, known)
    self._later = Total()


def switches_within_blocks(self, times, cover, longer):
    self.label = -1
    usual_follow(self, times, cover, longer)


def losses_within_blocks(self, times, cover, longer):
    self.held_last = -1
    usual_follow(self, times, cover, longer)


def summed_by_parts(self, values):
    self._sum, self._parts = self._sum + np.sum(values, axis=-1), []
    self.count += values.shape[-1]


usual_judged, usual_sum, usual_follow = RunningJudge.judged, RunningJudge._sum, Fate.follow
MUTANTS = {
    "blocks matched without those before": (RunningJudge, "judged", no_memory, "wide"),
    "scans after the last object judged": (RunningJudge, "_sum", gaps_at_once, "usual"),
    "scans between two objects left out": (RunningJudge, "_sum", gaps_never, "usual"),
    "switches from block to block not counted": (Fate, "follow", switches_within_blocks, "wide"),
    "losses over blocks not counted": (Fate, "follow", losses_within_blocks, "strict"),
    "sums by blocks": (tally.Total, "add", summed_by_parts, "usual"),
}


@pytest.mark.parametrize("name", MUTANTS)
@pytest.mark.by_turns
def test_a_mutant_is_caught(run, told, monkeypatch, name):
    cls, attribute, mutant, options = MUTANTS[name]
    monkeypatch.setattr(cls, attribute, mutant)
    assert running(run, OPTIONS[options], 3) != told[options]
