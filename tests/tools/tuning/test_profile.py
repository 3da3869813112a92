"""A top that nothing looked at exceeds, whatever the criterion."""

from types import SimpleNamespace

import numpy as np
import pytest

from vedette_tools.tuning import errors, evaluator, profile
from vedette_tools.tuning.checkpoint import Kept
from vedette_tools.tuning.evaluator import Asker
from vedette_tools.tuning.search import FINE
from vedette_tools.tuning.unstated import Unstated


class Straight:
    """A free parameter that is its position."""

    def value(self, position):
        return position


def shared(height):
    """Return a height shared evenly by 20 scans, none of whose returns is of no target."""
    return np.stack([np.full(20, height / 20), np.zeros(20)])


def asked(criterion, p, monkeypatch):
    """Return an asker of a criterion of the position (p,), shared evenly by 20 scans."""
    monkeypatch.setattr(errors, "long_run", lambda scores: scores.T @ scores)  # of scans that share alike it would be 0
    monkeypatch.setattr(evaluator, "run_one", lambda *given: shared(criterion(np.array(given[2]))))
    nothing = SimpleNamespace(scans=None, unstated=Unstated(), sensors=["radar"] * 20)
    return Asker(nothing, [Straight()] * p, "likelihood", Kept(None, {}, resume=False), None)


def hills(seed, p):
    """Return a criterion of several hills of drawn heights and widths."""
    rng = np.random.default_rng(seed)
    places, tall, wide = rng.uniform(0, 1, (4, p)), rng.uniform(5, 40, 4), rng.uniform(0.05, 0.3, 4)

    def criterion(u):
        return np.max(tall * (np.exp(-np.sum((u - places) ** 2, axis=1) / wide**2) - 1))

    return criterion


def two_hills(u):
    """A low hill at 0.4, and a higher one at 0.8, which the first look for errors meets."""
    return max(3 * np.exp(-(((u[0] - 0.4) / 0.07) ** 2)), 20 * np.exp(-(((u[0] - 0.8) / 0.1) ** 2)))


def holds(criterion, p, first, monkeypatch):
    one = asked(criterion, p, monkeypatch)
    top = profile.settled(one, np.full(p, first), 1, "nelder-mead")
    seen = [np.sum(found[0]) for found in one._kept._found.values()]
    assert one.height(top.known.position) >= max(seen) - FINE[1]
    assert all(np.max(curve.heights) <= FINE[1] for curve in top.curves)
    return top


@pytest.mark.parametrize("seed", range(12))
def test_nothing_that_was_looked_at_is_higher(seed, monkeypatch):
    holds(hills(seed, 1 + seed % 2), 1 + seed % 2, 0.3, monkeypatch)


def test_it_goes_on_to_a_higher_hill_that_a_curve_meets(monkeypatch):
    top = holds(two_hills, 1, 0.4, monkeypatch)
    assert top.known.position[0] == pytest.approx(0.8, abs=0.01)
    assert top.onward > 0


def test_the_law_bites(monkeypatch):
    """A search that keeps to its hill is caught."""
    monkeypatch.setattr(Asker, "best", property(lambda self: None, lambda self, position: None), raising=False)
    with pytest.raises(AssertionError):
        holds(two_hills, 1, 0.4, monkeypatch)
