"""Models and cameras of the imaging plugin: exact discretisation, derivatives, the information pair."""

import numpy as np
import pytest

from vedette import Frame, Gaussian
from vedette.filters import evaluate_frame
from vedette.testing import conformance
from vedette_flir.camera import Camera
from vedette_flir.motion.atmospheric_wander import AtmosphericWander
from vedette_flir.motion.constant_axes import Carrying
from vedette_flir.motion.jittered_acceleration import JitteredAcceleration
from vedette_flir.motion.jittered_wander import JitteredWander
from vedette_flir.sensors.gaussian_spot import GaussianSpot
from vedette_flir.spots import circular

TestJitteredAcceleration = conformance(JitteredAcceleration)
TestJitteredWander = conformance(JitteredWander)
LOOKS = {"amplitude": "count", "spread": "px", "background": "count"}


def whole_filter(w1, w2, k):
    """A and G of K W1 W2^2 / ((s + W1)(s + W2)^2) as a chain of first-order lags: another realisation, the same output."""
    A = np.array([[-w1, w1, 0.0], [0.0, -w2, w2], [0.0, 0.0, -w2]])
    return A, np.array([0.0, 0.0, k * w2])


def test_atmosphere_has_the_stated_deviation_and_the_paper_s_constant():
    model = AtmosphericWander(sigma_jitter=1.0)
    settled = model.noise(np.zeros(8), 100.0)
    seen = np.array([0, 0, 1.0, 0, 1.0, 0, 0, 0])
    assert seen @ settled @ seen == pytest.approx(1.0, rel=1e-12)
    first, second, third = model.gains
    assert second == -first
    assert first * (659.5 - 14.14) ** 2 / (14.14 * 659.5**2) == pytest.approx(0.3821, abs=5e-5)
    assert third / first == pytest.approx(14.14 - 659.5, rel=1e-12)


@pytest.mark.parametrize("dt", [1e-4, 1 / 60, 1 / 30, 0.5, 3.0])
def test_atmosphere_is_the_chain_of_lags_exactly(dt):
    """Autocovariance over dt, and noise = P - F P F', of the Jordan form against scipy's matrix functions of the chain."""
    from scipy.linalg import expm, solve_continuous_lyapunov

    model = AtmosphericWander(sigma_jitter=0.7)
    k = 2 * 0.7 * (14.14 + 659.5) / np.sqrt(14.14 * 659.5 * (14.14 + 2 * 659.5))
    A, G = whole_filter(14.14, 659.5, k)
    settled = solve_continuous_lyapunov(A, -np.outer(G, G))
    F, Q = (
        np.asarray(m)[np.ix_([2, 4, 6], [2, 4, 6])] for m in (model.jacobian(np.zeros(8), dt), model.noise(np.zeros(8), dt))
    )
    stationary = model.noise(np.zeros(8), 100.0)[np.ix_([2, 4, 6], [2, 4, 6])]
    out = np.array([1.0, 1.0, 0.0])
    assert out @ F @ stationary @ out == pytest.approx((expm(A * dt) @ settled)[0, 0], rel=1e-9, abs=1e-14)
    assert out @ Q @ out == pytest.approx((settled - expm(A * dt) @ settled @ expm(A * dt).T)[0, 0], rel=1e-6, abs=1e-12)
    scale = np.sqrt(np.outer(np.diag(stationary), np.diag(stationary)))
    assert np.max(np.abs(stationary - F @ stationary @ F.T - Q) / scale) < 1e-13


def test_atmosphere_steps_join_and_stay_positive():
    model = AtmosphericWander()
    for a, b in ((1e-5, 3e-5), (1 / 60, 1 / 60), (0.01, 1.0)):
        Fb, Qa, Qb = model.jacobian(np.zeros(8), b), model.noise(np.zeros(8), a), model.noise(np.zeros(8), b)
        joined = model.noise(np.zeros(8), a + b)
        np.testing.assert_allclose(Fb @ Qa @ Fb.T + Qb, joined, rtol=1e-9, atol=1e-15 * joined.max())
        scale = np.sqrt(np.diag(joined))
        assert np.linalg.eigvalsh(joined / np.outer(scale, scale)).min() > -1e-14


