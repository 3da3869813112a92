"""How far drafts let sensors see, and whether targets stay as the first were: what later scans and others show."""

import math
import tomllib

import numpy as np
import pytest

import vedette
from vedette_tools.drafting import config, reading
from vedette_tools.drafting.config import drafted
from vedette_tools.drafting.recognising import read_table
from vedette_tools.drafting.sights import view_of


@pytest.mark.costly
def test_targets_may_leave_for_where_the_first_scans_had_no_return(tmp_path, monkeypatch):
    """The range was that of the first 1,500 scans: of two boats that went on, nothing fitted the later returns."""
    monkeypatch.setattr(reading, "MOST_SCANS", 60)
    rng, rows = np.random.default_rng(5), []
    for time in range(240):
        for x, y in ((500 + 16 * time, 300 + 3 * time), (-400 - 2 * time, 900 + 15 * time)):
            r, b = math.hypot(x, y) + rng.normal(0, 8), math.degrees(math.atan2(y, x)) + rng.normal(0, 0.3)
            rows.append(f"{time},{r:.1f},{b:.3f}" if rng.random() < 0.9 else "")
    (tmp_path / "d.csv").write_text("\n".join(["time_s,range_m,bearing_deg", *filter(None, rows)]) + "\n")
    draft = drafted(tmp_path / "d.csv")
    assert not draft.failure
    config = tomllib.loads(draft.text)
    assert config["sensors"]["sensor"]["max_range"] > 4500
    assert len(vedette.load(config).run().tracks) == 2


def beside(path, code=""):
    """Write two boats that a radar sees, one of which passes a lidar of ten scans a second that sees 150 m; read it."""
    rng, rows = np.random.default_rng(3), []
    for i in range(1500):
        time = 0.1 * i
        for spot in ((-300.0 + 4 * time, 40.0), (1500.0 - 3 * time, -900.0 + 2 * time)):
            if i % 30 == 0 and rng.random() < 0.9:
                rows.append(f"{time:.1f},radar,{spot[0] + rng.normal(0, 10):.2f},{spot[1] + rng.normal(0, 10):.2f},")
            if math.hypot(*spot) < 150 and rng.random() < 0.95:
                rows.append(f"{time:.1f},lidar,{spot[0] + rng.normal(0, 0.5):.2f},{spot[1] + rng.normal(0, 0.5):.2f},{code}")
    path.write_text("\n".join(["time,sensor,x,y,mmsi", *rows]) + "\n")
    return reading.read(read_table(path))


def seen_by(read, name):
    z = np.concatenate([scan.detections.z for scan in read.recording.scans if scan.sensor == name])
    return view_of(read, name, z, 0.9)


@pytest.mark.costly
def test_others_tell_where_a_sensor_sees_nothing(tmp_path):
    """Its returns lie on a line: what the view is wider by is a part of the length of that."""
    read = beside(tmp_path / "d.csv")
    (left, low), (right, high) = seen_by(read, "lidar")
    assert -190 < left < -150
    assert 150 < right < 190
    assert low < 30
    assert high > 50
    assert seen_by(read, "radar") is None


@pytest.mark.costly
def test_who_reports_under_a_name_tells_no_view(tmp_path):
    """Others are not seen for they do not report, wherever they are."""
    assert seen_by(beside(tmp_path / "d.csv", "235000001"), "lidar") is None


@pytest.mark.nightly("20 s: how far a sensor sees is told by day")
def test_a_sensor_of_short_range_loses_no_target_of_the_others(tmp_path):
    """Stated to see everywhere, ten looks a second without a return ended the track of the boat that only the radar sees."""
    beside(tmp_path / "d.csv")
    config = tomllib.loads(drafted(tmp_path / "d.csv").text)
    assert config["sensors"]["lidar"]["view"]["x"]["low"] < -150
    assert config["lifecycle"]["max_out_of_coverage"] == "600 s"
    assert len(vedette.load(config).run().tracks) == 2


@pytest.mark.costly
def test_of_many_objects_a_scan_a_draft_is_tried_in_their_midst(tmp_path, monkeypatch):
    """The first 8,000 returns were four scans of 2,000 objects: all tracks were called short, and nothing fitted."""
    monkeypatch.setattr(config, "PROVEN", 400)
    rng = np.random.default_rng(7)
    start, velocity = rng.uniform(0, 6000, (100, 2)), rng.normal(0, 8, (100, 2))
    spots = [(time, *(start[i] + velocity[i] * time + rng.normal(0, 2, 2))) for time in range(24) for i in range(100)]
    (tmp_path / "d.csv").write_text("time_s,x_m,y_m\n" + "".join(f"{t},{x:.2f},{y:.2f}\n" for t, x, y in spots))
    draft = drafted(tmp_path / "d.csv")
    assert draft.failure == ""
    assert "on 0.2 of the returns of 20 scans" in draft.text
    assert len(vedette.load(tomllib.loads(draft.text)).run().tracks) == 100


@pytest.mark.costly
@pytest.mark.parametrize(("speed", "said"), [(12.0, True), (0.0, False)])
def test_targets_that_are_not_as_the_first_were_are_told(tmp_path, monkeypatch, speed, said):
    """Boats that come after hours in which only buoys lay there make no tracks, and nothing said so."""
    monkeypatch.setattr(config, "LOOKS", 100)
    monkeypatch.setattr(reading, "MOST_SCANS", 100)
    rng, rows = np.random.default_rng(2), []
    for time in range(400):
        spots = [(200.0, 300.0), (-500.0, 700.0)]
        if time > 150:
            spots += [(-2000 + speed * time, 400.0), (900.0, 2000 - speed * time)]
        rows += [f"{time},{x + rng.normal(0, 2):.2f},{y + rng.normal(0, 2):.2f}" for x, y in spots if rng.random() < 0.9]
    (tmp_path / "d.csv").write_text("\n".join(["time_s,x_m,y_m", *rows]) + "\n")
    text = drafted(tmp_path / "d.csv").text
    assert ("in the last 100 scans" in text) == said
    assert "# the first 100 of " in text
