"""Without a gate all returns count, and P_D is not reduced by the gate's probability; a frame is judged by its pixels."""

import numpy as np
import pytest
from attrs import evolve

import vedette
from vedette import ConfigError, Detections, Frame, Gate, Gaussian, Scan
from vedette.config import to_config

PRIOR = Gaussian(np.zeros((1, 4)), np.diag([4.0, 4.0, 1.0, 1.0])[None])
RETURNS = np.array([[1.0, 0.5], [9.0, -4.0], [30.0, 40.0]])


def config(**more):
    return {
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
        "sensors": {
            "radar": {
                "kind": "cartesian_position", "sigma": 1.0, "detection_probability": 0.8, "clutter_density": 1e-3,
                **more.pop("radar", {}),
            }
        },
        "associator": {"kind": "pda"},
        "birth": {"kind": "given"},
        "lifecycle": {"kind": "single_target"},
        **more,
    }  # fmt: skip


def after(built, z):
    tracker = vedette.build(built)
    return tracker.step(tracker.start(PRIOR, 0.0), Scan(0.0, "radar", Detections.of(z, 2)))


def textbook(p_detect, p_gate, inside):
    """Weights of a miss and of each return: 1 - P_D P_G, and P_D N(z; 0, 5 I) / lambda where it is inside the gate."""
    density = np.exp(-0.5 * np.sum(RETURNS**2, axis=1) / 5.0) / (2 * np.pi * 5.0)
    rows = np.append(1.0 - p_detect * p_gate, np.array(inside) * p_detect * density / 1e-3)
    return rows / rows.sum()


def test_without_a_gate_all_returns_are_weighed_and_the_miss_is_one_minus_p_d():
    gated, off = after(config(), RETURNS), after(config(gate="off"), RETURNS)
    np.testing.assert_allclose(off.weights[0], textbook(0.8, 1.0, [1, 1, 1]), rtol=1e-12, atol=1e-26)
    np.testing.assert_allclose(gated.weights[0], textbook(0.8, 0.99, [1, 0, 0]), rtol=1e-12)
    assert off.weights[0, 2] > 0 == gated.weights[0, 2]


def test_existence_is_not_reduced_by_a_gate_that_is_none():
    birth = {"kind": "from_returns", "spread": {"vx": 1.0, "vy": 1.0}}
    tracker = vedette.build(config(gate="off", birth=birth, lifecycle={"kind": "existence", "lifetime": 1e12}))
    start = evolve(tracker.start(PRIOR, 0.0), existence=np.array([0.6]))
    state = tracker.step(start, Scan(0.0, "radar", Detections.of([], 2)))
    assert state.existence[0] == pytest.approx(0.6 * 0.2 / (0.4 + 0.6 * 0.2), rel=1e-9)


@pytest.mark.parametrize("z", [[], [[1e6, 0.0]], RETURNS])
def test_a_sensor_that_never_misses_needs_no_gate_to_stay_finite(z):
    state = after(config(gate="off", radar={"detection_probability": 1.0, "clutter_density": 0.0}), z)
    assert np.all(np.isfinite(state.weights))
    assert np.all(np.isfinite(state.belief.mean))
    assert state.weights.sum() == pytest.approx(1.0)


def test_the_word_stands_for_a_probability_of_one_and_is_written_as_that():
    off = vedette.load(config(gate="off"))
    assert off.tracker.gate == Gate(1.0) == vedette.build(config(gate={"probability": 1})).gate
    written = to_config(off)
    assert written["gate"]["probability"] == 1.0
    assert vedette.load(written).tracker.gate == off.tracker.gate
    assert vedette.load(config(), overrides=["gate=off"]).tracker.gate == off.tracker.gate


@pytest.mark.parametrize(
    ("gate", "told"),
    [
        ("of", r"gate: must be a table.*'off'"),
        ({"probability": 1, "clutter": "nonparametric"}, r"gate.clutter: 'nonparametric' counts the returns in a gate"),
    ],
)
def test_what_is_no_gate_is_told(gate, told):
    with pytest.raises(ConfigError, match=told):
        vedette.load(config(gate=gate))


def camera(gate, **more):
    return vedette.build(
        {
            "estimator": {
                "kind": "iekf",
                "passes": 4,
                "motion": {
                    "kind": "carrying",
                    "motion": {"kind": "image_velocity"},
                    "carries": {"amplitude": "count", "spread": "px", "background": "count"},
                },
            },
            "sensors": {"camera": {"kind": "gaussian_spot", "camera": {"window": 16}, **more}},
            "associator": {"kind": "pda"},
            "birth": {"kind": "given"},
            "lifecycle": {"kind": "single_target"},
            **gate,
        }
    )


def seen(tracker, at):
    """Return the state after a frame of unit noise with a spot of 10 counts at x, or without one."""
    prior = Gaussian(np.array([[15.0, 15.0, 0, 0, 10.0, 2.0, 0]]), np.diag([0.01, 0.01, 1, 1, 0, 0, 0])[None])
    pixels = np.random.default_rng(1).standard_normal((31, 31))
    if at is not None:
        x = np.array([at, 15.0, 10.0, 2.0, 0.0])
        pixels = pixels + tracker.sensors["camera"].render(x, pixels.shape)
    return tracker.step(tracker.start(prior, 0.0), Scan.image(0.0, "camera", Frame(pixels)))


@pytest.mark.parametrize("gate", [{}, {"gate": {"probability": 0.5}}])
def test_a_frame_is_judged_by_its_pixels_and_not_by_how_far_the_target_moved(gate):
    jumped = seen(camera(gate), 16.5)
    assert jumped.distances[0, 0] > 25.0  # far outside the gate that returns of a radar have
    assert jumped.hit[0] > 0.999
    assert seen(camera(gate), None).hit[0] < 0.001


def test_without_a_gate_a_camera_s_p_d_alone_says_what_a_miss_weighs():
    surely, mostly = (camera({"gate": "off"}, detection_probability=p) for p in (1.0, 0.95))
    assert seen(surely, 16.5).hit[0] == 1.0
    assert seen(mostly, 16.5).hit[0] > 0.999
    assert seen(mostly, None).hit[0] < 0.001


@pytest.mark.parametrize("by", ["jpda", "lmb", "m_best_jpda", "variational"])
def test_pairs_of_targets_far_apart_are_tracked_as_each_is_alone(by):
    """Eight pairs 100 km apart were one cluster, too large for exact weights: 13.7 m off."""
    built = vedette.build(config(
        associator={"kind": by}, gate="off", lifecycle={"kind": "existence"},
        birth={"kind": "from_returns", "spread": {"vx": 2.0, "vy": 2.0}, "initial": 0.5},
    ))  # fmt: skip
    rng = np.random.default_rng(1)
    places = np.array([[0.0, 0.0], [0.0, 2.5]])
    scans = [[places + rng.normal(0, 1.0, (2, 2)) + [1e5 * pair, 0.0] for pair in range(8)] for _ in range(5)]
    whole, alone = built.start(), built.start()
    for time, parts in enumerate(scans):
        whole = built.step(whole, Scan(float(time), "radar", Detections.of(np.concatenate(parts))))
        alone = built.step(alone, Scan(float(time), "radar", Detections.of(parts[0])))
    mine = built.estimate(whole).mean[:, 0] < 5e4
    assert whole.approximated == 0
    np.testing.assert_allclose(built.estimate(whole).mean[mine], built.estimate(alone).mean, rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(whole.existence[mine], alone.existence, rtol=1e-9)
