"""Results of the compiled kernels are arrays of their own: what anybody still sees never changes."""

import warnings
import weakref
from pathlib import Path

import numpy as np
import pytest

from vedette import kernels
from vedette.kernels import reference

if kernels.predict is reference.predict:
    pytest.skip(f"kernels: {kernels.RUNNING}", allow_module_level=True)

N = 3


def made(value):
    """A mean of three times `value`, by a kernel."""
    return kernels.predict(np.full(N, float(value)), np.eye(N), np.eye(N), np.eye(N)).mean


def churn():
    for _ in range(40):
        made(-1)


@pytest.mark.parametrize(
    "keep",
    [lambda a: a, lambda a: a[1:], lambda a: a.T, memoryview, lambda a: a.ctypes, lambda a: (a,), lambda a: a.reshape(3, 1)],
)
def test_what_is_held_or_viewed_stays(keep):
    held = [keep(made(value)) for value in range(30)]
    churn()
    for value, one in enumerate(held):
        base = one[0] if isinstance(one, tuple) else one
        seen = base._arr if hasattr(base, "_arr") else np.asarray(base)
        assert np.all(seen == value)


def test_a_weak_name_never_sees_another_result():
    first = made(7)
    weak = weakref.ref(first)
    del first
    churn()
    assert weak() is None or np.all(weak() == 7)


@pytest.mark.parametrize("change", ["shape", "flags", "dtype"])
def test_an_array_changed_in_place_is_not_handed_out_again(change):
    for _ in range(20):
        result = made(1)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # from numpy 2.5 on, which still allows it
            if change == "shape":
                result.shape = (N, 1)
            elif change == "flags":
                result.flags.writeable = False
            else:
                result.dtype = np.int64
        del result
    for value in range(20):
        result = made(value)
        assert result.shape == (N,)
        assert result.dtype == np.float64
        assert result.flags.writeable
        assert np.all(result == value)


def test_results_of_one_call_share_no_memory():
    for shape in ((), (1,), (2, 3), (0,), (300,)):
        x, P = np.zeros((*shape, N)), np.broadcast_to(np.eye(N), (*shape, N, N))
        scan = kernels.evaluate_returns(P, np.zeros((N, N)), x, np.eye(N), np.ones((N, N, N)) + np.eye(N), 0.9, 0.9, ())
        parts = scan.loglik, scan.distance, scan.log_volume, scan.detail.shift, scan.detail.post
        assert not any(np.shares_memory(a, b) for i, a in enumerate(parts) for b in parts[:i])


def test_large_results_keep_their_numbers_too():
    eye = np.eye(N)
    held = [kernels.predict(np.full((1000, N), float(value)), eye, eye, eye) for value in range(20)]
    for value, one in enumerate(held):
        assert np.all(one.mean == value)
        assert np.all(one.cov == 2 * eye)
    grown = held[7].mean
    del held
    grown.resize((5000, N), refcheck=False)
    assert np.all(grown[:1000] == 7)
    assert np.all(grown[1000:] == 0)
    grown.resize((10, N), refcheck=False)
    assert np.all(grown == 7)


@pytest.mark.costly
def test_the_memory_that_is_kept_is_bounded():
    """Results of 96 MB at a time, ten times over, leave no more than the 64 MB that are kept."""
    resource = pytest.importorskip("resource")
    if not (statm := Path("/proc/self/statm")).exists():
        pytest.skip("needs /proc")

    def resident():
        return int(statm.read_text().split()[1]) * resource.getpagesize() / 2**20

    eye = np.eye(N)
    before = resident()
    for count in range(1_000_000, 1_000_010):
        kernels.predict(np.zeros((count, N)), eye, eye, eye)
    assert resident() - before < 80
