"""Returns that lack a component: on a map, and in the figures of a run."""

import numpy as np
import pytest

import vedette
from vedette import Detections, Recording, Scan
from vedette_report.map.plane import Plane, positions_of, returns
from vedette_report.recorded.used import entries_of, gathered
from vedette_report.warnings.rehearsal import _chosen
from vedette_standard.sensors.biased import Biased
from vedette_standard.sensors.partial import Partial
from vedette_standard.sensors.range_bearing_rate import RangeBearingRate

DOPPLER = RangeBearingRate(sigma_range=10.0, sigma_bearing=0.01, sigma_rate=1.0)
BAND = 0.1
"""Of a mean of 1,500 scans of 2.5 squares each: more than four deviations."""
LACKS = [[False, False, True], [True, False, False], [False, False, False]]


def test_a_return_is_on_the_map_if_what_it_lacks_does_not_move_it():
    """What stands in the place of a missing component is no number: an inversion by singular values raised."""
    partial = Partial(DOPPLER, optional={"range_rate": 60.0, "range": 1e4})
    biased = Biased(partial, add={"range": "shift"}, spread={"shift": 1.0})
    z, noise = np.tile([100.0, 0.0, 1.0], (3, 1)), np.tile(np.diag([100.0, 1e-4, 1.0]), (3, 1, 1))
    z[np.array(LACKS)] = np.nan
    for sensor in (partial, biased):
        plane = Plane.of(sensor.observes, Recording(()))
        for own in (None, np.where(np.isnan(z)[:, None] | np.isnan(z)[:, :, None], np.nan, noise)):
            scan = Scan(0.0, "radar", Detections(z, np.ones(3, dtype=bool), noise=own, missing=LACKS))
            on_the_map = positions_of(scan, sensor, plane)
            np.testing.assert_allclose(on_the_map, [[100.0, 0.0], [np.nan] * 2, [100.0, 0.0]], atol=0.01)
            assert returns([scan], {"radar": sensor}, plane)["radar"].shape == (2, 2)


@pytest.mark.costly
def test_innovations_are_compared_with_as_many_components_as_returns_have():
    """The filter is right; half of the returns lack one of three: NIS was told as .83, that of the rate as a half."""
    config = {
        "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.3}},
        "sensors": {"radar": Partial(DOPPLER, optional={"range_rate": 60.0})},
        "associator": {"kind": "pda"},
        "birth": {"kind": "given", "start": {"x": [5000, 20], "y": [200, 20], "vx": [5, 1], "vy": [3, 1]}},
        "lifecycle": {"kind": "single_target"},
        "source": {
            "kind": "simulation",
            "duration": 3000,
            "looks": {"radar": {"interval": 2, "missing": {"range_rate": 0.5}}},
        },
    }
    motion = {"kind": "constant_velocity", "sigma_accel": 0.3}
    config["source"]["drawn"] = {"a": {"models": [motion], "start": config["birth"]["start"]}}
    experiment = vedette.load(config)
    result = experiment.run(keep_states=True)
    assert abs(result.score().nis - 1.0) < BAND
    (entries,) = entries_of(experiment.tracker, result).values()
    seen = gathered({"radar": experiment.tracker.sensors["radar"].measurement.names}, 0.99, entries)
    assert abs(np.sum(seen.nis) / np.sum(seen.hit * seen.axes) - 1.0) < BAND
    squares, count = seen.sizes["radar", "range_rate"]
    assert abs(squares / count - 1.0) < 2.0 * BAND


def test_a_rehearsal_takes_whole_returns_and_none_with_noise_of_their_own():
    z, valid, missing = (
        [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]],
        [True, False, True],
        [[False, True], [False, False], [False, False]],
    )
    given = {
        noise is None: Detections(z, valid, noise=noise, missing=missing) for noise in (None, np.array([np.eye(2)] * 3))
    }
    of = {plain: _chosen("a", [Scan(time, "a", seen) for time in (0.0, 1.0)]) for plain, seen in given.items()}
    assert [scan.detections.z.tolist() for scan in of[True][0]] == [[[5.0, 6.0]], [[5.0, 6.0]]]
    assert of[False] == ([], 0.0)
