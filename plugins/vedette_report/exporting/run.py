"""What an export takes from the files of a run."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, final

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from vedette import Array, ConfigError, Space, Track
from vedette_files import Origin, Terms, Wanted, read_about, read_kept, tracks_of_run, utc

CHI_SQUARE_95 = -2.0 * np.log(0.05)
"""Squared distance that holds 95 % of a Gaussian in the plane."""

OUTLINE = 36
"""Points of an ellipse."""


@final
@frozen(eq=False)
class Run:
    """A run's tracks from where each was first confirmed on, what is the same in all of it, and what x, y and times mean.

    `epoch`: s by which the tracks' times are later than the recording's, to be s since 1970 in UTC.
    """

    folder: Path
    about: dict[str, Any]
    tracks: tuple[Track, ...]
    space: Space
    terms: Terms
    epoch: float = 0.0

    @classmethod
    def read(cls, folder: Path, origin: Origin | None, epoch: float | None, *, smoothed: bool = False) -> Run:
        """Read a folder; `origin` and `epoch` are of those who know better than the recording."""
        series, lines = ("smoothed.npz", "smoothed.jsonl") if smoothed else ("series.npz", "tracks.jsonl")
        tracks = tracks_of_run(folder / series, folder / lines)
        return cls._of(folder, read_about(folder / "series.npz"), tracks, origin, epoch)

    @classmethod
    def kept(cls, path: Path, part: Wanted, origin: Origin | None, epoch: float | None) -> Run:
        """Read the tracks of a service from its database, those of a time and a place."""
        kept = read_kept(path, part)
        axes = {axis.name: axis.unit for axis in kept.space.axes}
        about = {"title": "", "axes": axes, "notes": kept.notes, "objects": [], "told": kept.told}
        return cls._of(path, about, kept.tracks, origin, epoch)

    @classmethod
    def _of(
        cls, folder: Path, about: dict[str, Any], tracks: Sequence[Track], origin: Origin | None, epoch: float | None
    ) -> Run:
        terms = Terms.of(about["notes"], tracks)
        if origin is not None:
            terms = evolve(terms, origin=origin)
        if epoch is not None:
            if terms.dated:
                raise ConfigError.at("--epoch", "is for times without a date, and those of this recording have one")
            terms = evolve(terms, dated=True)
        whole = [_confirmed(track) for track in tracks if track.confirmed.any()]
        kept = tuple(evolve(track, times=track.times + (epoch or 0.0)) for track in whole if len(track.times))
        return cls(folder, about, kept, Space.of(**dict(about["axes"])), terms, 0.0 if epoch is None else epoch)

    @property
    def title(self) -> str:
        """What the run is called."""
        return self.about["title"] or self.folder.resolve().name

    def check_placed(self, what: str) -> None:
        """Raise ConfigError if the tracks cannot be put on the earth, for a format, `what`, that needs it."""
        units = dict(self.about["axes"])
        if (units.get("x"), units.get("y")) != ("m", "m"):
            got = ", ".join(f"{name} [{unit}]" for name, unit in units.items())
            told = f"{what} needs latitudes and longitudes, made of x and y in m, and these tracks have {got}"
            raise ConfigError.at("--to", f"{told}: export to .csv, .parquet or .rrd")
        if self.terms.origin is None:
            told = f"{what} needs latitudes and longitudes, and the recording does not say where on the earth x and y are 0"
            raise ConfigError.at("--to", f"{told}: give --origin LAT,LON, or export to .csv, .parquet or .rrd")

    def places(self, track: Track) -> Array:
        """Return longitudes, latitudes and, where the tracks have z, altitudes (s, 2 or 3) of a track in deg and m."""
        columns = evolve(self.terms, dated=False).values(track)
        return np.stack([columns[name] for name in ("longitude", "latitude", "altitude") if name in columns], axis=-1)

    def dates(self, track: Track) -> list[str]:
        """Return the times of a track by ISO 8601 in UTC."""
        return [utc(time) for time in track.times.tolist()]

    def axes(self, track: Track) -> Array:
        """Return of each 95 % ellipse (s, 3) half its long and its short axis in m, and where the long one points.

        That is a bearing in deg clockwise from north, 0 to 180.
        """
        values, vectors = np.linalg.eigh(self._ground(track))
        long = vectors[..., :, 1]
        bearing = np.degrees(np.arctan2(long[:, 0], long[:, 1])) % 180.0
        half = np.sqrt(CHI_SQUARE_95 * np.maximum(values, 0.0))
        return np.stack([half[:, 1], half[:, 0], bearing], axis=-1)

    def ellipse(self, track: Track, i: int) -> Array | None:
        """Return longitudes and latitudes (k, 2) in deg of the 95 % ellipse at a track's scan, counterclockwise and closed.

        None where it is not known, or lies across 180 deg, where it would be drawn around the earth.
        """
        values, vectors = np.linalg.eigh(self._ground(track)[i])
        angles = np.append(np.arange(OUTLINE), 0) * 2 * np.pi / OUTLINE
        unit = np.stack([np.cos(angles), np.sin(angles)])
        sense = np.sign(np.linalg.det(vectors))
        unit[1] *= sense  # eigenvectors may be a mirror image
        spots = (vectors * np.sqrt(CHI_SQUARE_95 * np.maximum(values, 0.0))) @ unit
        at = dict(zip(track.space.names, track.mean[i], strict=True))
        east, north = self.terms.ground
        if self.terms.origin is None:
            return None
        latitude, longitude, _ = self.terms.origin.from_plane(at[east] + spots[0], at[north] + spots[1], None)
        outline = np.stack([longitude, latitude], axis=-1)
        return None if not np.isfinite(outline).all() or np.ptp(longitude) > 180.0 else outline

    def _ground(self, track: Track) -> Array:
        """Return the covariances (s, 2, 2) of a track's place, east first."""
        where = [track.space.names.index(name) for name in self.terms.ground]
        cov: Array = track.cov[:, where][:, :, where]
        return np.where(np.isfinite(cov).all(axis=(1, 2), keepdims=True), cov, 0.0)


def _confirmed(track: Track) -> Track:
    """Return a track from where it was first confirmed on, without what is not finite."""
    kept = np.maximum.accumulate(track.confirmed) & np.isfinite(track.mean).all(axis=-1)
    rows = ("times", "mean", "cov", "confirmed", "existence", "nis", "hit", "mode_prob", "confirmed_at", "link", "identity")
    columns = {name: values[kept] for name in rows if (values := getattr(track, name)) is not None}
    chosen = np.flatnonzero(kept).tolist()
    returns = None if track.returns is None else tuple(track.returns[i] for i in chosen)
    return evolve(track, weights=tuple(track.weights[i] for i in chosen), returns=returns, **columns)


def chosen(count: int, most: int) -> NDArray[np.intp]:
    """Return at most so many of `count` places, evenly, the last one among them."""
    if not count or not most:
        return np.zeros(0, dtype=np.intp)
    return np.unique(np.round(np.linspace(count - 1, 0, min(count, most))).astype(np.intp))


def read_epoch(text: str) -> float:
    """Return s since 1970 in UTC of a date by ISO 8601; ValueError says what is wrong. Without a zone it is UTC."""
    try:
        date = datetime.fromisoformat(text)
    except ValueError:
        raise ValueError(f"must be a date and a time by ISO 8601, as in 2024-05-01T12:00:00Z, got {text!r}") from None
    return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()
