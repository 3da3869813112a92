"""Parameters found from detections: `vedette.tune`."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from pathlib import Path
from typing import Any, get_args

import numpy as np
from attrs import field, frozen

from vedette import Array, ConfigError, Registry, load, to_config
from vedette.config import apply_overrides, below, read_file, with_birth
from vedette_files.files_read import contents
from vedette_report.detector_errors.in_tracks import Told
from vedette_study.plan import whole as whole_number
from vedette_study.store import made_by
from vedette_tools.tuning.checkpoint import Kept
from vedette_tools.tuning.errors import Curvature
from vedette_tools.tuning.evaluation import check, errors_in_time, open_data
from vedette_tools.tuning.evaluator import Asker, Criterion, asker
from vedette_tools.tuning.parameters import Free, applied, changes, read_free
from vedette_tools.tuning.profile import Curve, settled
from vedette_tools.tuning.search import METHODS, ended_there
from vedette_tools.tuning.unthresholded import kept_thresholds
from vedette_tools.tuning.validation import Judged, judge


@frozen(eq=False)
class Found:
    """What came of one parameter: its value before and after, its standard error, the range of 95 %, None if not known.

    `told` says what stands against the value: that it is at the end of its range, that the data do not tell it; or "".
    """

    free: Free
    before: float | None
    after: float
    error: float | None
    interval: tuple[float, float] | None
    told: str
    curve: Curve | None = field(default=None, repr=False)

    def data(self) -> dict[str, Any]:
        """Return the figures as plain data."""
        return {
            "path": self.free.path, "unit": self.free.place.unit, "low": self.free.low, "high": self.free.high,
            "before": self.before, "after": self.after, "error": self.error, "interval": self.interval, "told": self.told,
        }  # fmt: skip


@frozen(eq=False)
class Tuned:
    """The result of a tuning; `config` is the whole config with the tuned values in it, `own` the one before.

    `ends` counts the searches that ended at the best point, of `starts`; `onward`: how often the search went on from
    a higher point that was met while the errors were found; `jumps`: by how much the criterion jumps about it.
    `errors`: how sensors' errors go on from scan to scan. `odd`: what looks wrong with the input; `kept`: which thresholds
    of the tracker the likelihood depends on, "" on none.
    """

    title: str
    by: Criterion
    parameters: tuple[Found, ...]
    blurred: tuple[str, ...]
    judged: Judged
    correlation: Array
    starts: int
    ends: int
    onward: int
    jumps: float
    evaluations: int
    resumed: int
    config: dict[str, Any] = field(repr=False)
    own: dict[str, Any] = field(repr=False)
    written: dict[str, Any] = field(repr=False)
    odd: tuple[str, ...] = ()
    kept: str = ""
    errors: tuple[Told, ...] = ()

    @property
    def values(self) -> dict[str, float]:
        """Config path to tuned value."""
        return {parameter.free.path: parameter.after for parameter in self.parameters}


def tune(
    config: Mapping[str, Any] | str | Path,
    free: Sequence[str],
    *,
    overrides: Sequence[str] = (),
    by: Criterion = "likelihood",
    part: float = 0.5,
    starts: int = 3,
    method: str = "nelder-mead",
    workers: int = 1,
    out: str | Path | None = None,
    resume: bool = False,
    write: Callable[[Tuned], None] | None = None,
) -> Tuned:
    """Find the values of the `free` parameters that fit a config's recording best, and how well they are known.

    `free` holds `path.to.key=low..high`, or a path alone for ten times less to ten times more. The first `part` of the scans
    is tuned on, the rest judges. `by` is "likelihood", of every scan before it is seen, or "consistency", of innovations,
    hits and false returns with what the tracker expects. `starts` searches begin at the config's values and at the best of
    points spread evenly. `workers` processes share the work, and change nothing in the result. With `out`, a folder,
    evaluations are kept until the end, and until `write` has written the result, and `resume` goes on with them. ConfigError
    reports all that is wrong.
    """
    given: Any = read_file(config) if isinstance(config, str | Path) else config
    experiment = load(given, overrides=overrides)
    parameters = read_free(experiment, free)
    _check_options(by, starts, method, workers)
    if resume and out is None:
        raise ConfigError.at("--resume", "needs the folder of the tuning that it is to go on with: --out")
    data, used = open_data(experiment, part), to_config(experiment)
    about = {} if out is None else {
        "config": hashlib.sha256(json.dumps(used, sort_keys=True).encode()).hexdigest()[:16],
        "free": [f"{parameter.path}={parameter.low!r}..{parameter.high!r}" for parameter in parameters],
        "by": by, "part": part, "data": contents(used), **made_by(),
    }  # fmt: skip
    kept = Kept(None if out is None else Path(out), about, resume=resume)
    first = np.array([float(parameter.position(parameter.start)) for parameter in parameters])
    with asker(data, parameters, by, kept, workers, part) as asked:
        if not np.isfinite(asked.height(first)):
            check(data, parameters, asked.values(first))
        settling = settled(asked, first, starts, method)
        known = settling.known
        results = tuple(_found(asked, known, curve, i) for i, curve in enumerate(settling.curves))
        evaluations, data = asked.evaluations, asked.data
    values = [parameter.after for parameter in results]
    thresholds = kept_thresholds(experiment.tracker, [each.place.path for each in parameters])
    check(data, parameters, values)
    own = with_birth(apply_overrides(given, overrides), given, Registry.installed())
    with np.errstate(invalid="ignore"):
        correlation = known.cov / np.outer(known.error, known.error)
    result = Tuned(
        experiment.title, by, results, _blurred(known, parameters),
        judge(data, parameters, values, known.cov), correlation, starts,
        ended_there(settling.ends, known.position),
        settling.onward, known.jumps, evaluations, kept.resumed, to_config(applied(experiment, parameters, values)),
        own, {reduce(below, path, ""): value for path, value in changes(experiment, parameters, values).items()},
        data.odd, thresholds if by == "likelihood" else "", errors_in_time(data, parameters, values),
    )  # fmt: skip
    if write is not None:
        write(result)
    kept.forget()
    return result


def _check_options(by: str, starts: int, method: str, workers: int) -> None:
    """Raise ConfigError, with its option, for what no search can be made by."""
    if method not in METHODS:
        raise ConfigError.at("--method", f"must be one of {', '.join(METHODS)}, got {method!r}")
    if by not in get_args(Criterion):
        raise ConfigError.at("--by", f"must be 'likelihood' or 'consistency', got {by!r}")
    whole_number("--starts", starts, 1, 100)
    whole_number("--workers", workers, 1, 4096)


def _found(asked: Asker, known: Curvature, curve: Curve, i: int) -> Found:
    """Return what came of one parameter."""
    free, top = asked.free[i], known.position
    value, error = float(f"{asked.values(top)[i]:.4g}"), float(known.error[i])
    if i in known.edge:
        end = "lower" if top[i] < 0.5 else "upper"
        return Found(free, free.place.value, value, None, None, f"at the {end} end of its range", curve)
    if not np.isfinite(error) or error <= 0:
        return Found(free, free.place.value, value, None, None, "not told by the data", curve)
    low, high = (float(free.value(np.asarray(top[i] + sign * 1.96 * error))) for sign in (-1.0, 1.0))
    return Found(free, free.place.value, value, float(free.slope(float(top[i]))) * error, (low, high), "", curve)


def _blurred(known: Curvature, free: Sequence[Free]) -> tuple[str, ...]:
    """Say which parameters, or combinations of them, the data do not tell."""
    told = []
    for direction in known.blurred:
        paths = [parameter.path for parameter, share in zip(free, direction, strict=True) if abs(share) > 0.3]
        told.append(paths[0] if len(paths) == 1 else f"{' and '.join(paths)} apart from one another")
    return tuple(told)
