"""What the page draws of a sensor's view is what the sensor says that it detects."""

import numpy as np
import pytest

import vedette
from support.results import config
from vedette import Space
from vedette.types import Pose
from vedette_report.map.views import view

GROUND = Space.of(x="m", y="m")


class Looking:
    """A sensor that sees from `near` to `far` within `half` of the bearing `middle`, from where it stands."""

    observes = GROUND

    def __init__(self, near, far, middle=0.0, half=np.pi, place=(0.0, 0.0)):
        self.near, self.far, self.middle, self.half, self.place = near, far, middle, half, np.array(place)

    def at(self, pose):
        return Looking(self.near, self.far, self.middle, self.half, pose.position)

    def detects(self, x):
        away = x - self.place
        r, bearing = np.hypot(*np.moveaxis(away, -1, 0)), np.arctan2(away[..., 1], away[..., 0])
        off = np.abs((bearing - self.middle + np.pi) % (2 * np.pi) - np.pi)
        return 0.9 * ((r >= self.near) & (r <= self.far) & (off <= self.half))


@pytest.mark.parametrize("middle", [0.0, 3.0, -1.3])
@pytest.mark.parametrize("place", [None, (400.0, -900.0)])
def test_a_sector_has_the_bearings_and_the_ranges_of_the_sensor(middle, place):
    (arc,) = view(Looking(25.0, 4321.0, middle, 0.51234, place or (7.0, 7.0)), place)
    assert not arc["closed"]
    rows = np.array(arc["rows"])
    turned = (rows[:, 0] - middle + np.pi) % (2 * np.pi) - np.pi
    np.testing.assert_allclose([turned[0], turned[-1]], [-0.51234, 0.51234], atol=2e-5)
    np.testing.assert_allclose(rows[:, 1:], np.broadcast_to([25.0, 4321.0], (len(rows), 2)), rtol=1e-4)


def test_a_radar_sees_all_round():
    radar = vedette.load(config()).tracker.sensors["radar"]
    assert view(radar, (radar.x, radar.y)) is None, "it has no limit"
    (arc,) = view(Looking(0.0, 500.0), None)
    assert arc["closed"]
    assert {tuple(row[1:]) for row in arc["rows"]} == {(0.0, 500.0)}
    assert len(arc["rows"]) == 180


def test_a_camera_that_sees_as_far_as_there_is_has_two_sides():
    (arc,) = view(Looking(0.0, np.inf, 1.0, 0.3), None)
    assert {tuple(row[1:]) for row in arc["rows"]} == {(0.0, None)}


def test_two_sectors_are_two_arcs_and_blindness_none():
    both = Looking(10.0, 100.0)
    both.detects = lambda x: np.abs(x[..., 0]) > np.abs(x[..., 1])
    assert len(view(both, (0.0, 0.0))) == 2
    both.detects = lambda x: np.zeros(x.shape[:-1])
    assert view(both, (0.0, 0.0)) is None


def test_no_ground_no_view():
    looking = Looking(1.0, 2.0)
    looking.observes = Space.of(x="px", y="px")
    assert view(looking, None) is None


def test_a_sensor_on_a_platform_is_asked_where_it_looks_straight_ahead():
    class Turned(Looking):
        def at(self, pose: Pose):
            assert (pose.position.tolist(), float(pose.heading)) == ([0.0, 0.0], 0.0)
            return super().at(pose)

    assert view(Turned(0.0, 50.0, place=(9.0, 9.0)), None)[0]["rows"][0] == [0.0, 0.0, 50.0]


def test_a_sensor_that_cannot_be_placed_has_no_view():
    """As a third party's that leaves `at` out; its runs write their series all the same."""

    class Fixed(Looking):
        kind = "fixed"
        at = vedette.Sensor.at

    assert view(Fixed(0.0, 500.0), None) is None
