"""Spaces: differences and displacements undo each other, circles have no seam, and axes are found by name."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vedette import Axis, Space, SpaceError

exactly = settings(max_examples=150)
POLAR = Space.of(range="m", bearing="rad mod 2pi")
CLOCK = Space((Axis("minute", "min", 60.0), Axis("length", "m")))
SPACES = [POLAR, CLOCK, Space.of(x="m", y="m"), Space()]
spaces = st.sampled_from(SPACES)
numbers = st.floats(-1e5, 1e5)


def points(space, draw, *batch):
    size = int(np.prod(batch)) * len(space)
    return np.array(draw(st.lists(numbers, min_size=size, max_size=size))).reshape(*batch, len(space))


@st.composite
def pairs(draw):
    space = draw(spaces)
    batch = draw(st.sampled_from([(), (3,), (2, 2), (0,)]))
    return space, points(space, draw, *batch), points(space, draw, *batch)


def periods(space):
    return np.array([np.inf if axis.period is None else axis.period for axis in space.axes])


def turns_apart(space, a, b):
    """How far `a - b` is from whole periods, in units of the axis."""
    apart, period = a - b, periods(space)
    whole = np.where(np.isfinite(period), np.round(apart / np.where(np.isfinite(period), period, 1.0)), 0.0)
    return np.abs(apart - whole * np.where(np.isfinite(period), period, 0.0))


def check_canonical(space, a):
    wrapped, half = space.canonical(a), periods(space) / 2
    tight = 1e-10  # whole periods are taken off numbers of up to 1e5
    assert np.all((wrapped >= -half - tight) & (wrapped < half + tight))
    assert np.all(turns_apart(space, wrapped, a) < tight)
    inside = (a >= -half) & (a < half)
    np.testing.assert_array_equal(wrapped[inside], a[inside])
    np.testing.assert_array_equal(np.where(np.isinf(half), wrapped, 0), np.where(np.isinf(half), a, 0))


def check_inverse(space, a, b):
    """Displacing by a difference arrives, and a difference finds a short displacement."""
    assert np.all(turns_apart(space, space.displace(b, space.difference(a, b)), a) < 1e-9)
    short = np.clip(a, -0.49 * periods(space), 0.49 * periods(space))
    np.testing.assert_allclose(space.difference(space.displace(b, short), b), short, rtol=1e-12, atol=1e-9)
    assert np.all(np.abs(space.difference(a, b)) <= periods(space) / 2 + 1e-9)


@exactly
@given(pairs())
@pytest.mark.costly
def test_canonical_wraps_and_leaves_what_is_inside_to_the_last_bit(pair):
    check_canonical(*pair[:2])


@exactly
@given(pairs())
def test_difference_and_displace_undo_each_other(pair):
    space, a, b = pair
    given = a.copy(), b.copy()
    check_inverse(space, a, b)
    np.testing.assert_array_equal(a, given[0])
    np.testing.assert_array_equal(b, given[1])


def test_the_ends_of_a_period():
    half = np.array([np.pi, -np.pi, np.nextafter(np.pi, 0), 3 * np.pi])
    wrapped = POLAR.canonical(np.stack([half, half], axis=-1))
    np.testing.assert_array_equal(wrapped[:, 0], half)
    np.testing.assert_allclose(wrapped[:, 1], [-np.pi, -np.pi, np.pi, -np.pi], rtol=1e-15)


MUTANTS = {
    "truncated": lambda self, x: np.where(np.isfinite(periods(self)), x - _whole(self) * np.trunc(x / _whole(self)), x),
    "from 0": lambda self, x: np.where(np.isfinite(periods(self)), x - _whole(self) * np.floor(x / _whole(self)), x),
    "not at all": lambda self, x: x,
    "every axis": lambda self, x: (x + np.pi) % (2 * np.pi) - np.pi,
}


def _whole(space):
    return np.where(np.isfinite(periods(space)), periods(space), 1.0)


@pytest.mark.parametrize("mutant", MUTANTS.values(), ids=MUTANTS.keys())
def test_the_checks_bite(monkeypatch, mutant):
    a, b = np.array([[10.0, 3.0], [-7.0, -4.0], [0.0, -0.5]]), np.array([[2.0, -3.1], [1.0, 0.5], [0.0, 0.2]])
    check_canonical(POLAR, a)
    check_inverse(POLAR, a, b)
    monkeypatch.setattr(Space, "canonical", mutant)
    with pytest.raises(AssertionError):
        check_canonical(POLAR, a)
    with pytest.raises(AssertionError):
        check_inverse(POLAR, a, b)


@exactly
@given(
    st.lists(st.floats(-0.7, 0.7), min_size=1, max_size=5),
    st.floats(-10, 10),
    st.lists(st.floats(0.01, 1), min_size=5, max_size=5),
)
@pytest.mark.costly
def test_the_mean_turns_with_the_circle(angles, turn, weights):
    """Points within less than half a turn, weighted: the mean and the differences are those of the plain line, turned."""
    weights = np.array(weights[: len(angles)])
    weights /= weights.sum()
    plain = np.stack([np.arange(len(angles)) * 1.0, np.array(angles)], axis=-1)
    mean, apart = POLAR.mean(POLAR.displace(plain, np.array([0.0, turn])), weights)
    expected = weights @ plain
    np.testing.assert_allclose(POLAR.difference(mean, expected + np.array([0.0, turn])), 0, atol=1e-12)
    np.testing.assert_allclose(apart, plain - expected, atol=1e-12)
    np.testing.assert_array_equal(mean, POLAR.canonical(mean))


@pytest.mark.parametrize("space", [POLAR, SPACES[2]])
def test_a_batch_of_means_is_the_loop(space):
    rng = np.random.default_rng(0)
    points, weights = rng.normal(size=(4, 2, 5, 2)), rng.dirichlet(np.ones(5), size=(4, 2))
    mean, apart = space.mean(points, weights)
    for i in np.ndindex(4, 2):
        one, single = space.mean(points[i], weights[i])
        np.testing.assert_allclose(mean[i], one, rtol=1e-13)
        np.testing.assert_allclose(apart[i], single, rtol=1e-12, atol=1e-14)


def test_union_keeps_the_order_and_refuses_two_opinions():
    a, b = Space.of(x="m", y="m"), Space.of(y="m", bearing="rad mod 2pi")
    assert a.union(b).names == ("x", "y", "bearing")
    assert b.union(a).names == ("y", "bearing", "x")
    assert a.union(a) == a
    assert a.union(Space()) == a
    assert Space().union(a) == a
    for other in (Space.of(y="km"), Space((Axis("y", "m", 5.0),))):
        with pytest.raises(SpaceError, match=r"axis y \[.*\] is y \[m\] elsewhere"):
            a.union(other)


def test_locate_finds_axes_by_name_and_says_what_is_missing():
    state = Space.of(x="m", y="m", vx="m/s", vy="m/s")
    assert state.locate(Space.of(vy="m/s", x="m")) == [3, 0]
    assert state.locate(Space()) == []
    with pytest.raises(SpaceError, match=r"axis 'z' of \(x \[m\], z \[m\]\) is not among \(x \[m\], y \[m\]"):
        state.locate(Space.of(x="m", z="m"))


def test_locate_refuses_an_axis_of_another_unit_or_period():
    with pytest.raises(SpaceError, match=r"axis x \[km\] of \(x \[km\]\) is x \[m\] among \(x \[m\], y \[m\]\)"):
        Space.of(x="m", y="m").locate(Space.of(x="km"))
    with pytest.raises(SpaceError, match=r"is bearing \[rad\] among"):
        Space.of(bearing="rad").locate(Space.of(bearing="rad mod 2pi"))


def test_a_space_is_a_value():
    assert Space.of(x="m") == Space.of(x="m") != Space.of(x="km")
    assert hash(Space.of(x="m")) == hash(Space.of(x="m"))
    assert "bearing" in POLAR
    assert "x" not in POLAR
    assert len(POLAR) == 2
    assert str(POLAR) == "(range [m], bearing [rad mod 6.28319])"
    with pytest.raises(SpaceError, match="named twice"):
        Space((Axis("x", "m"), Axis("x", "m")))
    with pytest.raises(SpaceError, match=r"bearing: .* got '360'; .*Axis\('bearing', 'deg', 360.0\)"):
        Space.of(bearing="deg mod 360")
