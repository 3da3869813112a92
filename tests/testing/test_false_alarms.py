"""What the kit once held against right trackers and components."""

from __future__ import annotations

import attrs
import numpy as np
import pytest
from hypothesis import strategies as st

import vedette
from foreign.catalogue import COMPONENTS
from vedette import Estimator, Gaussian
from vedette.testing import FAST, Misuse, consistency, examine, laws_of
from vedette.testing.strategies import SENSOR, components
from vedette_sim import Look, Ship, Simulation
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition

AT_REST = {"x": [0, 20], "y": [0, 20], "vx": [0, 2], "vy": [0, 2]}


def tracker(detects=1.0, clutter=0.0, start=AT_REST, sigma_accel=0.5, associator="pda"):
    radar = {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": detects, "clutter_density": clutter}
    return vedette.build(
        {
            "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": sigma_accel}},
            "sensors": {"radar": radar},
            "associator": {"kind": associator},
            "birth": {"kind": "given", "start": start},
            "lifecycle": {"kind": "single_target"},
        }
    )


@pytest.mark.statistical(alpha=3e-6)
@pytest.mark.parametrize(("detects", "clutter"), [(0.7, 0.0), (0.7, 2e-5), (0.9, 1e-4)])
@pytest.mark.by_turns
def test_a_target_that_is_expected_at_rest_has_a_direction(detects, clutter):
    report = consistency(tracker(detects, clutter), scans=40, alpha=1e-6)
    assert report.consistent, report.text
    assert np.all(np.isfinite(report.calibration))


@pytest.mark.costly
@pytest.mark.statistical(alpha=3e-6)
@pytest.mark.parametrize("clutter", [3e-4, 1e-3])
def test_what_pda_uses_of_dense_clutter_is_white(clutter):
    report = consistency(tracker(0.9, clutter), scans=40, alpha=1e-6)
    (white,) = (verdict for verdict in report.verdicts if verdict.name == "whiteness")
    assert abs(white.figure) < 5 * white.error + 0.02  # far within the band of .1: theory says 0
    assert {verdict.name for verdict in report.verdicts if not verdict.inside} <= {"lost"}


@pytest.mark.costly
def test_what_a_filter_with_too_small_a_q_uses_in_clutter_is_not_white():
    right = tracker(0.9, 3e-5, sigma_accel=1.5)
    report = consistency(tracker(0.9, 3e-5), world=right, scans=40)
    (white,) = (verdict for verdict in report.verdicts if verdict.name == "whiteness")
    assert white.figure > 10 * white.error


@attrs.frozen
class Plain(Estimator):
    """A mixture whose modes have the same axes, so that it needs no `absent`; `of` does the work."""

    kind = "test_plain_mixture"
    modes: tuple = attrs.field(converter=tuple)
    transition: np.ndarray = attrs.field(factory=lambda: np.array([[0.9, 0.1], [0.2, 0.8]]), eq=False)

    @property
    def of(self):
        return Imm(self.modes, transition=self.transition)

    @property
    def state(self):
        return self.of.state

    def start(self, prior, axes, rng):
        return self.of.start(prior, axes, rng)

    def predict(self, belief, dt, rng):
        return self.of.predict(belief, dt, rng)

    def evaluate(self, belief, sensor, observed, p_gate):
        return self.of.evaluate(belief, sensor, observed, p_gate)

    def update(self, belief, innovation, weights):
        return self.of.update(belief, innovation, weights)

    def moments(self, belief):
        return self.of.moments(belief)

    def mode_prob(self, belief):
        return self.of.mode_prob(belief)


@attrs.frozen
class Narrowed(Plain):
    """Wrong: it leaves out the spread of the means."""

    kind = "test_narrowed_mixture"

    def moments(self, belief):
        found = self.of.moments(belief)
        return Gaussian(found.mean, 0.9 * found.cov)


@pytest.mark.parametrize(("cls", "verdict"), [(Plain, "held"), (Narrowed, "failed")])
def test_a_mixture_needs_no_parameter_named_absent(cls, verdict):
    made = cls((Kalman(ConstantVelocity(0.1)), Kalman(ConstantVelocity(2.0))))
    (law,) = (law for law in laws_of(cls) if law.name == "equal_modes_are_one")
    outcome = examine(cls, law, st.just(made), FAST)
    assert outcome.verdict == verdict, outcome.text


