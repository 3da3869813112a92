"""A run judged block by block has the figures of one judged whole; wrong sums over blocks are caught."""

import attrs
import numpy as np
import pytest

import vedette
from support.histories import path
from support.ships import AROUND, RADAR, radar_and_beacon
from vedette import InputError, Space
from vedette.metrics import Judge, RunningJudge, Score, judge
from vedette.metrics.coverage import Held
from vedette.metrics.tally import Tally
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
    field.name
    for field in attrs.fields(Score)
    if field.name.startswith(("trajectory_gospa", "ospa2", "mota", "motp", "hota", "siap", "position_bound"))
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


def running(run, options, block):
    """The score of a run judged in blocks of so many scans."""
    experiment, result = run
    tracker = experiment.tracker
    judging = RunningJudge(result.recording.truth, tracker.state, options, tracker.gate.probability)
    for i, (scan, state) in enumerate(zip(result.scans, result.states, strict=True)):
        judging.add(scan, state.ids, state.confirmed, tracker.estimate(state), state.nis, state.hit, None)
        if i % block == block - 1:
            judging.finish_block()
    judging.finish_block()
    assert judging.finish_block() is None
    return judging.score()


def check(run, options, block):
    experiment, result = run
    gate = experiment.tracker.gate.probability
    whole = judge(result.tracks, result.recording.truth, result.scans, options, gate)
    wanted = attrs.asdict(whole) | dict.fromkeys(WHOLE_TRACKS)
    agree(attrs.asdict(running(run, options, block)), wanted, "")


def agree(found, wanted, place):
    if isinstance(wanted, dict):
        for name in wanted:
            agree(found[name], wanted[name], f"{place}.{name}")
    elif isinstance(wanted, tuple):
        assert len(found) == len(wanted), place
        for i, each in enumerate(wanted):
            agree(found[i], each, f"{place}[{i}]")
    else:
        assert found == (pytest.approx(wanted, rel=1e-11, abs=1e-12) if isinstance(wanted, float) else wanted), place


@pytest.mark.parametrize("block", [1, 13, 1000])
@pytest.mark.parametrize("options", OPTIONS)
def test_the_figures_are_those_of_a_run_judged_whole(run, options, block):
    check(run, OPTIONS[options], block)


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


def evolve_truth(result, truth):
    return attrs.evolve(result, recording=attrs.evolve(result.recording, truth=truth))


def test_what_cannot_be_judged_is_said_before_the_run():
    with pytest.raises(InputError, match="must have a position axis"):
        RunningJudge((path("boat", [0.0, 1.0], np.zeros((2, 2))),), Space.of(vx="m/s", vy="m/s"), Judge())


def test_what_is_known_of_tracks_that_ended_is_forgotten(run):
    held = {}
    tally_forget = Tally.forget
    with pytest.MonkeyPatch.context() as patch:

        def watched(self, alive):
            tally_forget(self, alive)
            held["owners"] = set(self.held.owner) | set(self._held_longer.owner)
            held["alive"] = set(alive.tolist())

        patch.setattr(Tally, "forget", watched)
        running(run, OPTIONS["strict"], 5)
    assert held["owners"] <= held["alive"]
    assert len(run[1].tracks) > 3


def no_memory(self, found, times, which=None):
    self.held = Held(len(self.truth))
    usual_add(self, found, times, which)


def gaps_at_once(self, found, times, which=None):
    usual_add(self, found, times, which)
    self.scans += self._waiting
    self._waiting = 0


def gaps_never(self, found, times, which=None):
    usual_add(self, found, times, which)
    self._waiting, self._later = 0, [0.0] * 7


def switches_within_blocks(fate, times, cover, longer):
    fate.label = -1
    usual_follow(fate, times, cover, longer)


def losses_within_blocks(fate, times, cover, longer):
    fate.held_last = -1
    usual_follow(fate, times, cover, longer)


usual_add, usual_follow = Tally.add, Tally._follow
MUTANTS = {
    "blocks matched without those before": ("add", no_memory, "wide"),
    "scans after the last object judged": ("add", gaps_at_once, "usual"),
    "scans between two objects left out": ("add", gaps_never, "usual"),
    "switches from block to block not counted": ("_follow", staticmethod(switches_within_blocks), "wide"),
    "losses over blocks not counted": ("_follow", staticmethod(losses_within_blocks), "strict"),
}


@pytest.mark.parametrize("name", MUTANTS)
def test_a_mutant_is_caught(run, monkeypatch, name):
    attribute, mutant, options = MUTANTS[name]
    monkeypatch.setattr(Tally, attribute, mutant)
    with pytest.raises(AssertionError):
        check(run, OPTIONS[options], 3)
