"""Tracks as a data set of xarray, and data sets as tables to be tracked."""

from __future__ import annotations

from typing import Any

import numpy as np

from vedette import InputError, Result
from vedette_adapters.libraries import needed


def to_dataset(result: Result) -> Any:
    """Return the tracks of a run as a data set over `track` and `time`, NaN where a track does not live.

    Each axis of the state is a variable with its unit, and so are its standard deviation `sd_`.., existence and confirmed;
    `cov` is over the axes `row` and `column` too.
    """
    xr = needed("xarray")
    if not result.tracks:
        raise InputError("the run has no tracks")
    space = result.tracks[0].space
    times = np.unique(np.concatenate([track.times for track in result.tracks]))
    shape, n = (len(result.tracks), len(times)), len(space)
    mean, cov = np.full((*shape, n), np.nan), np.full((*shape, n, n), np.nan)
    existence, confirmed = np.full(shape, np.nan), np.zeros(shape, dtype=bool)
    for i, track in enumerate(result.tracks):
        where = np.searchsorted(times, track.times)  # of several scans at one time, the last
        mean[i, where], cov[i, where] = track.mean, track.cov
        existence[i, where], confirmed[i, where] = track.existence, track.confirmed
    variables = {axis.name: (("track", "time"), mean[..., j], {"units": axis.unit}) for j, axis in enumerate(space.axes)} | {
        f"sd_{axis.name}": (("track", "time"), np.sqrt(cov[..., j, j]), {"units": axis.unit})
        for j, axis in enumerate(space.axes)
    }
    return xr.Dataset(
        {
            **variables,
            "cov": (("track", "time", "row", "column"), cov),
            "existence": (("track", "time"), existence),
            "confirmed": (("track", "time"), confirmed),
        },
        coords={
            "track": [track.id for track in result.tracks],
            "time": ("time", times, {"units": "s"}),
            "row": list(space.names),
            "column": list(space.names),
        },
    )


def to_frame(dataset: Any) -> Any:
    """Return a data set, such as returns over `time`, as the data frame that `vedette.track` takes: a row for each entry.

    Entries whose numbers are all missing are left out. Dates become ISO times.
    """
    pd = needed("pandas")
    frame = dataset.to_dataframe().dropna(how="all").reset_index()
    for name in frame.columns:
        if pd.api.types.is_datetime64_any_dtype(frame[name]):
            frame[name] = frame[name].map(lambda time: time.isoformat())
    return frame