@pytest.mark.parametrize(
    ("name", "law", "verdict"),
    [
        ("shared birth", "far_scenes_change_no_birth", "held"),
        ("ensemble Kalman", "a_frame_turns_before_each_prediction", "held"),
        ("fading memory", "any_gap_leaves_a_belief", "held"),
        ("information filter", "any_gap_leaves_a_belief", "held"),
        ("lorry", "velocities_move_their_positions", "skipped"),
        ("graded", "pictures_show_where", "held"),
        ("in the bay", "found_tracks_live", "held"),
        ("even sea", "births_know_no_unit", "held"),
        ("even sea", "tracks_are_as_unsure_as_their_returns", "held"),
        ("even sea", "the_unseen_fade", "skipped"),
        ("kilometres", "returns_lie_where_they_were_seen", "skipped"),
        ("both", "others_far_away_change_nothing", "skipped"),
        ("survey", "detects_within_max_range", "held"),
        ("minutes", "survives_its_lifetime", "held"),
        ("minutes", "waits_out_of_coverage", "held"),
        ("nobody", "scans_last_as_stated", "held"),
        ("nearest-neighbour JPDA", "every_return_counts", "skipped"),
        ("detection rate", "a_look_at_nothing_keeps_the_verdict", "held"),
    ],
)
@pytest.mark.by_turns
def test_right_components_keep_the_laws_that_they_once_failed(name, law, verdict):
    """Or these no longer apply: a law that is now skipped where it held judges nothing."""
    (made,) = (c.make() for c in COMPONENTS if c.name == name)
    (law,) = (each for each in laws_of(type(made)) if each.name == law)
    for seed in (2, 3):
        outcome = examine(type(made), law, st.one_of(st.just(made), components(type(made))), attrs.evolve(FAST, seed=seed))
        assert outcome.verdict == verdict, outcome.text


@pytest.mark.nightly("130 components, each of which costs 3 s")
@pytest.mark.statistical(alpha=1e-5)
@pytest.mark.parametrize("component", [pytest.param(one, id=one.name) for one in COMPONENTS])
def test_right_components_keep_every_law(component):
    made = component.make()
    try:
        drawn = st.one_of(st.just(made), components(type(made)))
    except Misuse:  # what it holds cannot be drawn
        drawn = st.just(made)
    profile = attrs.evolve(FAST, seed=6, shrink=False)
    found = [
        examine(type(made), law, drawn, profile) for law in laws_of(type(made)) if law.name not in component.known_failures
    ]
    assert [(one.law.name, one.text) for one in found if one.verdict == "failed"] == []


@pytest.mark.costly
def test_a_scene_may_have_another_sensor_than_the_tracker():
    scene = Simulation(
        30.0, {SENSOR: Look(1.0)}, ships={"boat": Ship([0.5, 0.5])}, sensors={SENSOR: CartesianPosition(sigma=60.0)}
    )
    (law,) = (law for law in laws_of(Simulation) if law.name == "returns_are_of_the_truth")
    outcome = examine(Simulation, law, st.just(scene), FAST)
    assert outcome.verdict == "held", outcome.text


@pytest.mark.parametrize("seed", [72, 73])
def test_a_slope_of_rounding_size_is_not_blamed_where_a_bearing_stays_at_0(seed):
    (right,) = (c.make() for c in COMPONENTS if c.name == "bistatic radar")
    (law,) = (law for law in laws_of(type(right)) if law.name == "jacobian_is_the_derivative")
    drawn = st.one_of(st.just(right), components(type(right)))
    outcome = examine(type(right), law, drawn, attrs.evolve(FAST, seed=seed, shrink=False))
    assert outcome.verdict == "held", outcome.text


@pytest.mark.parametrize("name", ["constant jerk", "current statistical model"])
@pytest.mark.costly
def test_a_path_of_hardly_any_acceleration_may_bend_by_its_jerk(name):
    (right,) = (c.make() for c in COMPONENTS if c.name == name)
    (law,) = (law for law in laws_of(type(right)) if law.name == "paths_bend_with_their_velocities")
    drawn = st.one_of(st.just(right), components(type(right)))
    outcome = examine(type(right), law, drawn, attrs.evolve(FAST, examples=200, shrink=False))
    assert outcome.verdict == "held", outcome.text
