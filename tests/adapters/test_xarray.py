"""Tracks as a data set of xarray, and data sets as tables to be tracked; libraries that are not there."""

import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from vedette.errors import InputError
from vedette_adapters.libraries import needed
from vedette_adapters.xarray import to_dataset, to_frame

LINE = EXAMPLES / "filterpy" / "line.csv"


@pytest.fixture(scope="module")
def result():
    return vedette.load(EXAMPLES / "filterpy" / "kalman.toml", overrides=[f"source.path={LINE}"]).run()


def test_a_data_set_holds_the_tracks(result):
    pytest.importorskip("xarray")
    found, (track,) = to_dataset(result), result.tracks
    np.testing.assert_array_equal(found["x"].sel(track=track.id), track.mean[:, 0])
    np.testing.assert_array_equal(found["cov"].sel(track=track.id, row="x", column="vx"), track.cov[:, 0, 1])
    np.testing.assert_allclose(found["sd_vx"].values[0] ** 2, track.cov[:, 1, 1])
    assert found["vx"].attrs["units"] == "m/s"
    assert bool(found["confirmed"].all())


def test_a_data_set_of_returns_is_tracked(result):
    xr, times = pytest.importorskip("xarray"), np.arange(40) * np.timedelta64(1, "s") + np.datetime64("2026-03-01T12:00:00")
    z = np.loadtxt(LINE, delimiter=",", skiprows=1)[:, 1]
    frame = to_frame(xr.Dataset({"z": ("t", z)}, coords={"t": times}))
    assert frame["t"][1] == "2026-03-01T12:00:01"
    (track,) = vedette.track(frame, EXAMPLES / "filterpy" / "kalman.toml").tracks
    np.testing.assert_allclose(track.mean, result.tracks[0].mean, rtol=1e-9)


def test_a_library_that_is_not_there_is_said_to_be_installed():
    with pytest.raises(InputError, match=r"this needs nowhere: pip install 'vedette\[adapters\]'"):
        needed("nowhere.at.all")
