"""The simulated infrared scene, and the filter on it and on matched truth in lock-step."""

import numpy as np
import pytest
from attrs import evolve

import vedette
from support.paths import EXAMPLES
from vedette import Frame, Gaussian, Scan
from vedette.metrics.consistency import nees
from vedette.sampling import draw_gaussian, draw_states
from vedette_flir.motion.atmospheric_wander import AtmosphericWander
from vedette_flir.motion.image_velocity import ImageVelocity
from vedette_flir.sensors.gaussian_spot import GaussianSpot
from vedette_sim.infrared import HotSpot, HotTarget, InfraredScene
from vedette_study.lockstep import run_together

EXAMPLE = EXAMPLES / "flir.toml"


def scene(**more):
    still = HotTarget(
        ImageVelocity(sigma_accel=1e-6, shake=0.0),
        (HotSpot(50.0, 1.5),),
        {"x": (10.0, 0.0), "y": (7.0, 0.0), "vx": (30.0, 0.0), "vy": (0.0, 0.0)},
    )
    return InfraredScene(**({"targets": {"one": still}, "width": 40, "height": 24, "frames": 12} | more))


def frames_of(source, seed=1):
    recording = source.open({"camera": GaussianSpot()}, np.random.default_rng(seed))
    return np.stack([scan.frame.pixels for scan in recording.scans]), recording


def test_the_spot_is_where_the_truth_says_and_drawn_as_the_camera_expects():
    images, recording = frames_of(scene(sigma=0.0, drift=(0.0, 15.0)))
    at = recording.truth[0].states
    np.testing.assert_allclose(at[:, 0], 10.0 + np.arange(12.0), atol=1e-4)
    np.testing.assert_allclose(at[:, 1], 7.0 + 0.5 * np.arange(12), atol=1e-4)
    looks = np.column_stack([at[:, :2], np.tile([50.0, 1.5, 0.0], (12, 1))])
    np.testing.assert_allclose(images, GaussianSpot().render(looks, (24, 40)), atol=1e-10)


def test_the_seed_decides_and_another_target_changes_nothing_else():
    plain = scene(clutter=2.0)
    first, _ = frames_of(plain)
    np.testing.assert_array_equal(first, frames_of(plain)[0])
    assert not np.array_equal(first, frames_of(plain, seed=2)[0])
    other = evolve(plain.targets["one"], spots=(HotSpot(0.0, 1.0),))
    np.testing.assert_array_equal(first, frames_of(evolve(plain, targets={**plain.targets, "two": other}))[0])


@pytest.mark.statistical(alpha=1e-6)
def test_the_background_has_the_stated_covariance():
    """Lagged products over space and time, with 5-sigma bands from 64 independent scenes."""
    made = [
        frames_of(scene(targets={"one": evolve(scene().targets["one"], spots=(HotSpot(0.0, 1.0),))}, sigma=0.0, clutter=3.0,
                        clutter_time=0.2, frames=4), seed)[0] for seed in range(64)
    ]  # fmt: skip
    fields = np.stack(made)
    for lag, apart, expected in ((0, 0, 9.0), (0, 2, 9.0 * np.exp(-1 / 4)), (3, 0, 9.0 * np.exp(-3 / 30 / 0.2))):
        products = (fields[:, : 4 - lag, :, : 40 - apart] * fields[:, lag:, :, apart:]).mean(axis=(1, 2, 3))
        assert abs(products.mean() - expected) < 5 * products.std(ddof=1) / 8


def test_spots_turn_and_dead_pixels_are_nan():
    pair = evolve(
        scene().targets["one"], spots=(HotSpot(50.0, 1.0, x=4.0), HotSpot(-20.0, 1.0, x=-4.0)), turn_rate=np.pi * 15
    )
    images, _ = frames_of(scene(targets={"one": pair}, sigma=0.0, dead=0.1, frames=2))
    assert np.isnan(images).any()
    np.testing.assert_array_equal(np.isnan(images[0]), np.isnan(images[1]))
    j, i = np.unravel_index(np.nanargmax(images[1]), images[1].shape)
    assert abs(i - 11) <= 1
    assert abs(j - 11) <= 1  # a quarter turn from x towards y


@pytest.mark.costly
def test_the_example_keeps_its_target():
    experiment = vedette.load(EXAMPLE)
    result = experiment.run()
    from vedette_report.pixels import pixel_figures

    track, truth = result.tracks[0], result.recording.truth[0]
    seen = track.mean[:, :2] + track.mean[:, 2:4]
    true = truth.states[:, :2] + truth.states[:, 2:4]
    assert np.sqrt(np.mean((seen - true)[30:] ** 2)) < 0.12  # .083 on average, of 420 numbers
    assert pixel_figures(result.tracks, result.recording.truth)["lost"] == 0.0


