"""From a table to its tracks in one call."""

from __future__ import annotations

import tomllib
import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, ClassVar, final

import numpy as np
from attrs import evolve, field, frozen
from attrs.validators import instance_of

from vedette.config import load
from vedette.errors import ConfigError
from vedette.experiment import Experiment, Result
from vedette.roles import Sensor
from vedette.supporting import Source
from vedette.types import Recording
from vedette_files import CsvSource
from vedette_files.tables.columnar import FrameTable, frame_of
from vedette_tools.drafting.config import drafted


@final
@frozen(eq=False)
class FrameSource(Source):
    """A data frame of pandas, read as a `csv` source reads its file. It is given in Python: no config can name it."""

    kind: ClassVar[str] = "data_frame"
    draws: ClassVar[bool] = False

    of: CsvSource = field(validator=instance_of(CsvSource))
    frame: Any = field(repr=False)

    def open(self, sensors: Mapping[str, Sensor], rng: np.random.Generator) -> Recording:
        """Return all scans of the data frame."""
        return self.of.open_frame(self.frame, sensors)


def track(
    data: Any, config: Mapping[str, Any] | str | Path | None = None, overrides: Iterable[str] = (), *, strict: bool = False
) -> Result:
    """Track the targets of a file, of a data frame of pandas, or of columns or rows by name; a row is a return.

    >>> result = vedette.track("plots.csv")                                  # doctest: +SKIP
    >>> result.to_dataframe(), result.plot()                                 # doctest: +SKIP

    `config` describes tracker and source as any config does, and its source may leave out the path; without one it is
    drafted, as `vedette new config` does, and a RuntimeWarning says why if nothing fits. `overrides` change it as `--set`
    does. With `strict`, a scan or a return that cannot be taken raises ScanRefused instead of being left out.
    """
    if isinstance(overrides, str):
        raise ConfigError.at("overrides", f"must be a list of 'path.to.key=value', got the text {overrides!r}")
    in_memory = not isinstance(data, str | Path)
    data = frame_of(data) if in_memory else data
    table = FrameTable(data) if in_memory else Path(data)
    if config is None:
        draft = drafted(table)
        if draft.failure:
            warnings.warn(draft.failure, RuntimeWarning, stacklevel=2)
        config = tomllib.loads(draft.text)
    experiment = load(config, overrides=overrides)
    return _over(experiment, data, in_memory).run(strict=strict)


def _over(experiment: Experiment, data: Any, in_memory: bool) -> Experiment:
    """Return the experiment with its source on other data."""
    source = experiment.source
    if in_memory:
        if not isinstance(source, CsvSource):
            kind = "none" if source is None else repr(source.kind)
            raise ConfigError.at("source.kind", f"must be 'csv', which says what a data frame's columns are, got {kind}")
        return evolve(experiment, source=FrameSource(source, data))
    if source is None or not hasattr(source, "path"):
        raise ConfigError.at("source", "must be of a kind with a path, such as 'csv', to be run on a file")
    return evolve(experiment, source=evolve(source, path=str(data)))  # type: ignore[misc]  # any such source is an attrs value
