"""The detection probability by range and bearing, found from the tracks of a recording: `vedette.tune_detection`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from attrs import evolve, field, frozen

from vedette import Array, ConfigError, Experiment, Registry, load
from vedette.config import apply_overrides, path_of, read_file, with_birth
from vedette_standard import Detection, PlacedSensor
from vedette_study.plan import whole
from vedette_tools.tuning.cells import Cells
from vedette_tools.tuning.config_paths import at, changed
from vedette_tools.tuning.evaluation import Data, Evaluated, evaluate, judging, open_data, settled
from vedette_tools.tuning.trials import Trials, trials
from vedette_tools.tuning.validation import Gain, gain

FOLDS = 5
"""Stretches of the recording, each of which is foretold from the others to see how far cells differ."""
ROUNDS = 30
"""The tracker runs so often at most, each time with the probabilities that the last run showed."""
SETTLED = 1e-3
"""Probabilities are settled if none changes by more."""
ROWS, COLUMNS = 4, 8
"""Cells, if nothing is said."""


@frozen(eq=False)
class ByPlace:
    """What came of it: the sensor's path, its table, errors and trials (rows, columns), and `level`, one number for all.

    `before`: the config's own detection probability; `scans`: how many it was found from, and all. `on` and `held`: what the
    table gains in log-likelihood over `level`, there and on the others; `level_held`: what `level` gains over the config.
    `own` is the whole config without the table, `odd` what looks wrong with the input.
    """

    title: str
    path: str
    table: Detection
    error: Array
    trials: Array
    before: float
    level: float
    scans: tuple[int, int]
    on: Gain | None
    held: Gain | None
    level_held: Gain | None
    rounds: int
    own: dict[str, Any] = field(repr=False)
    odd: tuple[str, ...] = ()

    @property
    def advice(self) -> str:
        """What the scans held back advise: "take" the table if it gains more than the error, or "keep" one number."""
        varies = bool(np.ptp(self.table.probability) > 0)
        return "take" if varies and (self.held is None or self.held.difference > self.held.error) else "keep"

    @property
    def written(self) -> dict[str, Any]:
        """Config path to plain value, of the table or of the one number."""
        if self.advice == "keep":
            return {f"{self.path}.detection_probability": self.level}
        table = {name: getattr(self.table, name).tolist() for name in ("probability", "ranges", "bearings")}
        return {f"{self.path}.detection_probability": 1.0, f"{self.path}.detection": table}


def tune_detection(
    config: Mapping[str, Any] | str | Path,
    sensor: str,
    *,
    rows: int = ROWS,
    columns: int = COLUMNS,
    part: float = 0.5,
    overrides: Sequence[str] = (),
) -> ByPlace:
    """Find a sensor's detection probability by range and bearing from the first `part` of a config's recording.

    `sensor` is a config path, as sensors.radar or sensors.radar.of. `rows` part the ranges, with as many trials in each,
    `columns` the circle; cells are one where stretches of the recording foretell one another better so. A sensor that has
    a table keeps its cells. Expectation and maximisation: a tracker without thresholds says where targets were and whether
    they were detected, given all scans; the table follows; the tracker runs again. ConfigError reports all that is wrong.
    """
    given: Any = read_file(config) if isinstance(config, str | Path) else config
    experiment = load(given, overrides=overrides)
    whole("--detection", rows, 1, 1000)
    whole("--detection", columns, 1, 1000)
    radar = _placed(experiment, sensor)
    own = with_birth(apply_overrides(given, overrides), given, Registry.installed())
    data = settled(open_data(experiment, part), [], [])
    before, met = evaluate(data, [], [], whole=True), _met(data, sensor)
    if not len(met.there):
        raise ConfigError.at("source", f"has no scan in which a track meets {sensor}: nothing tells what it detects")
    level, _, _ = _found(data, sensor, _one(radar.detection_probability))
    table, error, rounds = _found(data, sensor, _grid(radar, met, rows, columns))
    counts = _counts(_of(data, sensor, table), sensor, table)[0].sum(axis=0)
    one, after = (evaluate(_of(data, sensor, each), [], [], whole=True) for each in (level, table))
    first, last = slice(0, data.tuned), slice(data.tuned, len(data.times))
    return ByPlace(
        experiment.title, sensor, table, error, counts, radar.detection_probability,
        float(f"{level.probability[0, 0]:.3g}"), (data.tuned, len(data.times)), _gain(one, after, first),
        _gain(one, after, last), _gain(before, one, last), rounds, own, data.odd,
    )  # fmt: skip


def _placed(experiment: Experiment, path: str) -> PlacedSensor:
    """Return the sensor at a path."""
    try:
        value = at(experiment, path)
        if path_of(path)[0] != "sensors" or not isinstance(value, PlacedSensor):
            raise ValueError("must be a sensor with a place, as sensors.radar, or sensors.radar.of where it is wrapped")
    except ValueError as error:
        raise ConfigError.at(f"--detection {path}", str(error)) from None
    return value


def _one(probability: float) -> Detection:
    return Detection(np.full((1, 1), probability))


def _grid(radar: PlacedSensor, met: Trials, rows: int, columns: int) -> Detection:
    """Return the cells: those of the sensor's own table, or ranges with as many trials in each, by equal angles."""
    if (table := radar.detection) is not None:
        return evolve(table, probability=radar.detection_probability * table.probability)
    order = np.argsort(met.distance)
    share = np.cumsum(met.there[order]) / np.sum(met.there)
    inner = met.distance[order][np.searchsorted(share, np.arange(1, rows) / rows).clip(max=len(order) - 1)]
    ranges = np.unique([0.0, *(float(f"{each:.3g}") for each in inner)])
    bearings = 2.0 * np.pi * np.arange(columns) / columns
    return Detection(np.full((len(ranges), columns), radar.detection_probability), ranges, bearings)


