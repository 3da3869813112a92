"""Cameras with a model of the target's image: elongated spots, several spots, correlated noise, learning of looks."""

import numpy as np
import pytest
from attrs import evolve

from vedette import Frame, Gaussian
from vedette.filters import evaluate_frame
from vedette_flir.camera import Camera
from vedette_flir.motion.constant_axes import Carrying
from vedette_flir.motion.jittered_wander import JitteredWander
from vedette_flir.sensors.elliptic_spot import EllipticSpot
from vedette_flir.sensors.gaussian_spot import GaussianSpot
from vedette_flir.sensors.hot_spots import HotSpots, Spot
from vedette_flir.spots import bivariate, circular, elliptic

THREE = (Spot(1.2, 1.2), Spot(0.8, 1.6, 0.5, 0.7, x=3.0, y=1.0), Spot(1.0, 1.0, 0.0, -0.4, x=-2.0, y=2.0))
CAMERAS = {
    "circular": (GaussianSpot(), [12.0, 1.4, 5.0]),
    "elliptic": (EllipticSpot(), [12.0, 1.2, 1.9, 0.5, 5.0]),
    "several": (HotSpots(spots=THREE), [12.0, 0.6, 5.0]),
}


def seen_by(sensor, looks, at=(12.2, 9.7), sigma=1.3, seed=7, size=(24, 24)):
    """The axes of the sensor (1, n), and a frame of the target with noise."""
    x = np.array([[*at, *looks]])
    noise = sigma * np.random.default_rng(seed).standard_normal(size)
    return x, Frame(looks[-1] + noise + sensor.render(x, size)[0])


@pytest.mark.parametrize("name", CAMERAS)
def test_a_picture_s_parts_are_its_derivatives(name):
    sensor, looks = CAMERAS[name]
    steps, spot, h = np.arange(10) - 4.5, np.array([0.3, -0.4]), 1e-5
    looks = np.array(looks)

    def image(p, q):
        return sensor.picture(tuple(q), steps - p[0], steps - p[1]).image + q[-1]

    made = sensor.picture(tuple(looks), steps - spot[0], steps - spot[1])
    for k in range(2):
        step = h * np.eye(2)[k]
        slope = (image(spot + step, looks) - image(spot - step, looks)) / (2 * h)
        np.testing.assert_allclose(made.slopes[k], slope, atol=2e-5)  # the quadrature's own error
    for k in range(len(looks)):
        step = h * np.eye(len(looks))[k]
        slope = (image(spot, looks + step) - image(spot, looks - step)) / (2 * h)
        np.testing.assert_allclose(made.looks[k], slope, atol=2e-5)


def test_an_elliptic_spot_is_the_integral_over_each_pixel():
    from scipy.integrate import dblquad

    steps, W = np.arange(6) - 2.5, np.linalg.inv(np.array([[1.0, 0.84], [0.84, 1.96]]))
    image, _, _ = elliptic(steps - 0.2, steps + 0.1, bivariate(*np.array([1.0, 1.4, 0.6])))
    for i, j in ((2, 2), (3, 4), (0, 5)):
        exact, _ = dblquad(
            lambda y, x: np.exp(-0.5 * (W[0, 0] * x * x + 2 * W[0, 1] * x * y + W[1, 1] * y * y)),
            steps[j] - 0.7, steps[j] + 0.3, steps[i] - 0.4, steps[i] + 0.6, epsabs=1e-12,
        )  # fmt: skip
        assert image[i, j] == pytest.approx(exact, abs=1e-6)


def test_several_spots_add_up_and_turn_as_one():
    steps = np.arange(15) - 7.0
    alone = [HotSpots(spots=(spot,)).picture(tuple(np.array([2.0, 0.4, 0.0])), steps, steps).image for spot in THREE]
    sensor = HotSpots(spots=THREE)
    np.testing.assert_allclose(sensor.picture(tuple(np.array([2.0, 0.4, 0.0])), steps, steps).image, sum(alone), atol=1e-12)
    straight, turned = (sensor.picture(tuple(np.array([2.0, turn, 0.0])), steps, steps).image for turn in (0.0, np.pi / 2))
    np.testing.assert_allclose(turned, np.rot90(straight, -1), atol=1e-12)  # x right, y down: from x towards y is clockwise
    assert np.abs(turned - np.rot90(straight)).max() > 0.1  # the other way round it is another image


def test_cameras_agree_where_their_models_do():
    plain, looks = CAMERAS["circular"]
    x, frame = seen_by(plain, looks)
    same = {
        EllipticSpot(): [[12.2, 9.7, 12.0, 1.4, 1.4, 0.0, 5.0]],
        HotSpots(spots=(Spot(1.4, 1.4),)): [[12.2, 9.7, 12.0, 0.9, 5.0]],
    }
    for sensor, other in same.items():
        y = np.array(other)
        for one, two in zip(plain.information(x, frame, x), sensor.information(y, frame, y), strict=True):
            np.testing.assert_allclose(two, one, rtol=1e-6)