def matched(runs, spread, snr, passes, seed, frames=150):
    """Errors of the apparent position, NEES / 4, NIS / 2 (r, s) after 30 frames, and which runs ever lost the spot (r,)."""
    rng = np.random.default_rng(seed)
    truth = AtmosphericWander()
    times = np.arange(frames) / 30
    settled = draw_gaussian(np.zeros(8), truth.noise(np.zeros(8), 100.0), rng, (runs,))
    path = draw_states(truth, settled, times, rng)
    place, jitter = path[..., :2], path[..., 2:4] + path[..., 4:6]
    experiment = vedette.load(EXAMPLE, overrides=[f"estimator.passes={passes}", "gate.probability=0.999999999"])
    tracker, half = experiment.tracker, 16

    def scans():
        camera = GaussianSpot()
        for k, time in enumerate(times):
            seen = place[:, k] + jitter[:, k]
            corner = np.rint(seen) - half
            looks = np.concatenate([seen - corner, np.broadcast_to([snr, spread, 0.0], (runs, 3))], axis=1)
            pixels = camera.render(looks, (33, 33)) + rng.standard_normal((runs, 33, 33))
            yield Scan.image(time, "camera", Frame(pixels, corner))

    cov = np.diag([0.25, 0.25, 0.04, 0.04, 0, 0, 0])
    start = np.concatenate([place[:, 0], jitter[:, 0]], axis=1) + rng.standard_normal((runs, 4)) * np.sqrt(np.diag(cov)[:4])
    mean = np.concatenate([start, np.broadcast_to([snr, spread, 0.0], (runs, 3))], axis=1)[:, None]
    found = run_together(tracker, Gaussian(mean, np.broadcast_to(cov, (runs, 1, 7, 7))), 0.0, scans())
    error = found.mean[..., :4] - np.concatenate([place, jitter], axis=-1)
    apparent = error[..., :2] + error[..., 2:]
    lost = np.any(np.hypot(apparent[..., 0], apparent[..., 1]) > 4.0, axis=1)
    after = slice(30, None)
    return apparent[:, after], nees(error[:, after], found.cov[:, after, :4, :4]) / 4, found.nis[:, after] / 2, lost


def riccati(spread, snr):
    """Steady error of the apparent position for the whole information of a frame on x + jitter, by iterating one axis."""
    steps = np.arange(8) - 3.5
    from vedette_flir.spots import circular

    information = snr**2 * np.sum(circular(steps, steps, np.asarray(spread))[1][0] ** 2)
    F = np.diag([np.exp(-1 / 60), np.exp(-1 / 30 / 0.076)])
    settled = np.diag([9.0, 0.04])
    P, seen = settled, np.array([1.0, 1.0])
    for _ in range(500):
        P = F @ P @ F.T + settled - F @ settled @ F.T
        P = np.linalg.inv(np.linalg.inv(P) + information * np.outer(seen, seen))
    return np.sqrt(seen @ P @ seen)


@pytest.mark.statistical(alpha=1e-6)
@pytest.mark.parametrize(("spread", "snr"), [(2.0, 5.0), (2.0, 10.0), (3.0, 10.0)])
@pytest.mark.costly
def test_the_iterated_filter_reaches_the_bound(spread, snr):
    """100 runs; the bands are the stated ones, each over five of the run means' standard errors from the true figure."""
    error, squared, innovation, lost = matched(100, spread, snr, 3, seed=11)
    assert not lost.any()
    assert np.sqrt(np.mean(error**2)) <= 1.10 * riccati(spread, snr)
    assert 0.9 < squared.mean() < 1.1
    assert 0.95 < innovation.mean() < 1.05


@pytest.mark.costly
@pytest.mark.statistical(alpha=1e-6)
def test_one_pass_is_inconsistent_on_a_narrow_spot():
    """The paper's own filter: its errors are far larger than it says where the prediction errs by a spot's width."""
    error, squared, _, lost = matched(100, 1.0, 10.0, 1, seed=12)
    again, iterated, _, lost_again = matched(100, 1.0, 10.0, 3, seed=12)
    assert squared[~lost].mean() > 1.8
    assert iterated[~lost_again].mean() < 1.1
    assert np.sqrt(np.mean(error[~lost] ** 2)) > 1.5 * np.sqrt(np.mean(again[~lost_again] ** 2))
    assert not lost_again.any()
