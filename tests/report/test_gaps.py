"""Where returns that lack a component are on a map."""

import numpy as np

from vedette import Detections, Recording, Scan
from vedette_report.map.plane import Plane, positions_of, returns
from vedette_standard.sensors.biased import Biased
from vedette_standard.sensors.partial import Partial
from vedette_standard.sensors.range_bearing_rate import RangeBearingRate

DOPPLER = RangeBearingRate(sigma_range=10.0, sigma_bearing=0.01, sigma_rate=1.0)
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
