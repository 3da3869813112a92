"""Files that gave confident nonsense: a draft finds what is in them, or says first that nothing fits."""

import numpy as np
import pytest

from vedette_tools.drafting.own_errors import roundings
from vedette_tools.drafting.reading import read
from vedette_tools.drafting.table import read_table


def table(path, head, rows):
    path.write_text("\n".join([head, *(",".join(map(str, row)) for row in rows)]) + "\n")
    return path


def sigma_of(path):
    (noise,) = read(read_table(path)).noise.values()
    return noise.sensor


def test_what_lies_far_off_is_no_error_of_a_position(tmp_path):
    """A tenth of the fixes of one receiver, good to 2 m, is wrong by 3 km: errors of 57 m were drafted, and 1,400 m/s."""
    rng = np.random.default_rng(1)
    spots = np.cumsum([2.0, 1.0] + rng.normal(0, 0.2, (800, 2)), axis=0) + rng.normal(0, 2, (800, 2))
    spots[::10] += rng.normal(0, 3000, (80, 2))
    rows = [(i, *spot) for i, spot in enumerate(spots.round(2).tolist())]
    assert sigma_of(table(tmp_path / "d.csv", "time,x,y", rows)) == pytest.approx((2.0,), rel=0.1)


@pytest.mark.parametrize(("digits", "step"), [(2, 1112.0), (3, 111.2)])
def test_errors_are_no_smaller_than_digits_leave_them(digits, step, tmp_path):
    """Boats at 6 m/s stay in one hundredth of a degree for minutes: errors of 1 mm were drafted."""
    rng = np.random.default_rng(2)
    start, pace = rng.uniform(-5000, 5000, (5, 2)), rng.normal(0, 6, (5, 2))
    spots = [(10 * k, *(start[i] + 10 * k * pace[i]) / 111_195) for k in range(100) for i in range(5)]
    rows = [(t, f"{50 + north:.{digits}f}", f"{-1 + east:.{digits}f}") for t, north, east in spots]
    (sigma,) = sigma_of(table(tmp_path / "d.csv", "time,lat,lon", rows))
    assert step / 12**0.5 * 0.999 < sigma < step


def test_digits_tell_errors_in_any_unit():
    cells = {"range": ["1.25", "3"], "bearing": ["12.5"], "x": ["3"], "latitude": ["1e-3", "2"]}
    found = roundings(cells, {"range": "km", "bearing": "deg", "x": "px"})
    told = {"range": 10.0, "bearing": np.radians(0.1), "x": 1.0, "latitude": 0.0}
    assert found == pytest.approx({axis: step / 12**0.5 for axis, step in told.items()})