def innovation_form(sensor, looks, x, frame, P, state):
    """Shift and covariance by the textbook's K = P H' (H P H' + R)^-1 over all pixels of the window, and J, g by R^-1."""
    window = sensor.camera.cut(frame, x[:, :2])
    made = sensor.picture(sensor.looks(x), *window.offsets(x[:, :2]))
    seen = window.seen.ravel()
    R = sensor.camera.covariance()[seen][:, seen]
    D = made.slopes.reshape(2, -1).T[seen]
    rest = (window.values - made.image - looks[-1]).ravel()[seen]
    C = np.zeros((2, len(state)))
    C[0, 0] = C[1, 1] = 1.0
    S = D @ C @ P @ C.T @ D.T + R
    K = np.linalg.solve(S, D @ C @ P).T
    weight = np.linalg.inv(R)
    return K @ rest, P - K @ D @ C @ P, D.T @ weight @ D, D.T @ weight @ rest


@pytest.mark.parametrize("correlated", [0.0, 0.8])
@pytest.mark.parametrize("holes", [False, True])
@pytest.mark.parametrize("name", CAMERAS)
def test_information_form_equals_innovation_form(name, holes, correlated):
    """To 1e-9, J by the exact inverse of the covariance of the pixels that are there."""
    sensor, looks = CAMERAS[name]
    sensor = evolve(sensor, camera=Camera(sigma=1.3, correlated=correlated, length=2.5, window=10))
    x, frame = seen_by(sensor, looks)
    if holes:
        frame.pixels[8:10, 11] = np.nan
    motion = Carrying(JitteredWander(), {axis.name: _unit(axis) for axis in sensor.observes.axes[2:]})
    root = np.random.default_rng(3).standard_normal((4, 4)) * 0.2
    P = np.zeros((4 + len(looks),) * 2)
    P[:4, :4] = root @ root.T + 0.01 * np.eye(4)
    mean = np.array([[*x[0, :2], 0.1, -0.2, *looks]])
    shift, post, J, g = innovation_form(sensor, looks, x, frame, P, motion.state)
    found = evaluate_frame(Gaussian(mean, P[None]), motion.state, sensor, frame, 0.99)
    np.testing.assert_allclose(found.detail.shift[0, 0], shift, rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.detail.post[0, 0], post, rtol=0, atol=1e-9)
    own = sensor.information(x, frame, x)
    np.testing.assert_allclose(own[0][0], J, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(own[1][0], g, rtol=1e-9, atol=1e-9)
    if correlated:  # a camera that takes the same noise for white says something else
        white = evolve(sensor, camera=Camera(sigma=1.3, window=10)).information(x, frame, x)[0][0]
        assert np.abs(white - J).max() > 0.1 * np.abs(J).max()


def _unit(axis):
    return axis.unit if axis.period is None else f"{axis.unit} mod 2pi"


@pytest.mark.parametrize("name", CAMERAS)
def test_the_score_is_the_derivative_of_the_ratio(name):
    sensor, looks = CAMERAS[name]
    x, frame = seen_by(sensor, looks)
    g, h = sensor.information(x, frame, x)[1][0], 1e-4
    for k in range(2):
        step = np.zeros_like(x)
        step[0, k] = h
        up, down = (sensor.information(x, frame, x + side * step)[2][0] for side in (1, -1))
        assert g[k] == pytest.approx((up - down) / (2 * h), rel=1e-4, abs=1e-3)


@pytest.mark.parametrize(
    ("sensor", "true", "guess"),
    [
        (GaussianSpot(gain_amplitude=0.3, gain_spread=0.3, gain_background=0.3), [20.0, 1.6, 7.0], [10.0, 2.2, 5.0]),
        (
            EllipticSpot(gain_amplitude=0.3, gain_shape=0.3, gain_background=0.3),
            [20.0, 1.2, 2.0, 0.6, 7.0],
            [14.0, 1.7, 1.7, 0.0, 5.0],
        ),
        (HotSpots(spots=THREE, gain_amplitude=0.3, gain_turn=0.3, gain_background=0.3), [20.0, 0.9, 7.0], [14.0, 0.4, 5.0]),
    ],
)
def test_looks_that_are_learnt_come_true(sensor, true, guess):
    """On frames without noise. With gain 0 they stay, and one frame's step is the gain's part of the way."""
    sensor = evolve(sensor, camera=Camera(window=16))
    x, frame = seen_by(sensor, true, sigma=0.0)
    x[0, 2:] = guess
    for _ in range(80):
        x = sensor.learn(x, frame)
    np.testing.assert_allclose(x[0, 2:], true, rtol=1e-4)
    np.testing.assert_array_equal(x[0, :2], [12.2, 9.7])
    fixed = evolve(sensor, **dict.fromkeys(("gain_amplitude", "gain_background"), 0.0))
    y = x.copy()
    y[0, [2, -1]] = 1.0
    np.testing.assert_array_equal(fixed.learn(y, frame)[0, [2, -1]], [1.0, 1.0])


def test_a_background_alone_is_learnt_by_its_gain():
    """B <- b + gain (mean - b), by hand, where nothing else is learnt: 5 becomes 5 + .25 (9 - 5)."""
    sensor = GaussianSpot(gain_background=0.25)
    x = np.array([[12.0, 12.0, 0.0, 1.5, 5.0]])
    np.testing.assert_allclose(sensor.learn(x, Frame(np.full((24, 24), 9.0)))[0], [12, 12, 0, 1.5, 6.0], atol=1e-7)


def test_a_spread_that_is_learnt_stays_in_bounds():
    sensor = GaussianSpot(gain_spread=1.0)
    x = np.array([[12.0, 12.0, 10.0, 1.5, 0.0]])
    flat = Frame(np.full((24, 24), 10.0))
    for _ in range(40):
        before, x = x, sensor.learn(x, flat)
        assert abs(x[0, 3] - before[0, 3]) <= 0.5
    assert 0.4 <= x[0, 3] <= 6.0


def test_the_printed_correlation_would_not_do():
    """The mutant: 1 / (1 - r)^2 in place of 1 / (1 - r^2) gives a mirrored target another width."""
    steps = np.arange(8) - 3.5

    def printed(r):
        narrower = np.sqrt((1 - r) ** 2 / (1 - r * r))
        return elliptic(steps, steps, narrower**2 * bivariate(*np.array([1.0, 2.0, r])))[0]

    def right(r):
        return elliptic(steps, steps, bivariate(*np.array([1.0, 2.0, r])))[0]

    np.testing.assert_allclose(right(0.5)[:, ::-1], right(-0.5), atol=1e-12)
    assert np.abs(printed(0.5)[:, ::-1] - printed(-0.5)).max() > 0.2
    round_image, _, _ = circular(steps, steps, np.asarray(1.5))
    np.testing.assert_allclose(elliptic(steps, steps, bivariate(*np.array([1.5, 1.5, 0.0])))[0], round_image, atol=1e-9)


def test_spots_that_cannot_be_are_refused():
    with pytest.raises(ValueError, match="spots: must hold at least one"):
        HotSpots(spots=())
    with pytest.raises(ValueError, match=r"correlation: must be >= -0\.95 and <= 0\.95, got 1"):
        Spot(1.0, 1.0, 1.0)
    with pytest.raises(ValueError, match=r"spots\[1\]\.x: .* 4 px, got -4\.5 px"):
        HotSpots(spots=(Spot(1.0, 1.0), Spot(1.0, 1.0, x=-4.5)))
    with pytest.raises(ValueError, match=r"spots: .* cancel"):
        HotSpots(spots=(Spot(1.0, 1.0), Spot(1.0, 1.0, peak=-1.0)))


@pytest.mark.parametrize("correlated", [0.0, 0.5])
def test_the_noise_is_what_a_whole_picture_leaves(correlated):
    """Of wide spots in a wide window. Pixels blur; the density of a coloured noise is taken at one frequency."""
    camera = Camera(window=32, sigma=2.0, correlated=correlated, length=1.5)
    spots = (Spot(2.0, 3.0, 0.4), Spot(2.5, 2.0, -0.3, 0.6, x=5.0, y=1.0), Spot(2.0, 2.0, 0.0, -0.4, x=-4.0, y=3.0))
    looking = {
        GaussianSpot(camera=camera): [9.0, 2.5, 0.0],
        EllipticSpot(camera=camera): [9.0, 2.0, 4.0, 0.6, 0.0],
        HotSpots(camera=camera, spots=spots): [9.0, 0.7, 0.0],
    }
    for sensor, looks in looking.items():
        x = np.array([[15.7, 16.2, *looks]])
        J, _, _ = sensor.information(x, Frame(sensor.render(x[0], (32, 32))), x)
        np.testing.assert_allclose(sensor.noise(x)[0] @ J[0], np.eye(2), atol=0.06 if correlated == 0 else 0.4)


def test_an_image_alone_is_that_of_the_picture_to_the_last_bit():
    rng = np.random.default_rng(5)
    looks = rng.uniform(1.0, 9.0, (4, 2)), rng.uniform(0.4, 4.0, (4, 2)), np.zeros((4, 2))
    x, y = rng.uniform(-9.0, 9.0, (2, 4, 2, 1)) + np.arange(12.0)
    camera = GaussianSpot()
    np.testing.assert_array_equal(camera.image(looks, x, y), camera.picture(looks, x, y).image)
    for other, more in ((EllipticSpot(), (looks[1], np.full((4, 2), 0.3))), (HotSpots(spots=THREE), ())):
        seen = (looks[0], looks[1], *more, looks[2])
        np.testing.assert_allclose(other.image(seen, x, y), other.picture(seen, x, y).image, rtol=1e-12, atol=1e-12)
    state = np.array([5.2, 3.9, 7.0, 1.3, 0.0])
    np.testing.assert_array_equal(camera.render(state, (6, 14)), camera.render(state, (14, 14))[:6])