def test_jitter_of_first_order_has_the_atmosphere_s_memory():
    model = AtmosphericWander(sigma_jitter=1.0)
    F, settled = model.jacobian(np.zeros(8), 1 / 30), model.noise(np.zeros(8), 100.0)
    seen = np.array([0, 0, 1.0, 0, 1.0, 0, 0, 0])
    memory = seen @ F @ settled @ seen
    assert memory == pytest.approx(0.6449, abs=5e-4)
    assert np.exp(-1 / 30 / 0.076) == pytest.approx(memory, abs=1e-3)


def test_carrying_adds_still_axes():
    inner = JitteredWander()
    model = Carrying(inner, LOOKS)
    x = np.arange(14.0).reshape(2, 7)
    np.testing.assert_array_equal(model.move(x, 0.1)[:, :4], inner.move(x[:, :4], 0.1))
    np.testing.assert_array_equal(model.move(x, 0.1)[:, 4:], x[:, 4:])
    assert not model.noise(x, 0.1)[..., 4:, :].any()
    assert model.zero_variance.names == tuple(LOOKS)
    with pytest.raises(ValueError, match=r"carries\.x"):
        Carrying(inner, {"x": "px"})


def spot_cases():
    rng = np.random.default_rng(3)
    return [(rng.uniform(-1.5, 1.5, 2), spread) for spread in (0.5, 1.0, 2.0, 3.0)]


@pytest.mark.parametrize(("spot", "spread"), spot_cases())
def test_circular_spot_is_the_integral_and_its_slopes_the_derivative(spot, spread):
    from scipy.integrate import dblquad

    steps = np.arange(8) - 3.5

    def image(p, s):
        return circular(steps - p[0], steps - p[1], np.asarray(s))

    value, slopes, wider = image(spot, spread)
    for i, j in ((3, 4), (0, 6)):
        exact, _ = dblquad(
            lambda y, x: np.exp(-0.5 * ((x - spot[0]) ** 2 + (y - spot[1]) ** 2) / spread**2),
            steps[j] - 0.5, steps[j] + 0.5, steps[i] - 0.5, steps[i] + 0.5, epsabs=1e-12,
        )  # fmt: skip
        assert value[i, j] == pytest.approx(exact, abs=1e-10)
    h = 1e-5
    for k in range(2):
        step = h * np.eye(2)[k]
        np.testing.assert_allclose(
            slopes[k], (image(spot + step, spread)[0] - image(spot - step, spread)[0]) / (2 * h), atol=1e-9
        )
    np.testing.assert_allclose(wider, (image(spot, spread + h)[0] - image(spot, spread - h)[0]) / (2 * h), atol=1e-9)


@pytest.mark.parametrize("correlated", [0.0, 0.8])
@pytest.mark.parametrize("snr", [2.0, 20.0])
def test_information_form_equals_innovation_form(correlated, snr):
    """The update by (J, g) against the textbook's K = P H' (H P H' + R)^-1 over all 64 pixels."""
    rng = np.random.default_rng(7)
    motion = Carrying(JitteredAcceleration(), LOOKS)
    camera = Camera(sigma=1.3, correlated=correlated)
    sensor = GaussianSpot(across=("x", "jx"), down=("y", "jy"), camera=camera)
    mean = np.zeros((1, 11))
    mean[0] = [12.2, 9.7, 3, 4, 5, 6, 0.1, -0.1, snr * 1.3, 1.4, 5.0]
    root = rng.standard_normal((8, 8)) * 0.2
    cov = np.zeros((1, 11, 11))
    cov[0, :8, :8] = root @ root.T + 0.01 * np.eye(8)
    frame = Frame(
        5.0 + 1.3 * rng.standard_normal((24, 24)) + sensor.render(mean[:, motion.state.locate(sensor.observes)], (24, 24))[0]
    )
    where = motion.state.locate(sensor.observes)
    innovation = evaluate_frame(Gaussian(mean, cov), motion.state, sensor, frame, 0.99)
    window = camera.cut(frame, sensor.measure(mean[:, where]))
    image, slopes, _ = circular(*window.offsets(sensor.measure(mean[:, where])), mean[..., 9])
    C = np.zeros((2, 11))
    C[0, [0, 6]] = C[1, [1, 7]] = 1.0
    H = (snr * 1.3 * slopes.reshape(2, 64)).T @ C
    R = camera.covariance()
    S = H @ cov[0] @ H.T + R
    K = np.linalg.solve(S, H @ cov[0]).T
    rest = (window.values - snr * 1.3 * image - 5.0).reshape(64)
    np.testing.assert_allclose(innovation.detail.shift[0, 0], K @ rest, rtol=0, atol=1e-9)
    np.testing.assert_allclose(innovation.detail.post[0, 0], cov[0] - K @ H @ cov[0], rtol=0, atol=1e-9)
    Ri = np.linalg.inv(R)
    J = (H @ C.T / 2).T @ Ri @ (H @ C.T / 2)  # C C' = 2 I
    statistic = np.linalg.solve(J, (H @ C.T / 2).T @ Ri @ rest)
    spread = np.linalg.inv(J) + C @ cov[0] @ C.T
    assert innovation.nis[0, 0] == pytest.approx(statistic @ np.linalg.solve(spread, statistic), rel=1e-9)
    h = (snr * 1.3 * image).reshape(64)
    rest_of_background = rest + h
    whole = -0.5 * rest @ np.linalg.solve(S, rest) - 0.5 * np.linalg.slogdet(S)[1]
    empty = -0.5 * rest_of_background @ Ri @ rest_of_background - 0.5 * np.linalg.slogdet(R)[1]
    assert innovation.loglik[0, 1] == pytest.approx(whole - empty, abs=1e-8)


