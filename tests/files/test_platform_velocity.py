"""A platform's velocity where no column tells it: the slope of its path."""

import numpy as np
import pytest
from attrs import evolve

from support.csv_recordings import opened
from vedette_files.tables.platform import PlatformColumns
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
