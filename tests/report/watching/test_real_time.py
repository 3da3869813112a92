"""The pace: scans come when they are due, and what is late is told as late."""

import math

import pytest

from vedette import LazyScans, Scan
from vedette.types import Detections
from vedette_report.watching import real_time
from vedette_report.watching.real_time import Pace, read_speed


class Clock:
    """Time that passes while somebody sleeps."""

    def __init__(self):
        self.now = 100.0

    def sleep(self, seconds):
        assert seconds > 0
        self.now += seconds


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(real_time, "sleep", clock.sleep)
    monkeypatch.setattr(real_time, "monotonic", lambda: clock.now)
    monkeypatch.setattr(real_time, "time", lambda: clock.now + 1e9)
    return clock


SCANS = [Scan(time, "radar", Detections.of([], 2)) for time in (3.0, 5.0, 5.0, 9.0)]


def came(scans, speed, clock, work=0.0):
    own, found = Pace(speed), []
    for _ in own(scans, "tracking"):
        found.append((clock.now - 100.0, own.came - 1e9 - 100.0))
        clock.now += work
    return found


def test_scans_come_as_recorded_or_so_many_times_as_fast(clock):
    assert [now for now, _ in came(SCANS, 1.0, clock)] == [0.0, 2.0, 2.0, 6.0]
    clock.now = 100.0
    assert [now for now, _ in came(SCANS, 4.0, clock)] == [0.0, 0.5, 0.5, 1.5]


def test_what_is_late_came_when_it_was_due(clock):
    found = came(SCANS, 1.0, clock, work=3.0)
    assert [now for now, _ in found] == pytest.approx([0.0, 3.0, 6.0, 9.0])
    assert [due for _, due in found] == pytest.approx([0.0, 2.0, 2.0, 6.0])


def test_nothing_waits_at_full_speed_or_for_a_camera(clock):
    assert {now for now, _ in came(SCANS, math.inf, clock)} == {0.0}
    camera = LazyScans(len(SCANS), SCANS.__getitem__, once=True)
    assert {now for now, _ in came(camera, 1.0, clock)} == {0.0}


@pytest.mark.parametrize(("text", "speed"), [("10", 10.0), ("0.5", 0.5), ("max", math.inf)])
def test_a_speed_is_read(text, speed):
    assert read_speed(text) == speed


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "fast", ""])
def test_a_speed_that_is_none_is_told(text):
    with pytest.raises(ValueError, match="must be above 0"):
        read_speed(text)
