"""What stands between raw scans and a tracker: grouping by moment, names, and what is left out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

import numpy as np
import pytest
from attrs import Factory, evolve, frozen

import vedette
from vedette import Detections, Frame, Preprocessor, Recording, Scan, ScanRefused, Sensor, Source, Space, fields
from vedette.tracking.preprocessing import check_preprocessors, preprocess, preprocessed, raw_sensors
from vedette_flir.sensors.gaussian_spot import GaussianSpot
from vedette_standard.preprocessors.grouped_returns import GroupedReturns
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.partial import Partial
from vedette_standard.sensors.range_bearing import RangeBearing

RADAR = CartesianPosition(5.0)


@final
@frozen
class Joined(Preprocessor):
    """All returns of its sensors, as if of one."""

    kind: ClassVar[str] = "joined"

    sensors: dict[str, Sensor] = fields.part("any number of sensors")

    @property
    def measurement(self) -> Space:
        return RADAR.measurement

    def process(self, scans: Mapping[str, Scan]) -> Detections:
        return Detections.of(np.concatenate([scans[name].detections.z for name in sorted(scans)]), 2)


@final
@frozen
class Given(Source):
    """Scans that a test states."""

    kind: ClassVar[str] = "given"

    scans: tuple[Scan, ...] = ()

    def open(self, sensors, rng):
        return Recording(self.scans)


JOINED = {"radar": Joined({"a": RADAR, "b": RADAR})}


def scan(time, name, *z):
    return Scan(time, name, Detections.of(list(z), 2))


def summary(scans):
    return [(s.time, s.sensor, s.detections.z[:, 0].tolist()) for s in scans]


def test_scans_of_a_moment_make_one():
    raw = [
        scan(0, "a", [1, 0]),
        scan(0, "other", [9, 0]),
        scan(0, "b", [2, 0], [3, 0]),
        scan(1, "b", [4, 0]),
        scan(2, "other", [8, 0]),
        scan(3, "a"),
    ]
    expected = [(0, "other", [9]), (0, "radar", [1, 2, 3]), (1, "radar", [4]), (2, "other", [8]), (3, "radar", [])]
    assert summary(preprocessed(raw, JOINED)) == expected


def test_a_sensor_that_looks_twice_at_a_moment_makes_two():
    raw = [scan(0, "a", [1, 0]), scan(0, "b", [2, 0]), scan(0, "a", [3, 0])]
    assert summary(preprocessed(raw, JOINED)) == [(0, "radar", [1, 2]), (0, "radar", [3])]


POLAR = Partial(RangeBearing(10.0, 0.01), {"range": 5000.0})
GAPS = Detections(
    np.array([[1000.0, 0.2], [7.0, 0.3], [1500.0, 0.4]]), np.ones(3, dtype=bool), missing=[[0, 0], [1, 0], [0, 0]]
)
"""Ranges and bearings of which the second return lacks its range; what stands there says nothing."""


@final
@frozen
class Tap(Preprocessor):
    """Passes all on, by bearings within limits, and remembers what it was given."""

    kind: ClassVar[str] = "tap"
    takes_incomplete: ClassVar[bool] = True

    sensors: dict[str, Sensor] = fields.part("one sensor")
    seen: list[Detections] = Factory(list)

    @property
    def measurement(self) -> Space:
        return POLAR.measurement

    def process(self, scans: Mapping[str, Scan]) -> Detections:
        (one,) = scans.values()
        self.seen.append(one.detections)
        return evolve(one.detections, valid=one.detections.valid & (np.abs(one.detections.z[..., 1]) < 1.0))


@final
@frozen
class Whole(Preprocessor):
    """Passes all on, and takes complete returns alone."""

    kind: ClassVar[str] = "whole"

    sensors: dict[str, Sensor] = fields.part("one sensor")
    seen: list[Detections] = Factory(list)

    measurement = Tap.measurement
    process = Tap.process


def test_what_returns_lack_is_nan_to_a_preprocessor_that_takes_such_and_passes_through_it():
    for makes in (tap := Tap({"r": POLAR}), GroupedReturns({"r": POLAR}, link=30.0)):
        (made,) = preprocess([Scan(0.0, "r", GAPS)], {"r": makes}, problems := [], strict=True)
        assert problems == []
        assert made.detections.valid.tolist() == [True] * 3
        assert made.detections.missing.tolist() == GAPS.missing.tolist()
        np.testing.assert_array_equal(made.detections.z, np.where(GAPS.missing, 0.0, GAPS.z))
    assert np.isnan(tap.seen[0].z[1, 0])


def test_what_returns_lack_costs_them_before_any_other_preprocessor_and_is_told():
    whole = {"r": Whole({"r": POLAR})}
    (made,) = preprocess([Scan(0.0, "r", GAPS)], whole, problems := [], strict=False)
    assert made.detections.valid.tolist() == [True, False, True]
    assert made.detections.missing is None
    np.testing.assert_array_equal(made.detections.z[1], [0, 0])
    told = "raw scan 0, return 1: lacks a component, and 'whole' does not take such (`takes_incomplete`)"
    assert [str(problem) for problem in problems] == [told]
    with pytest.raises(ScanRefused, match="lacks a component"):
        tuple(preprocess([Scan(0.0, "r", GAPS)], whole, [], strict=True))


def test_a_run_loses_no_return_that_lacks_a_component_in_a_preprocessor():
    """It took the complete ones alone where a preprocessor passed on all, and said nothing."""
    config = {
        "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
        "sensors": {"r": POLAR},
        "associator": {"kind": "pda"},
        "birth": {"kind": "given", "start": {"x": [800, 20], "y": [0, 20], "vx": [5, 1], "vy": [3, 1]}},
        "lifecycle": {"kind": "existence"},
    }
    rng = np.random.default_rng(3)
    z = np.stack([rng.normal(900.0, 10.0, 80), rng.normal(0.0, 0.01, 80)], axis=-1)
    missing = np.stack([rng.random(80) < 0.5, np.zeros(80, dtype=bool)], axis=-1)
    scans = [
        Scan(float(i), "r", Detections(z[i : i + 1], np.ones(1, dtype=bool), missing=missing[i : i + 1])) for i in range(80)
    ]
    returns, told, scans_taken = {}, {}, {}
    for name, makes in (("none", {}), ("tap", {"r": Tap({"r": POLAR})}), ("whole", {"r": Whole({"r": POLAR})})):
        result = vedette.Experiment(vedette.build(config), source=Given(tuple(scans)), preprocessors=makes).run()
        returns[name], told[name], scans_taken[name] = result.intake.returns, len(result.refused), result.intake.scans
    assert returns["none"] == returns["tap"] == returns["whole"] + told["whole"] == 80
    assert told["none"] == told["tap"] == 0
    assert scans_taken == returns, "a scan of which nothing is left is no miss"


def test_what_a_preprocessor_passes_on_its_sensor_must_take():
    check_preprocessors({"r": Tap({"r": POLAR})}, {"r": POLAR})
    check_preprocessors({"r": Whole({"r": POLAR})}, {"r": POLAR.of})
    with pytest.raises(ValueError, match=r"sensors.r: .* lack range, .* 'partial'"):
        check_preprocessors({"r": Tap({"r": POLAR})}, {"r": POLAR.of})


def test_without_preprocessors_scans_are_as_they_come():
    raw = (scan(0, "radar", [1, 0]), scan(0, "radar", [np.nan, 0]))
    assert tuple(preprocess(raw, {}, problems := [], strict=True)) == raw
    assert problems == []


def test_a_source_delivers_what_preprocessors_take():
    sensors = {"radar": RADAR, "other": RangeBearing(1.0, 0.1)}
    assert raw_sensors(JOINED, sensors) == {"other": sensors["other"], "a": RADAR, "b": RADAR}
    same = {"radar": Joined({"radar": RADAR})}
    check_preprocessors(same, {"radar": RADAR})
    assert raw_sensors(same, {"radar": RADAR}) == {"radar": RADAR}


@pytest.mark.parametrize(
    ("preprocessors", "sensors", "message"),
    [
        (JOINED, {"sonar": RADAR}, r"preprocessors.radar: must be named as one.*'sonar'"),
        (
            JOINED,
            {"radar": RangeBearing(1.0, 0.1)},
            r"preprocessors.radar: must make what .* measures, \(range",
        ),
        (
            JOINED,
            {"radar": RADAR, "a": RADAR},
            r"preprocessors.radar.sensors.a: scans of this name go.*'a'",
        ),
        (
            JOINED | {"two": Joined({"b": RADAR})},
            {"radar": RADAR, "two": RADAR},
            r"preprocessors.two.sensors.b: scans of this name go.*'radar'",
        ),
    ],
)
def test_names_that_clash_are_told(preprocessors, sensors, message):
    with pytest.raises(ValueError, match=message):
        check_preprocessors(preprocessors, sensors)


def test_bad_raw_returns_are_left_out_and_told():
    raw = [
        scan(0, "a", [1, 0], [np.nan, 0]),
        Scan(0, "b", Detections.of([[1.0, 2, 3]])),
        scan(1, "b", [np.inf, 0]),
        scan(2, "a", [5, 0]),
    ]
    scans = tuple(preprocess(raw, JOINED, problems := [], strict=False))
    assert summary(scans) == [(0, "radar", [1]), (2, "radar", [5])]
    assert [problem.place for problem in problems] == ["raw scan 0, return 1", "raw scan 1, z", "raw scan 2, return [0]"]
    for bad in (0, 1, 2):
        with pytest.raises(ScanRefused, match=r"raw scan of '[ab]' at"):
            tuple(preprocess(raw[bad : bad + 1], JOINED, [], strict=True))


def experiment(*scans):
    return vedette.Experiment(
        vedette.build(
            {
                "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
                "sensors": {"radar": RADAR},
                "associator": {"kind": "nearest"},
                "birth": {"kind": "from_returns", "spread": {"vx": 5.0, "vy": 5.0}},
                "lifecycle": {"kind": "m_of_n", "hits": 1, "looks": 1},
            }
        ),
        source=Given(scans),
        preprocessors=JOINED,
    )


@pytest.mark.parametrize("bad", [[np.nan, 0], [1e16, 0]])
def test_a_scan_of_bad_returns_alone_is_refused_and_no_miss(bad):
    """Tracks of targets that were seen all along died, as their covariances came to nought."""
    seen, unusable = scan(0, "radar", [1, 0]), scan(1, "radar", bad, bad)
    given = evolve(experiment(seen, unusable, scan(2, "radar", [1, 0])), preprocessors={})
    result, without = given.run(), evolve(given, source=Given((seen, scan(2, "radar", [1, 0])))).run()
    assert summary(result.scans) == summary(without.scans)
    assert [problem.place for problem in result.refused] == ["scan 1, left out whole"]


def test_an_experiment_tracks_what_its_preprocessors_make():
    result = experiment(scan(0, "a", [1, 0]), scan(0, "b", [500, 0]), scan(1, "b", [np.nan, 0], [2, 0])).run()
    assert summary(result.scans) == [(0, "radar", [1, 500]), (1, "radar", [2])]
    assert [str(problem) for problem in result.refused] == ["raw scan 2, return 0: must be finite numbers, got [nan, 0.0]"]
    assert len(result.tracks) == 2


def test_an_experiment_refuses_a_detector_of_no_sensor():
    with pytest.raises(ValueError, match=r"preprocessors.sonar: must be named as one"):
        vedette.Experiment(experiment().tracker, preprocessors={"sonar": JOINED["radar"]})


def test_a_cameras_frames_go_to_a_preprocessor_and_to_the_tracker():
    frame = Scan.image(0.0, "camera", Frame(np.zeros((4, 4))))

    class Counting:
        sensors: ClassVar = {"camera": GaussianSpot()}
        takes_incomplete = False
        measurement = RADAR.measurement

        def process(self, scans):
            return Detections.of([[1.0, 2.0]])

    both = {"camera": GaussianSpot(), "radar": RADAR}
    check_preprocessors({"radar": Counting()}, both)
    made = list(preprocessed([frame], {"radar": Counting()}, both))
    assert [scan.sensor for scan in made] == ["radar", "camera"]  # else what moves fast starts where it was before
    assert made[1] is frame
    assert [scan.sensor for scan in preprocessed([frame], {"radar": Counting()}, {"radar": RADAR})] == ["radar"]
    raw = [scan(0, "radar", [1, 0])]
    assert len(list(preprocessed(raw, {"radar": Joined({"radar": RADAR})}, {"radar": RADAR}))) == 1
    with pytest.raises(ValueError, match=r"preprocessors.radar.sensors.camera"):
        check_preprocessors({"radar": Counting()}, both | {"camera": GaussianSpot(detection_probability=0.5)})