def test_a_frame_that_tells_nothing_leaves_the_belief():
    motion = Carrying(JitteredWander(), LOOKS)
    sensor = GaussianSpot()
    mean = np.array([[50.0, 50.0, 0, 0, 10.0, 2.0, 0.0]])
    cov = np.diag([1.0, 1, 0.1, 0.1, 0, 0, 0])[None]
    for pixels in (np.full((20, 20), 7.0), np.full((100, 100), np.nan)):
        innovation = evaluate_frame(Gaussian(mean, cov), motion.state, sensor, Frame(pixels), 0.99, passes=3)
        assert not innovation.detail.shift.any()
        np.testing.assert_allclose(innovation.detail.post[0, 0], cov[0], atol=1e-15)
        assert innovation.nis[0, 0] == 0
        assert innovation.loglik[0, 0] == 0.0  # where no pixel is known P_D is 0: the frame is a miss
        assert innovation.loglik[0, 1] < -700.0


def test_one_frame_s_bound_does_not_depend_on_the_spread():
    """sqrt(2 / pi) / SNR in continuous light; pixels of unit size and the 8 x 8 window change it a little."""
    for spread, factor in ((0.75, 0.920), (1.0, 0.866), (1.5, 0.829), (2.0, 0.838), (3.0, 1.006)):
        steps = np.arange(8) - 3.5
        _, slopes, _ = circular(steps, steps, np.asarray(spread))
        J = np.sum(10.0**2 * slopes[0] ** 2)
        assert 10.0 / np.sqrt(J) == pytest.approx(factor, abs=0.06)


def test_batch_equals_loop_and_windows_at_the_edge():
    rng = np.random.default_rng(5)
    sensor = GaussianSpot(gain_amplitude=0.1, gain_spread=0.1, gain_background=0.1)
    pixels = rng.standard_normal((3, 16, 18))
    pixels[1, 4, 4] = np.nan
    corner = rng.integers(-3, 3, (3, 2)).astype(float)
    x = np.concatenate([rng.uniform(-2, 18, (3, 2, 2)), np.broadcast_to([8.0, 1.5, 0.1], (3, 2, 3))], axis=-1)
    J, g, llr = sensor.information(x, Frame(pixels, corner), x)
    learnt = sensor.learn(x, Frame(pixels, corner))
    for i in range(3):
        for t in range(2):
            alone = sensor.information(x[i, [t]], Frame(pixels[i], corner[i]), x[i, [t]])
            for many, one in zip((J, g, llr), alone, strict=True):
                np.testing.assert_allclose(many[i, t], one[0], rtol=1e-12, atol=1e-12)
            np.testing.assert_allclose(
                learnt[i, t], sensor.learn(x[i, [t]], Frame(pixels[i], corner[i]))[0], rtol=1e-9, atol=1e-12
            )
