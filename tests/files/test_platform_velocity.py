"""A platform's velocity where no column tells it, the slope of its path; and a sensor aboard, which its turns move."""

import numpy as np
import pytest
from attrs import evolve

from support.csv_recordings import opened
from vedette import Detections, Pose, Recording, Scan
from vedette_files import JsonLinesSource, write_recording
from vedette_files.tables.platform import Mounting, PlatformColumns
from vedette_standard.sensors.partial import Partial
from vedette_standard.sensors.range_bearing_rate import RangeBearingRate

RADAR = {"radar": RangeBearingRate(1.0, 0.01, 0.1)}
COLUMNS = {"range": "r", "bearing": "b", "range_rate": "d"}
OWN = PlatformColumns({"x": "px", "y": "py"}, file="own.csv", time="s")
AT = np.array([0.0, 1.0, 1.5, 3.0, 4.0, 6.0])
PARKED = np.array([200.0, 40.0, 0.0, 0.0])


def place(t):
    """A platform that gathers speed: its velocity is (6 t, -2) m/s."""
    return np.array([3.0 * t**2, -2.0 * t])


def seen(t):
    d = PARKED[:2] - place(t)
    return np.hypot(*d), np.arctan2(d[1], d[0]), -d @ [6.0 * t, -2.0] / np.hypot(*d)


def check_poses(recording):
    assert len(recording.scans) == 3
    for scan in recording.scans:
        np.testing.assert_allclose(scan.pose.velocity, [6.0 * scan.time, -2.0], atol=1e-9)
        assert RADAR["radar"].at(scan.pose).measure(PARKED)[2] == pytest.approx(scan.detections.z[0, 2], abs=0.05)


def rows(times):
    return "\n".join(["t,k,r,b,d,px,py", *(",".join(map(repr, map(float, (t, t, *seen(t), *place(t))))) for t in times)])


def test_along_a_path_at_times_of_its_own(tmp_path):
    """Uneven steps; between the rows the velocity is interpolated as the position is."""
    (tmp_path / "own.csv").write_text("\n".join(["s,px,py", *(f"{t},{place(t)[0]},{place(t)[1]}" for t in AT)]))
    recording = opened(tmp_path, rows([1.0, 1.5, 3.0]), RADAR, columns=COLUMNS, platform=OWN)
    check_poses(recording)


def test_along_the_scans(tmp_path):
    """The first and the last scan have one neighbour alone: the slope there is that of half a step away."""
    own = PlatformColumns({"x": "px", "y": "py"}, scan="k")
    recording = opened(tmp_path, rows([0.5, 1.0, 1.5, 3.0, 4.0]), RADAR, columns=COLUMNS, platform=own, scan="k")
    check_poses(evolve(recording, scans=recording.scans[1:-1]))


@pytest.mark.parametrize(("own", "velocity"), [(OWN, None), (evolve(OWN, over_ground=True), [0.0, 0.0])])
def test_one_place_has_no_slope_and_rates_over_ground_need_none(own, velocity, tmp_path):
    (tmp_path / "own.csv").write_text("s,px,py\n1.0,5,6\n")
    (scan,) = opened(tmp_path, rows([1.0]), RADAR, columns=COLUMNS, platform=own).scans
    assert (scan.pose.velocity is None) if velocity is None else (scan.pose.velocity.tolist() == velocity)


@pytest.mark.parametrize("told", ["vx,vy", ""])
def test_a_sensor_ahead_on_a_platform_that_turns(told, tmp_path):
    """On a circle of 100 m at 0.2 rad/s, over the wrap of headings: where what is mounted 3 m ahead is, and how fast."""
    times, mount = np.arange(0.0, 40.0, 0.25), Mounting(3.0, -1.0, 0.5)
    angle, own = 0.2 * times, {"x": "px", "y": "py", "heading": "h"} | {title: title for title in told.split(",") if title}
    path = np.column_stack([times, 100 * np.cos(angle), 100 * np.sin(angle), (angle + np.pi / 2) % (2 * np.pi)])
    path = np.column_stack([path, -20 * np.sin(angle), 20 * np.cos(angle)])
    lines = ["s,px,py,h,vx,vy", *(",".join(map(repr, map(float, row))) for row in path)]
    (tmp_path / "own.csv").write_text("\n".join(lines))
    platform = PlatformColumns(own, file="own.csv", time="s", mounted={"radar": mount})
    recording = opened(tmp_path, "t,r,b,d\n20.0,50,0.1,1\n25.25,50,0.1,1\n", RADAR, columns=COLUMNS, platform=platform)
    for scan in recording.scans:
        ahead, left = (np.array([np.cos(a), np.sin(a)]) for a in (0.2 * scan.time + np.pi / 2, 0.2 * scan.time + np.pi))
        spot = -100 * left + 3.0 * ahead - 1.0 * left
        np.testing.assert_allclose(scan.pose.position, spot, atol=1e-6)
        np.testing.assert_allclose(scan.pose.velocity, 0.2 * np.array([-spot[1], spot[0]]), atol=0.02)
        assert np.cos(scan.pose.heading - 0.2 * scan.time - np.pi / 2 - 0.5) == pytest.approx(1.0)


def test_a_place_of_the_sensors_own_that_does_not_count_is_told(tmp_path):
    radar = {"radar": evolve(RADAR["radar"], x=3.5, heading=0.5)}
    recording = opened(
        tmp_path,
        rows([0.5, 1.0]),
        radar,
        columns=COLUMNS,
        platform=PlatformColumns({"x": "px", "y": "py"}, scan="k"),
        scan="k",
    )
    assert [told for told in recording.warnings if "sensors.radar" in told and "mounted" in told]


@pytest.mark.parametrize(("place", "told"), [([9.0, 2.0], "x = 3.5, heading = 0.5"), ([3.5, 0.0], "heading = 0.5 of")])
def test_what_poses_of_other_recordings_replace_is_told_too(place, told, tmp_path):
    """Of a wrapped sensor, too; not where its scans stand in the very place that it states."""
    radar = {"radar": Partial(evolve(RADAR["radar"], x=3.5, heading=0.5), {"range_rate": 9.0})}
    scan = Scan(1.0, "radar", Detections.of([[100.0, 0.1, 1.0]]), Pose(np.array(place), np.zeros(2), 0.0))
    write_recording(tmp_path / "r.jsonl", Recording((scan,)), {"radar": radar["radar"].measurement})
    (said,) = JsonLinesSource(path=str(tmp_path / "r.jsonl")).open(radar, np.random.default_rng(0)).warnings
    assert said.startswith(f"sensors.radar: {told}")
