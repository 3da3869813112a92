"""Files as radar networks, decoders and clustering write them: what they say in words, counters and items of a standard."""

import json
import math

import numpy as np
import pytest

from vedette.errors import InputError
from vedette_tools.drafting.config import drafted
from vedette_tools.drafting.recognising import read_table
from vedette_tools.drafting.titles import meaning

SITES = {"EKCH": (55.6, 12.7, 0.0, 0.0), "ESMK": (55.68984, 13.33604, 40_000.0, 10_000.0)}  # lat, lon, m east, m north


def two_radars(path, *, blank=0):
    """Write what two radars see of five aircraft, each around its own site; `blank` rows lack the site."""
    rng = np.random.default_rng(19)
    start, pace = rng.uniform(-30_000, 30_000, (5, 2)), rng.normal(0, 130, (5, 2))
    rows = []
    for late, (name, (lat, lon, *at)) in enumerate(SITES.items()):
        for time in 1.7 * late + 5.0 * np.arange(60):
            for east, north in start + pace * time - at:
                r, b = math.hypot(east, north) + rng.normal(0, 50), math.degrees(math.atan2(east, north))
                rows.append((round(1000 * time), f"{lat},{lon},{name},{r:.0f},{(b + rng.normal(0, 0.1)) % 360:.3f}"))
    told = [f"{time},{cells}" for time, cells in sorted(rows)]
    told[:blank] = [",".join([row.split(",")[0], "", "", *row.split(",")[3:]]) for row in told[:blank]]
    path.write_text("\n".join(["epoch_ms,site_lat,site_lon,radar,range_m,azimuth_deg", *told]))
    return path


@pytest.mark.costly
def test_radars_stand_where_their_rows_say(tmp_path):
    """Both were taken for one at one place: ten tracks of five aircraft, without a word."""
    draft = drafted(two_radars(tmp_path / "plots.csv"))
    assert 'object = "radar"' in draft.text
    assert "tried on its own data: 5 tracks, 0 of them short" in draft.text


@pytest.mark.parametrize(("blank", "carried_by"), [(0, "radar"), (1, "")])
def test_each_sensor_stands_by_itself_where_every_row_says_so(blank, carried_by, tmp_path):
    table = read_table(two_radars(tmp_path / "plots.csv", blank=blank))
    assert table.carried_by == carried_by
    assert table.sensors == ("EKCH", "ESMK")
    assert dict(table.platform) == {"latitude": "site_lat", "longitude": "site_lon"}


def decoded(path, r="rho"):
    plots = [
        {"ToD": {"desc": "s", "val": 5 * t}, "I040": {"RHO": {"desc": r, "val": 9.5}, "THETA": {"val": 3.0}}}
        for t in range(9)
    ]
    path.write_text(json.dumps(plots))
    return path


def test_a_column_of_words_is_no_range(tmp_path):
    """The description of a decoded item stood before its value and was taken: no row could be read."""
    table = read_table(decoded(tmp_path / "048.json"))
    assert table.measured == {"range": "I040.RHO.val", "bearing": "I040.THETA.val"}
    assert table.units["range"] == "NM"


def test_words_are_read_where_there_is_nothing_else(tmp_path):
    (tmp_path / "d.csv").write_text("time,x,y\n" + "".join(f"{t},near,far\n" for t in range(9)))
    with pytest.raises(InputError, match="near"):
        drafted(tmp_path / "d.csv")


def test_ranges_and_rows_of_a_radar_have_their_axes():
    axes = {title: meaning(title).axis for title in ("radar", "radar_range", "sensor_range_m", "site_id", "radar_id")}
    assert axes == {
        "radar": "sensor",
        "radar_range": "range",
        "sensor_range_m": "range",
        "site_id": "sensor",
        "radar_id": "sensor",
    }
    own = {
        title: meaning(title).axis for title in ("site_lat", "radar_x", "sensor_lon_deg", "station") if meaning(title).own
    }
    assert own == {"site_lat": "latitude", "radar_x": "x", "sensor_lon_deg": "longitude"}
    assert (meaning("THETA_ACP").unit, meaning("az[mil]").unit) == ("0.087890625 deg", "mil")
    assert [meaning(title).axis for title in ("centroid_x", "DistLat", "dist_long_m")] == ["x", "y", "x"]
    assert [meaning(title).axis for title in ("Abscisse (m)", "Ordonnée (m)", "elapsed_s")] == ["x", "y", "time"]


def frames(path, *, names):
    """Write three to five objects of each frame, with a number in it, or with names of which some are not seen."""
    rng = np.random.default_rng(1)
    rows = []
    for t in range(40):
        seen = [i for i in range(5) if rng.random() < 0.8]
        rows += [f"{t},{i if names else k},{100 * i + t},{t}" for k, i in enumerate(seen)]
    path.write_text("\n".join(["time,id,x,y", *rows]))
    return path


@pytest.mark.parametrize(("names", "identity"), [(False, ""), (True, "id")])
def test_a_number_within_a_frame_is_no_name(names, identity, tmp_path):
    """The first return of each frame was one object's: nothing fitted."""
    assert read_table(frames(tmp_path / "d.csv", names=names)).identity == identity


def test_objects_that_only_come_have_names(tmp_path):
    rows = [f"{t},{i},{100 * i + t},{t}" for t in range(40) for i in range(1 + t // 10)]
    (tmp_path / "d.csv").write_text("\n".join(["time,id,x,y", *rows]))
    assert read_table(tmp_path / "d.csv").identity == "id"


def test_an_elevation_that_is_not_read_is_told(tmp_path):
    """Ranges to what flies high were taken for those along the ground, and a list of columns not read held the elevation."""
    for title, told in (("elevation_deg", True), ("snr", False)):
        (tmp_path / "d.csv").write_text(
            f"time,range_m,azimuth_deg,{title}\n" + "".join(f"{t},900,{t},20\n" for t in range(9))
        )
        said = read_table(tmp_path / "d.csv").said
        assert any("range_bearing_elevation" in one and title in one for one in said) == told


def test_lines_of_a_log_are_no_table(tmp_path):
    """The command that was to write titles above them wrote none."""
    line = '1772000000.000 radar/1 {"plots": [{"r": 3815.0, "az": 131.29}, {"r": 2676.9, "az": 88.87}]}'
    (tmp_path / "d.log").write_text(f"{line}\n" * 9)
    with pytest.raises(InputError, match="make a table of it first") as raised:
        read_table(tmp_path / "d.log")
    assert "echo" not in str(raised.value)