def _found(data: Data, path: str, table: Detection) -> tuple[Detection, Array, int]:
    """Return the table that the tracks of a tracker with this table show, its errors, and after how many runs.

    Cells that are one are so in the end, too: the table has a row or column less for each that it does not need.
    """
    rounds, change = 0, np.inf
    while rounds == 0 or (change > SETTLED and rounds < ROUNDS):
        cells = Cells.of(*_counts(_of(data, path, table), path, table))
        probability = np.array(np.broadcast_to(cells.probability, table.probability.shape))
        change, rounds = float(np.max(np.abs(probability - table.probability))), rounds + 1
        table = evolve(table, probability=probability)
    kept = [each if cells.probability.shape[i] > 1 else each[:1] for i, each in enumerate((table.ranges, table.bearings))]
    told = np.array([[float(f"{each:.3g}") for each in row] for row in cells.probability])
    if not np.ptp(told):
        return Detection(told[:1, :1]), cells.error[:1, :1], rounds
    return Detection(told, *kept), cells.error, rounds


def _counts(data: Data, path: str, table: Detection) -> Array:
    return _met(data, path).counts(table, FOLDS, data.tuned)


def _met(data: Data, path: str) -> Trials:
    """Return what tracks met in the part that is tuned on."""
    judged = judging(data, [], [])
    ran = islice(data.run(judged), data.tuned)
    return trials(judged.tracker, str(path_of(path)[1]), _placed(data.experiment, path), ran)


def _of(data: Data, path: str, table: Detection) -> Data:
    """Return the data of a tracker whose sensor has this table."""
    inner = evolve(_placed(data.experiment, path), detection_probability=1.0, detection=table)
    return evolve(data, experiment=changed(data.experiment, path_of(path), inner))


def _gain(before: Evaluated | None, after: Evaluated | None, scans: slice) -> Gain | None:
    return None if after is None or scans.start == scans.stop else gain(before, after, scans, 0.0)
