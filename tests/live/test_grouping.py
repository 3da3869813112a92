"""Messages become scans: by turn, sector, interval; times of the day; whose clock."""

from __future__ import annotations

import json
import math
from contextlib import suppress

import numpy as np
import pytest
from attrs import evolve

import vedette
from vedette.streams import Message
from vedette.types import Pose
from vedette_files import FRAMES, Origin
from vedette_live.formats.csv_lines import CsvLines
from vedette_live.formats.json_lines import JsonLines
from vedette_live.grouping import Clock, Formed, Grouper, Grouping
from vedette_live.placing import Placing
from vedette_live.saving import clocks_data, clocks_from, scan_data, scan_from
from vedette_standard.sensors.partial import Partial
from vedette_standard.sensors.position_velocity import PositionVelocity
from vedette_standard.sensors.range_bearing_rate import RangeBearingRate

SENSORS = vedette.build(
    {
        "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
        "sensors": {
            "radar": {"kind": "range_bearing", "sigma_range": 5.0, "sigma_bearing": 0.01},
            "ais": {"kind": "cartesian_position", "sigma": 5.0},
        },
        "associator": {"kind": "gnn"},
        "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
        "lifecycle": {"kind": "m_of_n"},
    }
).sensors
ORIGIN = Origin(59.0, 10.0)
PLACING = Placing(SENSORS, {"2/17": "radar"}, ORIGIN)


def plot(time: float, azimuth: float = 0.3) -> Message:
    return Message("2/17", time, np.array([[1000.0, azimuth]]), ("range", "azimuth"))


def mark(time: float, kind: str = "north") -> Message:
    return Message("2/17", time, np.zeros((0, 0)), marker=kind)


def grouped(grouper: Grouper, messages: list[Message]) -> list[Formed]:
    return [formed for message in messages for formed in grouper.add(message, message.time)]


def test_a_turn_is_from_north_to_north_and_an_empty_one_is_a_scan() -> None:
    grouper = Grouper(Grouping(by="turn"), PLACING)
    came = [plot(0.1), mark(0.5), plot(1.0), plot(2.0), mark(3.0), mark(5.5), plot(6.0), mark(8.0)]
    formed = grouped(grouper, came)
    assert [(one.scan.time, len(one.scan.detections.z), one.messages) for one in formed] == [
        (0.1, 1, 1),
        (2.0, 2, 2),
        (5.5, 0, 0),
        (6.0, 1, 1),
    ]
    assert all(one.scan.sensor == "radar" and one.scan.detections.z.shape[1] == 2 for one in formed)


def test_sectors_part_a_turn_and_silence_ends_a_scan() -> None:
    grouper = Grouper(Grouping(by="sector", wait=0.5), PLACING)
    formed = grouped(grouper, [mark(0.0), plot(0.1), mark(0.2, "sector"), plot(0.3), plot(0.35)])
    assert [len(one.scan.detections.z) for one in formed] == [1]
    assert list(grouper.due(0.8)) == []
    assert [len(one.scan.detections.z) for one in grouper.due(0.9)] == [2]
    assert list(grouper.due()) == []


def test_a_turn_without_marks_ends_after_its_longest_duration() -> None:
    grouper = Grouper(Grouping(by="turn", length=2.0), PLACING)
    formed = grouped(grouper, [plot(t) for t in (0.0, 1.0, 1.9, 2.1, 4.5)])
    assert [one.scan.time for one in formed] == [1.9, 2.1]


