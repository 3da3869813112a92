"""The summary's table of tracks: when, how long, how fast and where to."""

import numpy as np
import pytest
from attrs import evolve

from support.results import result, track
from vedette_files.readers import NORTH_EAST
from vedette_report.summary.tracks import MOST_TRACKS, track_rows

ORIGIN = {"origin": "54.0, 10.0, 0.0"}


def moving(vx, vy, number=0, cov=None):
    states = np.tile([0.0, 0.0, vx, vy], (5, 1))
    return evolve(track(range(5), states, np.eye(4) if cov is None else cov), id=number)


def row(done, i=0):
    return track_rows(done)[2 + i].split()


@pytest.mark.parametrize(
    ("velocity", "notes", "course"),
    [
        ((0.0, 5.0), {}, "90"),
        ((0.0, 5.0), ORIGIN, "0"),
        ((5.0, 0.0), ORIGIN, "90"),
        ((-5.0, 0.0), ORIGIN, "270"),
        ((0.0, 5.0), ORIGIN | {"frame": NORTH_EAST}, "90"),
        ((5.0, -5.0), {}, "315"),
    ],
)
def test_speed_and_course_at_the_end(velocity, notes, course):
    done = result([moving(*velocity)], times=range(5), notes=notes)
    told = row(done)
    assert float(told[told.index("s", 4) + 2]) == pytest.approx(np.hypot(*velocity), rel=0.01)
    assert told[-3] == course
    sense = "clockwise from north" if notes else "from +x towards +y"
    assert track_rows(done)[0].endswith(f"the course {sense}")


def test_their_deviations_are_along_and_across_the_velocity():
    cov = np.diag([1.0, 1.0, 0.09, 0.25])
    told = row(result([moving(10.0, 0.0, cov=cov)], times=range(5)))
    assert told[-6:-3] == ["10", "+-", "0.3"]
    assert told[-2:] == ["+-", "2.9"]


def test_a_track_that_stands_has_no_course():
    assert row(result([moving(0.1, 0.0)], times=range(5)))[-1] == "-"
    assert row(result([moving(0.0, 0.0)], times=range(5)))[-2:] == ["0", "-"]


def test_many_tracks_are_cut_and_counted():
    done = result([moving(1.0, 0.0, i) for i in range(MOST_TRACKS + 3)], times=range(5))
    assert len(track_rows(done)) == 2 + MOST_TRACKS + 1
    assert track_rows(done)[-1] == "  and 3 more, which tracks.csv has"
    assert track_rows(result(times=range(5))) == []
