"""The steps along paths give the same compiled as in numpy, whatever the pieces, axes, modes, gaps and gross positions."""

import numpy as np
import pytest

from vedette_tools.smoothing import compiled, linear, modes
from vedette_tools.smoothing.paths import Paths

pytestmark = pytest.mark.skipif(compiled.module(2) is None, reason="numpy runs")


def paths_of(rng, lengths, axes):
    """Pieces in which times repeat, rows ask, a report in ten is far off, every third piece jumps for good."""
    n = sum(lengths)
    times = np.cumsum(rng.exponential(4.0, n) * (rng.random(n) < 0.9))
    spots = np.cumsum(rng.normal(0, 20, (n, axes)), axis=0) + (rng.random((n, 1)) < 0.1) * rng.normal(0, 3e4, (n, axes))
    spots[n // 3 :] += 1e5
    velocities = rng.normal(0, 5, (n, axes))
    velocities[rng.random(n) < 0.5] = np.nan
    return Paths(np.concatenate([[0], np.cumsum(lengths)]), times, spots, velocities, rng.random(n) < 0.8)


def both(monkeypatch, function, *given):
    got = function(*given)
    with monkeypatch.context() as patch:
        patch.setattr(compiled, "_module", None)
        return got, function(*given)


@pytest.mark.parametrize("axes", [1, 2])
@pytest.mark.parametrize("count", [1, 3, 7])
def test_compiled_and_in_numpy_they_agree(axes, count, monkeypatch):
    rng = np.random.default_rng(count)
    paths = paths_of(rng, [30, 1, 0, 60, 2, 40], axes)
    share, speed = rng.dirichlet(np.ones(count), 6), rng.uniform(5, 30, len(paths))
    stance = modes.Stance(share, rng.uniform(0.02, 0.3, 6), rng.uniform(1, 50, 6), rng.uniform(0.1, 3, 6))
    got, wanted = both(monkeypatch, modes.bank, paths, np.geomspace(1e-4, 100, count), stance, speed)
    assert got.gross.any()
    assert not got.gross.all()
    np.testing.assert_array_equal(got.gross, wanted.gross)
    np.testing.assert_allclose(got.loglik, wanted.loglik, rtol=1e-10, atol=1e-8)
    np.testing.assert_allclose(got.prob, wanted.prob, atol=1e-7)
    np.testing.assert_allclose(got.prior, wanted.prior, atol=1e-7)
    after, again = both(monkeypatch, modes.smoothed_modes, paths, got, stance)
    np.testing.assert_allclose(after, again, rtol=1e-12)
    noises = rng.uniform(0.1, 2, len(paths)), rng.uniform(1, 9, len(paths)), rng.uniform(0.2, 2, len(paths))
    monkeypatch.setattr(linear, "VAGUE", 1e6)  # a wider prior costs digits in both
    mine, numpy = both(monkeypatch, linear.smoothed, paths, *noises, speed)
    for name in ("spots", "velocities", "spot_variances", "velocity_variances"):
        np.testing.assert_allclose(getattr(mine, name), getattr(numpy, name), rtol=1e-8, atol=1e-6, err_msg=name)


def test_arrays_that_do_not_fit_are_refused():
    paths = paths_of(np.random.default_rng(0), [5, 4], 2)
    given = [compiled.numbers(each) for each in (paths.waits, paths.spots, paths.velocities, *np.ones((4, 9)))]
    own = np.zeros((9, 4)), np.zeros((9, 3)), np.zeros((9, 3))
    call = compiled.module(2).smoothed
    call(2, compiled.whole(paths.starts), *given, 1e12, 1e-15, *own)
    for starts in ([0, 5, 10], [0, 6, 5, 9], [1, 9], []):
        with pytest.raises(TypeError):
            call(2, np.array(starts, dtype=np.int64), *given, 1e12, 1e-15, *own)
    with pytest.raises(TypeError):
        call(3, compiled.whole(paths.starts), *given, 1e12, 1e-15, *own)
    with pytest.raises(TypeError):
        call(2, compiled.whole(paths.starts), *given[1:], 1e12, 1e-15, *own)
