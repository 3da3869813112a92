"""Late scans: taken as if they had come in time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given, settings
from hypothesis import strategies as st

import vedette
from foreign.preprocessor_odd import Both
from vedette import Detections, Scan, Tracker
from vedette_live.grouping import Formed
from vedette_live.window import Window
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.partial import Partial

TRACKER: Tracker = vedette.build(
    {
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
        "sensors": {
            name: {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9, "clutter_density": 1e-7}
            for name in ("north", "south")
        },
        "associator": {"kind": "jpda"},
        "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
        "lifecycle": {"kind": "existence", "lifetime": 600, "confirm": 0.99, "delete": 0.01},
    }
)


def scans(count: int = 40, seed: int = 1) -> list[Scan]:
    rng = np.random.default_rng(seed)
    start, velocity = rng.uniform(-500, 500, (3, 2)), rng.normal(0, 5, (3, 2))
    out = []
    for i in range(count):
        z = start + velocity * i + rng.normal(0, 5, (3, 2))
        z = np.concatenate([z[rng.random(3) < 0.9], rng.uniform(-1000, 1000, (2, 2))])
        out.append(Scan(float(i), ("north", "south")[i % 2], Detections.of(z)))
    return out


def came(scans: Sequence[Scan], at: float | None = None) -> list[Formed]:
    """Return scans that came as they were made, or all `at` once."""
    copies = [tuple(f"{scan.time} {scan.sensor} {z}" for z in scan.detections.z.tolist()) for scan in scans]
    arrived = [scan.time if at is None else at for scan in scans]
    return [Formed(*each, copies=of) for *each, of in zip(scans, arrived, [1] * len(scans), copies, strict=True)]


def window(horizon: float, most: int = 1000) -> Window:
    return Window(TRACKER, TRACKER.start(seed=3), horizon, most)


@given(st.lists(st.integers(0, 39), max_size=30), st.integers(0, 3), st.sampled_from([0.0, 3.0]))
@settings(max_examples=10, deadline=None)
def test_scans_that_come_twice_are_taken_once(again: list[int], later: int, horizon: float) -> None:
    """As over two paths of a network: by both, a filter would be surer than it may be."""
    in_order = scans()
    one, other, refused = window(horizon), window(0.0), []
    for i, scan in enumerate(in_order):
        assert other.take(came([scan])) == []
        copies = [Scan(in_order[k].time, in_order[k].sensor, Detections.of(in_order[k].detections.z.copy())) for k in again]
        arriving = [copy for copy, k in zip(copies, again, strict=True) if k + min(later, horizon) == i]
        refused += one.take(came([scan, *arriving]))
        one.settled()
    due = [k for k in again if k + min(later, horizon) < 40]
    assert len(refused) == len(due)
    assert all("came already, with the same returns" in why for _, why in refused)
    np.testing.assert_array_equal(one.state.belief.mean, other.state.belief.mean)
    assert one.state.steps == other.state.steps


def test_a_turn_by_a_second_path_that_lost_a_message_is_a_copy() -> None:
    """Each target had a second return: only one of the same returns was."""
    one, turn = window(3.0), scans(1)[0]
    first, second, third = (Formed(turn, 0.0, len(of), copies=tuple(of)) for of in ("abc", "ac", "acd"))
    assert one.take([first]) == []
    assert [formed for formed, _ in one.take([second, third])] == [second]


def test_a_clock_that_stands_still_does_not_fill_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vedette_live.window.COPIES", 5)
    one = window(0.0)
    for scan in scans():
        assert one.take(came([evolve(scan, time=0.0)])) == []
        one.settled()
    assert len(one.came) == 5


def test_scans_without_returns_may_be_alike() -> None:
    one = window(0.0)
    assert one.take(came([Scan(1.0, "north", Detections.of([], 2)), Scan(1.0, "north", Detections.of([], 2))])) == []


@given(st.data())
@settings(max_examples=10, deadline=None)
def test_scans_that_are_late_within_the_horizon_change_nothing(data: st.DataObject) -> None:
    in_order = scans()
    delays = data.draw(st.lists(st.floats(0, 3), min_size=len(in_order), max_size=len(in_order)))
    arrival = dict(zip((scan.time for scan in in_order), delays, strict=True))
    arriving = sorted(in_order, key=lambda scan: scan.time + arrival[scan.time])
    one, other, done = window(3.0), window(0.0), []
    for scan in in_order:
        assert other.take(came([scan])) == []
    at = 0
    while at < len(arriving):
        count = data.draw(st.integers(1, 5))
        assert one.take(came(arriving[at : at + count])) == []
        done += one.settled()
        at += count
    done += one.settled(all_of_it=True)
    assert [taken.scan.time for taken in done] == [scan.time for scan in in_order]
    np.testing.assert_array_equal(one.state.ids, other.state.ids)
    np.testing.assert_array_equal(one.state.belief.mean, other.state.belief.mean)
    assert one.state.steps == other.state.steps


def test_what_is_later_than_the_horizon_is_refused_and_changes_nothing() -> None:
    one, in_order = window(2.0), scans(10)
    one.take(came(in_order[:8]))
    before = one.state
    refused = one.take(came([Scan(4.9, "north", Detections.of([[0.0, 0.0]]))]))
    assert [formed.scan.time for formed, _ in refused] == [4.9]
    assert one.state is before


def test_what_is_refused_does_not_depend_on_which_scans_are_taken_together() -> None:
    arriving = came([scans(20)[k] for k in (3, 0, 2, 1, 9, 4, 5, 8, 19, 6, 17)])
    one, other = window(4.0), window(4.0)
    refused = one.take(arriving)
    assert [formed for formed, _ in refused] == [formed for each in arriving for formed, _ in other.take([each])]
    assert [formed.scan.time for formed, _ in refused] == [4.0, 6.0]
    np.testing.assert_array_equal(one.state.belief.mean, other.state.belief.mean)


def test_bounded_work_settles_what_exceeds_the_window() -> None:
    one = window(100.0, most=5)
    for scan in scans(20):
        one.take(came([scan]))
        one.settled()
        assert len(one.kept) <= 5
    assert one.take(came([Scan(10.0, "north", Detections.of([[0.0, 0.0]]))]))
    assert one.take(came([Scan(17.5, "north", Detections.of([[0.0, 0.0]]))])) == []


def test_a_scan_with_a_bad_return_is_taken_without_it_and_an_unusable_one_is_refused() -> None:
    one = window(0.0)
    good, bad = [1.0, 2.0], [np.nan, 3.0]
    assert one.take(came([Scan(0.0, "north", Detections.of([good, bad]))])) == []
    assert one.kept[-1].scan.detections.z.tolist() == [good]
    unknown, unusable = Scan(1.0, "west", Detections.of([good])), Scan(2.0, "north", Detections.of([bad, bad]))
    refused = {told.partition(":")[0]: formed.scan for formed, told in one.take(came([unknown, unusable]))}
    assert refused == {"sensor": unknown, "return [0]": unusable}


def test_scans_after_one_that_came_late_and_is_refused_stay() -> None:
    one = window(5.0)
    one.take(came(scans(10)))
    before = one.state
    assert len(one.take(came([Scan(7.5, "north", Detections.of([[1.0, 2.0, 3.0]]))]))) == 1
    assert one.state.time == before.time
    np.testing.assert_array_equal(one.state.belief.mean, before.belief.mean)


@pytest.mark.parametrize("horizon", [0.0, 3.0])
def test_scans_of_one_time_are_in_the_order_of_their_sensors(horizon: float) -> None:
    pair = [Scan(1.0, "south", Detections.of([[0.0, 0.0]])), Scan(1.0, "north", Detections.of([[5.0, 5.0]]))]
    one, other = window(horizon), window(horizon)
    one.take(came(pair))
    other.take(came(pair[::-1]))
    np.testing.assert_array_equal(one.state.belief.mean, other.state.belief.mean)


def test_a_preprocessor_gets_all_scans_of_a_time_however_late_one_of_them_came() -> None:
    fused = {"north": Both({"one": CartesianPosition(5.0), "two": CartesianPosition(9.0)})}
    one, other = (Window(TRACKER, TRACKER.start(seed=3), 9.0, 1000, fused) for _ in range(2))
    first, second = ([evolve(scan, sensor=name) for scan in scans(4, seed)] for seed, name in ((1, "one"), (2, "two")))
    refused = one.take(came(first)) + one.take(came(second))
    for pair in zip(first, second, strict=True):
        refused += other.take(came(pair))
    assert refused == []
    assert [[each.scan.sensor for each in taken.formed] for taken in one.kept] == [["one", "two"]] * 4
    np.testing.assert_array_equal(one.state.belief.mean, other.state.belief.mean)


def test_what_is_left_out_before_a_preprocessor_is_told() -> None:
    """Of a scan of which some returns were taken nobody heard that others were not."""
    fused = {"north": Both({"one": Partial(CartesianPosition(5.0), {"y": 900.0}), "two": CartesianPosition(9.0)})}
    one = Window(TRACKER, TRACKER.start(seed=3), 9.0, 1000, fused)
    seen = Detections(
        np.array([[1.0, 2.0], [5.0, 0.0]]), np.ones(2, dtype=bool), missing=np.array([[0, 0], [0, 1]], dtype=bool)
    )
    assert one.take(came([Scan(0.0, "one", seen)])) == []
    assert [[problem.place for problem in problems] for _, problems in one.flawed] == [["raw scan 0, return 1"]]


def far(time: float, sensor: str = "north") -> Scan:
    return Scan(time, sensor, Detections.of([[1.0, 2.0]]))


@pytest.mark.parametrize("horizon", [0.0, 3.0])
@pytest.mark.parametrize("together", [1, 64])
@pytest.mark.parametrize("at", [0, 7])
def test_a_scan_far_ahead_is_given_up_once_later_ones_of_all_sensors_gainsay_it(
    at: int, together: int, horizon: float
) -> None:
    """All that followed were refused as late, for as long as it was ahead; with a wrong first one for good."""
    one, other, in_order, gave_up = window(horizon), window(horizon), scans(40), []
    arriving = came([*in_order[:at], far(500.0), *in_order[at:]])
    for i in range(0, len(arriving), together):
        refused = one.take(arriving[i : i + together])
        gave_up += [one.gave_up] * bool(one.gave_up)
        one.settled()
    assert len(gave_up) == 1
    assert len(refused) == (0 if together == 1 else 5 + (horizon > 0 or together > 1))
    late = 5
    other.take(came([*in_order[:at], *in_order[at + late :]]))
    assert one.state.time == other.state.time
    np.testing.assert_array_equal(one.state.belief.mean, other.state.belief.mean)


def test_a_leap_that_its_sensor_or_as_many_scans_bear_out_is_believed() -> None:
    for ahead, behind in (
        ([500.0], [("south", k) for k in range(30)]),
        ([500.0 + k for k in range(5)], [(("north", "south")[k % 2], k) for k in range(30)]),
    ):
        one = window(3.0)
        one.take(came([*(far(k) for k in range(5)), *map(far, ahead)]))
        one.settled()
        refused = one.take(came([far(5.0 + k, sensor) for sensor, k in behind], at=600.0))
        assert (len(refused), one.gave_up, one.state.time) == (30, "", ahead[-1])


def test_scans_that_are_sent_again_gainsay_no_leap() -> None:
    one = window(3.0)
    one.take(came([*scans(20), far(500.0)]))
    assert len(one.take(came(scans(20), at=600.0))) == 20
    assert one.gave_up == ""