def test_a_scan_is_complete_though_its_clock_stands_still(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vedette_live.grouping.MOST", 3)
    formed = grouped(Grouper(Grouping(by="turn"), PLACING), [plot(1.0, 0.1 * k) for k in range(7)])
    assert [one.messages for one in formed] == [3, 3]


def test_intervals_are_of_the_sensors_clock() -> None:
    grouper = Grouper(Grouping(by="interval", length=1.0), PLACING)
    formed = grouped(grouper, [plot(t) for t in (0.2, 0.9, 1.0, 3.5)])
    assert [one.scan.time for one in formed] == [0.9, 1.0]
    assert [one.scan.time for one in grouper.due()] == [3.5]


@pytest.mark.parametrize("clock", ["sensor", "receiver", "offset"])
@pytest.mark.parametrize("by", ["turn", "sector", "interval"])
def test_a_message_that_comes_twice_is_in_one_scan_once(by: str, clock: str) -> None:
    """Each target had two returns, and two tracks, that nobody could tell from two targets; late ones were scans."""

    def scans(messages: list[Message]) -> tuple[list[tuple[float, int]], int]:
        grouper, formed, refused = Grouper(Grouping(by=by, length=4.0, clock=clock), PLACING), list[Formed](), 0
        for message in messages:
            try:
                formed += grouper.add(message, message.time)
            except ValueError as error:
                refused += "came already" in str(error)
        formed += grouper.due()
        return [(one.scan.time, len(one.scan.detections.z)) for one in formed], refused

    came = [mark(0.5), plot(1.0), plot(1.0, 0.9), mark(3.0), mark(5.5), plot(6.0), mark(8.0), plot(9.0)]
    once, twice = scans(came), scans([message for message in came for _ in range(2)])
    assert twice == (once[0], len(came))
    late = scans([*came[:6], came[1], *came[6:]])
    if clock == "sensor":
        assert late == (once[0], 1)
    else:
        assert late[1] == 1


def test_messages_without_a_time_or_without_returns_are_no_copies() -> None:
    grouper = Grouper(Grouping(by="turn"), PLACING)
    timeless = [evolve(plot(1.0), time=None), Message("2/17", 1.0, np.zeros((0, 2)))]
    assert not [one for message in timeless * 2 for one in grouper.add(message, 1.0)]
    assert [one.messages for one in grouper.due()] == [4]


def test_copies_are_recognised_of_the_latest_messages(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vedette_live.grouping.COPIES", 5)
    grouper = Grouper(Grouping(by="turn"), PLACING)
    grouped(grouper, [plot(0.01 * k) for k in range(20)])
    assert len(grouper.came) == 5


def test_what_comes_late_of_an_interval_before_ends_no_scan() -> None:
    grouper = Grouper(Grouping(by="interval", length=1.0), PLACING)
    assert not grouped(grouper, [plot(t) for t in (1.2, 1.3, 0.95, 1.4)])
    assert [(one.scan.time, one.messages) for one in grouper.due()] == [(1.4, 4)]


def test_evidence_and_noise_are_of_all_returns_of_a_scan_or_of_none() -> None:
    """What one message of several tells cannot be laid against the returns of the others."""
    told = evolve(plot(1.0), evidence=np.array([2.0]), noise=np.diag([9.0, 0.01])[None])
    for messages, known in (([told, evolve(told, time=1.1)], 2), ([told, plot(1.1)], 0)):
        grouper = Grouper(Grouping(by="turn"), PLACING)
        assert not grouped(grouper, messages)
        (seen,) = (one.scan.detections for one in grouper.due())
        assert [0 if part is None else len(part) for part in (seen.z, seen.evidence, seen.noise)] == [2, known, known]


def test_a_scan_stands_where_its_platform_stood_last() -> None:
    """As its time is that of the last return; a message without a pose changes nothing."""
    grouper = Grouper(Grouping(by="turn"), PLACING)
    first, last = (evolve(plot(time), pose=Pose(np.array([100.0 * time, 0.0]))) for time in (1.0, 1.2))
    assert not grouped(grouper, [first, last, plot(1.3)])
    assert [one.scan.pose for one in grouper.due()] == [last.pose]


def test_midnight_and_short_counters_are_unwrapped_to_when_a_message_came() -> None:
    day, clock = 86400.0 * 20_000, Clock("sensor")
    assert clock.time(86399.5, 86400.0, day - 0.1) == day - 0.5
    assert clock.time(0.5, 86400.0, day + 0.6) == day + 0.5
    assert clock.time(86399.9, 86400.0, day + 0.7) == pytest.approx(day - 0.1)  # late, of the day before
    assert Clock("sensor").time(510.0, 512.0, 512.0 * 7 + 1.0) == 512.0 * 7 - 2.0
    record = Clock("sensor")  # nobody knows when it came: from one message to the next
    assert [record.time(t, 86400.0, None) for t in (86398.0, 86399.0, 1.0, 2.0)] == [86398.0, 86399.0, 86401.0, 86402.0]


def test_a_clock_that_is_restored_believes_no_leap_either() -> None:
    before = Clock("sensor", 600.0)
    before.time(1000.0, None, 1000.0)
    after = clocks_from(clocks_data({"radar": before}), "sensor", 600.0)["radar"]
    for clock in (before, after):
        with pytest.raises(ValueError, match=r"scans\.leap"):
            clock.time(9000.0, None, 1001.0)
    assert after.time(1001.0, None, 1001.0) == 1001.0


def test_the_offset_is_the_least_delay() -> None:
    clock = Clock("offset")
    delays = [0.3, 0.1, 0.5]
    times = [clock.time(float(i), None, 1000.0 + i + delay) for i, delay in enumerate(delays)]
    np.testing.assert_allclose(times, [1000.3, 1001.1, 1002.1])
    assert Clock("receiver").time(5.0, None, 1000.0) == 1000.0
    assert Clock("receiver").time(5.0, None, None) == 5.0  # of a record that does not tell when it came
    with pytest.raises(ValueError, match="time"):
        Clock("sensor").time(None, None, None)


@pytest.mark.parametrize("began", [0.0, 1.8e9])
def test_times_far_ahead_are_refused_and_a_clock_that_was_set_is_believed(began: float) -> None:
    """Two wrong ones do not agree, be the clock's zero as long ago as it may."""
    clock = Clock("sensor", leap=100.0)
    assert [clock.time(began + t, None, None) for t in (1.0, 90.0)] == [began + 1.0, began + 90.0]
    for wrong in (1e6, 3e6):
        with pytest.raises(ValueError, match="time"):
            clock.time(began + wrong, None, None)
    assert clock.time(began + 91.0, None, None) == began + 91.0
    with pytest.raises(ValueError, match="time"):
        clock.time(began + 5000.0, None, None)
    assert [clock.time(began + t, None, None) for t in (5001.0, 5002.0)] == [began + 5001.0, began + 5002.0]


def test_a_copy_of_a_time_far_ahead_does_not_bear_it_out() -> None:
    """Each message came twice, and one wrong time shut all others out."""
    clock, taken = Clock("sensor", leap=100.0), []
    for t in (1.0, 1.0, 1e6, 1e6, 2.0, 2.0):
        with suppress(ValueError):
            taken.append(clock.time(t, None, None))
    assert taken == [1.0, 1.0, 2.0, 2.0]


@pytest.mark.parametrize(("unit", "factor"), [("ms", 1e3), ("us", 1e6)])
def test_a_time_of_now_in_another_unit_is_refused(unit: str, factor: float) -> None:
    clock = Clock("sensor")
    with pytest.raises(ValueError, match=rf"time: .* in {unit} since 1970: it must be in s"):
        clock.time(1.7e9 * factor, None, 1.8e9)
    assert clock.ailment(1.8e9)
    assert clock.time(1.7e9, None, 1.8e9) == 1.7e9
    assert clock.ailment(1.8e9) == ""


def test_times_that_pass_1000_times_as_fast_as_ours_are_told_to_be_in_ms() -> None:
    """No track was ever confirmed, and all seemed well. What was stored comes faster, and at any ratio."""

    def ails(stated: list[float], arrived: list[float]) -> list[bool]:
        clock = Clock("sensor", leap=1e6)
        return [bool(clock.time(t, None, now) and clock.ailment(now)) for t, now in zip(stated, arrived, strict=True)]

    rng = np.random.default_rng(1)
    arrived = [1.8e9 + 1.5 * k + delay for k, delay in enumerate(rng.uniform(0.0, 0.1, 30))]
    assert ails([1500.0 * k + 1.0 for k in range(30)], arrived) == [False] * 5 + [True] * 25
    assert not any(ails([1.5 * k for k in range(30)], arrived))
    pieces = [1.8e9 + 0.5 * (k // 500) for k in range(20_000)]
    assert not any(ails([1.0 * k for k in range(20_000)], pieces))
    assert not any(ails([1.0 * k for k in range(2000)], [1.8e9 + 0.001 * k for k in range(2000)]))


def test_a_message_without_a_time_among_those_of_another_epoch_is_refused() -> None:
    """Taken when it came, it made all others 57 years late. By a clock like ours it is taken, after a silence, too."""
    clock = Clock("sensor", leap=100.0)
    assert clock.time(12.0, None, 1.8e9) == 12.0
    with pytest.raises(ValueError, match="time"):
        clock.time(None, None, 1.8e9 + 1.0)
    alike = Clock("sensor", leap=100.0)
    assert [alike.time(t, None, now) for t, now in ((12.0, 12.5), (None, 5000.0))] == [12.0, 5000.0]


def test_a_clock_that_was_set_back_is_followed_by_its_least_delay() -> None:
    """After ten messages: all that followed were refused as late. Those that make up for a pause are late, as they are."""

    def taken(stated: list[float], arrived: list[float]) -> list[float]:
        clock = Clock("offset", leap=100.0)
        return [clock.time(t, None, now) for t, now in zip(stated, arrived, strict=True)]

    before, now = [float(t) for t in range(1000, 1020)], [float(t) for t in range(1000, 1060)]
    hour_back = [t - 3600.0 for t in now[20:]]
    assert taken(before + hour_back, now) == [*now[:20], *hour_back[:9], *now[29:]]
    stored, soon = [t - 3600.0 for t in now[20:40]], [1020.0 + 0.1 * k for k in range(20)]
    assert taken([*before, *stored], [*now[:20], *soon]) == [*before, *stored]
    still = [1019.0] * 300
    assert taken([*before, *still], [*now[:20], *(1020.0 + k for k in range(300))])[-1] == 1019.0


def test_of_a_sensor_that_sends_more_seldom_than_a_leap_one_message_is_lost() -> None:
    clock, taken = Clock("sensor", leap=100.0), []
    for t in (0.0, 300.0, 610.0, 900.0, 1220.0):
        with suppress(ValueError):
            taken.append(clock.time(t, None, None))
    assert taken == [0.0, 610.0, 900.0, 1220.0]


@pytest.mark.parametrize("grouping", [Grouping(by="turn", length=2.0), Grouping(by="interval", length=1.0)])
def test_one_wrong_time_within_the_leap_is_a_scan_of_its_own(grouping: Grouping) -> None:
    """The others are grouped as without it, but for the turn that it stands in, which is cut there."""
    grouper, times = Grouper(grouping, PLACING), [0.25 * k for k in range(40)]
    formed = [*grouped(grouper, [plot(t) for t in [*times[:21], 300.0, *times[21:]]]), *grouper.due()]
    assert [len(one.scan.detections.z) for one in formed if one.scan.time == 300.0] == [1]
    right = [one.scan.time for one in formed if one.scan.time != 300.0]
    alone = Grouper(grouping, PLACING)
    wanted = [one.scan.time for one in [*grouped(alone, [plot(t) for t in times]), *alone.due()]]
    assert right == sorted(right)
    assert len(set(right) - set(wanted)) <= 3
    assert sum(one.messages for one in formed) == 41


def test_azimuths_become_bearings_and_latitudes_places() -> None:
    (formed,) = Grouper(Grouping(), PLACING).add(plot(0.0, 0.25), 0.0)
    np.testing.assert_allclose(formed.scan.detections.z, [[1000.0, np.pi / 2 - 0.25]])
    report = Message("ais", 0.0, np.array([[59.0, 10.01, 5.0, np.pi / 2]]), ("latitude", "longitude", "speed", "course"))
    (formed,) = Grouper(Grouping(), PLACING).add(report, 0.0)
    x, y = formed.scan.detections.z[0]
    assert abs(y) < 0.1
    assert x == pytest.approx(
        0.01 * 111_412.84 * np.cos(np.deg2rad(59.0)), rel=2e-3
    )  # by the length of a degree at the equator


def test_courses_count_from_the_north_of_their_own_place() -> None:
    """As in a file: two degrees of longitude east of the origin courses were 1.7 degrees off."""
    axes = ("latitude", "longitude", "speed", "course")
    fixed = Placing({"ais": PositionVelocity(sigma=5.0, sigma_speed=0.5)}, {}, ORIGIN)
    z = fixed.returns(Message("ais", 0.0, np.array([[59.0, 12.0, 5.0, 0.0]]), axes), "ais")
    course = math.atan2(*z[0, 2:])
    assert course == pytest.approx(-math.radians(2.0) * math.sin(math.radians(59.0)), rel=1e-3)


@pytest.mark.parametrize(
    "message",
    [
        Message("3/1", 0.0, np.array([[1.0, 2.0]])),
        Message("2/17", 0.0, np.array([[1.0, 2.0, 3.0]])),
        Message("2/17", 0.0, np.array([[1.0, 2.0]]), ("x", "y")),
        Message("2/17", None, np.array([[1.0, 2.0]])),
    ],
)
def test_what_no_sensor_measures_is_refused_and_changes_nothing(message: Message) -> None:
    grouper = Grouper(Grouping(by="turn"), PLACING)
    with pytest.raises(ValueError, match=r"^(sensor|z|time): "):
        list(grouper.add(message, None))
    assert grouper.opened == {}


def test_where_x_points_north_messages_are_of_the_same_places() -> None:
    sensors = {"radar": SENSORS["radar"], "fixed": PositionVelocity(sigma=5.0, sigma_speed=0.5)}
    eastward, northward = (Placing(sensors, {}, ORIGIN, frame) for frame in FRAMES)
    course = np.array([5.0, 0.3])
    for message in (
        Message("fixed", 0.0, np.array([[59.01, 10.02, *course]]), ("latitude", "longitude", "speed", "course")),
        Message("fixed", 0.0, np.array([[700.0, -80.0, *course]]), ("east", "north", "speed", "course")),
    ):
        one, other = (each.returns(message, "fixed") for each in (eastward, northward))
        np.testing.assert_array_equal(one, other[:, [1, 0, 3, 2]])
    turned = eastward.returns(plot(0.0), "radar")[0, 1], northward.returns(plot(0.0), "radar")[0, 1]
    np.testing.assert_allclose([np.cos(turned[0]), np.sin(turned[0])], [np.sin(turned[1]), np.cos(turned[1])])
    told = evolve(plot(0.0), frame=FRAMES[1])
    assert northward.returns(told, "radar").shape == (1, 2)
    with pytest.raises(ValueError, match=r"^frame: "):
        eastward.returns(told, "radar")


def test_returns_are_taken_at_the_times_that_a_message_tells_or_unless_that_is_not_wanted_at_those_of_their_messages() -> (
    None
):
    """By default all of a turn were taken at its end: by 120 m off for a drone of 30 m/s, without a word."""
    told = Message("2/17", 2.5, np.array([[900.0, 0.1], [950.0, 0.2]]), ("range", "azimuth"), np.array([2.25, 2.5]))
    for stated, messages, wanted in (
        ({"own_times": False}, [plot(1.0), plot(2.0)], None),
        ({}, [plot(1.0), plot(2.0)], [1.0, 2.0]),
        ({}, [plot(2.0), plot(2.0, 0.4)], None),
        ({"own_times": False}, [plot(1.0), plot(2.0), told], [1.0, 2.0, 2.25, 2.5]),
    ):
        (one,) = grouped(Grouper(Grouping(by="turn", **stated), PLACING), [mark(0.5), *messages, mark(3.0)])
        for scan in (one.scan, scan_from(scan_data(one.scan))):
            assert wanted == (None if scan.detections.time is None else scan.detections.time.tolist())
            assert scan.time == messages[-1].time
    for wrong in (evolve(told, time=None), evolve(told, times=np.array([2.5, 1e9]))):
        with pytest.raises(ValueError, match=r"^times: "):
            list(Grouper(Grouping(by="turn"), PLACING).add(wrong, 3.0))


def test_null_an_empty_cell_and_an_absent_column_are_components_that_a_return_lacks() -> None:
    """They are written into the saved state of a service, and a sensor that always reports them refuses them."""
    doppler = RangeBearingRate(5.0, 0.01, 1.0)
    partial = Partial(doppler, optional={"range_rate": 60.0})
    axes = ("range", "azimuth", "range_rate")
    as_json = b'{"time": 1, "z": [[1000, 0.5, null], [900, 0.5, 2]], "axes": ["range", "bearing", "range_rate"]}\n'
    (null,) = JsonLines().decode(JsonLines().start(), as_json).messages
    lines = CsvLines(("time", *axes))
    (cell,) = lines.decode(lines.start(), b"1,1000,0.5,\n").messages
    absent = Message("radar", 1.0, np.array([[1000.0, 0.5]]), axes[:2])
    for message, lacking in ((null, [True, False]), (cell, [True]), (absent, [True])):
        (formed,) = Grouper(Grouping(), Placing({"radar": partial}, {}, None)).add(message, 1.0)
        seen = formed.scan.detections
        assert seen.missing is not None
        assert seen.missing.tolist() == [[False, False, lacks] for lacks in lacking]
        again = scan_from(json.loads(json.dumps(scan_data(formed.scan)))).detections.missing
        assert again is not None
        assert again.tolist() == seen.missing.tolist()
    for message in (cell, absent):
        with pytest.raises(ValueError, match="range_rate"):
            list(Grouper(Grouping(), Placing({"radar": doppler}, {}, None)).add(message, 1.0))
    (formed,) = Grouper(Grouping(), Placing({"radar": doppler}, {}, None)).add(null, 1.0)
    assert formed.scan.detections.missing is None  # the tracker refuses the return that holds no number


def test_a_place_out_of_reach_is_refused_beside_one_that_says_nothing() -> None:
    z = np.array([[np.nan, 10.0], [-30.0, 10.0]])
    with pytest.raises(ValueError, match="origin"):
        list(Grouper(Grouping(), PLACING).add(Message("ais", 1.0, z, ("latitude", "longitude")), 1.0))


def test_a_pose_without_a_velocity_is_refused_where_range_rates_are_measured() -> None:
    """It would count as at rest, and each rate err by the platform's own speed."""
    placing = Placing({"radar": RangeBearingRate(5.0, 0.01, 0.5)}, {}, None)
    message = Message("radar", 1.0, np.array([[1000.0, 0.1, 3.0]]), pose=Pose(np.array([100.0, 0.0])))
    with pytest.raises(ValueError, match=r"pose.velocity"):
        placing.returns(message, "radar")
    still = evolve(message, pose=Pose(np.array([100.0, 0.0]), np.zeros(2)))
    np.testing.assert_array_equal(placing.returns(still, "radar"), message.z)
