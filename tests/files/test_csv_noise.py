"""Returns with errors of their own, in columns of deviations, variances and covariances."""

import numpy as np
import pytest

from vedette.errors import ConfigError
from vedette_files import CsvSource
from vedette_files.tables.returns import DetectionColumns
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

PLANE = {"radar": CartesianPosition(sigma=1.0)}
XY = {"x": "x", "y": "y"}


def opened(folder, text, noise, sensors=PLANE, columns=XY, **more):
    (folder / "d.csv").write_text(text)
    detections = DetectionColumns(time="t", columns=columns, noise=noise, **more)
    return CsvSource(detections, str(folder / "d.csv")).open(sensors, np.random.default_rng(0))


@pytest.mark.parametrize(
    ("titles", "cells", "noise", "R"),
    [
        ("s", "2", {"x": "s", "y": "s"}, [[4, 0], [0, 4]]),
        ("sx,sy", "2,3", {"x": "sx", "y": "sy"}, [[4, 0], [0, 9]]),
        ("vx,vxy,vy", "4,-1,9", {"x x": "vx", "x y": "vxy", "y y": "vy"}, [[4, -1], [-1, 9]]),
    ],
    ids=["one", "two", "three"],
)
def test_one_two_or_three_columns_are_each_returns_covariance(titles, cells, noise, R, tmp_path):
    recording = opened(tmp_path, f"t,x,y,{titles}\n0,1,2,{cells}\n0,3,4,{cells}\n1,,,,,\n2,5,6,{cells}\n", noise)
    assert [None if scan.detections.noise is None else scan.detections.noise.tolist() for scan in recording.scans] == [
        [R, R],
        None,
        [R],
    ]


def test_units_of_the_axes_are_those_of_their_errors_and_others_need_their_own(tmp_path):
    polar = {"radar": RangeBearing(sigma_range=1.0, sigma_bearing=0.01)}
    named = {"range": "r", "bearing": "b"}
    text, units = "t,r,b,sr,v\n0,3,90,0.5,4\n", {"range": "km", "bearing": "deg"}
    recording = opened(tmp_path, text, {"range": "sr", "bearing bearing": "v"}, polar, named, units=units)
    assert recording.scans[0].detections.noise == pytest.approx(np.diag([500.0**2, 4 * np.radians(1.0) ** 2])[None])


@pytest.mark.parametrize(
    ("cells", "told"),
    [
        ("-4,0,9", "d.csv:2: vx must be > 0, got '-4'"),
        ("4,6,9", "d.csv:2: vxy must be between -6 and 6, by the variances, got 6"),
        ("4,,9", "d.csv:2: vxy must be a number, got ''; name another column"),
    ],
)
def test_what_is_no_covariance_is_refused_with_its_place(cells, told, tmp_path):
    recording = opened(tmp_path, f"t,x,y,vx,vxy,vy\n0,1,2,{cells}\n1,1,2,4,1,9\n", {"x x": "vx", "x y": "vxy", "y y": "vy"})
    assert [str(problem) for problem in recording.refused] == [told]
    assert len(recording.scans) == 1


@pytest.mark.parametrize("noise", [{"q": "s"}, {"x": "s"}, {"x": "s", "x x": "s", "y": "s"}, {"x y z": "s"}])
def test_each_axis_has_one_column_and_others_are_told(noise, tmp_path):
    with pytest.raises(ConfigError, match=r"detections\.noise.*: must"):
        opened(tmp_path, "t,x,y,s\n0,1,2,3\n", noise)
