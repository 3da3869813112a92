"""The config of a service: that of a tracker, with inputs in the place of a source, and outputs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, final

from attrs import Factory, evolve, frozen

from vedette import fields
from vedette.config import Builder, Registry, apply_overrides, load, parameters, read_file
from vedette.errors import ConfigError, Problem
from vedette.experiment import Experiment
from vedette.roles import Sensor
from vedette.streams import Format, Input, Output, Store
from vedette.supporting import ImagingSensor
from vedette.tracking import check_smoothing, raw_sensors
from vedette_files import DATED, FRAMES, Origin
from vedette_files.files_read import Inputs
from vedette_files.input_files import user_path
from vedette_live.grouping import Grouping
from vedette_live.placing import Placing, named, placed
from vedette_live.stations import Site, misplaced

FULL = ("drop", "wait")


@final
@frozen
class Feed:
    """An input, and how its bytes become scans. `sensors` names the tracker's sensor of each one in the stream, `sensor`
    that of messages that name none.
    """

    input: Input = fields.part("where bytes come from")
    format: Format = fields.part("how messages stand in them")
    scans: Grouping = fields.part("how messages become scans", default=Grouping())
    sensors: dict[str, str] = fields.names('in the stream to those of the tracker, as { "2/17" = "north" }')
    sensor: str = fields.text("the tracker's sensor of messages that name none", default="")

    def __attrs_post_init__(self) -> None:
        if not self.format.reads:
            raise ValueError(f"format: {self.format.kind!r} is written only")

    @property
    def names(self) -> dict[str, str]:
        """The tracker's sensor by its name in the stream."""
        return named(self.sensors, self.sensor)


@final
@frozen
class Sink:
    """An output, what it is sent and how often."""

    output: Output = fields.part("where bytes go")
    format: Format = fields.part("how tracks stand in them")
    every: float = fields.quantity("s", "least time between reports; 0: one after each scan", default=0.0, at_least=0)
    confirmed: bool = fields.flag("whether it tells confirmed tracks alone", default=True)
    predict: bool = fields.flag("whether tracks are predicted to the time when they are sent", default=False)
    lag: float = fields.quantity(
        "s", "by which reports are late, to be smoothed by the scans within it; 0: none is", default=0.0, at_least=0
    )

    def __attrs_post_init__(self) -> None:
        if not self.format.writes:
            raise ValueError(f"format: {self.format.kind!r} is read only")
        if self.lag and self.predict:
            raise ValueError("predict: must be false where lag > 0 s: it tells of now, and a lag of what is past")


@final
@frozen
class Conduct:
    """How the service behaves: late scans, load, what it keeps, how its state is seen.

    `full` says what happens to scans that come faster than they are taken: the oldest are dropped whole and counted, or the
    inputs wait. By default datagrams are dropped, and connections, files and pipes wait.
    """

    horizon: float = fields.quantity("s", "by which scans may be late", default=0.0, at_least=0)
    window: int = fields.integer("states kept for late scans, at most", default=1000, at_least=1, at_most=100_000)
    queue: int = fields.integer("scans that may wait", default=1000, at_least=1, at_most=10**6)
    full: str | None = fields.choice("what happens when the queue is full", FULL, default=None)
    store: Store | None = fields.part("where states and tracks are kept for a restart", default=None)
    save: float = fields.quantity("s", "between two times that the state is saved", default=5.0, above=0)
    record: str = fields.text("file that the scans taken are recorded in, as JSON lines", default="")
    port: int = fields.integer("of the health endpoint on this machine; 0: none", default=0, at_most=65535)
    page: int = fields.integer("port of the page of `vedette watch` on this machine; 0: none", default=0, at_most=65535)
    origin: Origin | None = fields.part("where x and y are 0", default=None)
    frame: str = fields.choice("where x and y point", FRAMES, default=FRAMES[0])
    sites: Mapping[str, Site] = fields.part("sensor to its latitude, longitude and altitude", default=Factory(dict))


@final
@frozen
class Parts:
    """What a served config says beside its tracker."""

    inputs: tuple[Feed, ...] = fields.part("where scans come from")
    outputs: tuple[Sink, ...] = fields.part("where tracks go", default=())
    service: Conduct = fields.part("how it behaves", default=Factory(Conduct))

    def __attrs_post_init__(self) -> None:
        if not self.inputs:
            raise ValueError("inputs: must hold at least one")


@final
@frozen(eq=False)
class Service:
    """A tracker with its seed and title, and what is served of it."""

    experiment: Experiment
    parts: Parts

    @property
    def notes(self) -> dict[str, str]:
        """What x, y and times mean, as a recording's notes say it."""
        notes = placed(self.parts.service.origin, self.parts.service.frame)
        return notes | ({"time": DATED} if all(feed.scans.clock != "sensor" for feed in self.parts.inputs) else {})


APART = ("inputs", "outputs", "service")


def load_service(config: Mapping[str, Any] | str | Path, overrides: Iterable[str] = ()) -> Service:
    """Return the service that a config describes; ConfigError with every problem and its path."""
    given: Any = read_file(config) if isinstance(config, str | Path) else config
    registry = Registry.installed()
    given = apply_overrides(given, overrides, registry)
    problems = list[Problem]()
    if "source" in given:
        told = "a served config has inputs in its place: leave one of the two out"
        problems.append(Problem("source", told if "inputs" in given else "vedette serve takes no source; name [[inputs]]"))
    rest = {name: value for name, value in given.items() if name not in (*APART, "source")}
    experiment: Any = None
    try:
        experiment = load(rest, registry)
    except ConfigError as error:
        problems += error.problems
    builder = Builder(registry)
    tables = {name: given[name] for name in APART if name in given}
    made = builder.construct(Parts, parameters(Parts), tables, "", set())
    problems += builder.problems
    if isinstance(made, Parts) and experiment is not None:
        problems += [*_not_served(experiment, made.service), *_unknown_sensors(made, experiment)]
        problems += _not_smoothed(experiment, made.outputs)
        problems += _unheard(made, experiment)
        problems += _files(made, Path(config) if isinstance(config, str | Path) else "")
    if problems or not isinstance(made, Parts):
        raise ConfigError(problems)
    return Service(experiment, made)


def _not_served(experiment: Experiment, conduct: Conduct) -> list[Problem]:
    """Return what a service cannot do."""
    wrong = misplaced(conduct.sites, _streamed(experiment), conduct.origin)
    problems = [evolve(problem, place=f"service.{problem.place}") for problem in wrong]
    if experiment.retroactive:
        problems.append(Problem("retroactive", "must be false in a service: its tracks are told as they are known"))
    for name, preprocessor in experiment.preprocessors.items():
        if len(preprocessor.sensors) > 1 and not conduct.horizon:
            told = "takes scans of several sensors together, and they come one by one: service.horizon must be > 0 s"
            problems.append(Problem(f"preprocessors.{name}", told))
    for name, sensor in _streamed(experiment).items():
        if isinstance(sensor, ImagingSensor):
            problems.append(Problem(f"sensors.{name}", "is a camera, and no format of a stream brings frames"))
    if conduct.store is not None:
        try:
            experiment.tracker.start(time=0.0).to_data()
        except TypeError as error:
            problems.append(Problem("service.store", f"cannot keep the state of this tracker: {error}"))
    return problems


def _not_smoothed(experiment: Experiment, outputs: Iterable[Sink]) -> list[Problem]:
    """Return why outputs cannot be smoothed."""
    late = [i for i, sink in enumerate(outputs) if sink.lag]
    try:
        if late:
            check_smoothing(experiment.tracker)
    except ConfigError as error:
        return [Problem(f"outputs[{late[0]}].lag", problem.text) for problem in error.problems]
    return []


def _files(parts: Parts, config: Any) -> list[Problem]:
    """Return which files would be written that are read, or by two parts."""
    read = Inputs.of([getattr(feed.input, "path", "") for feed in parts.inputs], config)
    written = {f"outputs[{i}].output.path": getattr(sink.output, "path", "") for i, sink in enumerate(parts.outputs)}
    written |= {"service.store.path": getattr(parts.service.store, "path", ""), "service.record": parts.service.record}
    problems, known = list[Problem](), dict[Path, str]()
    for place, text in written.items():
        if not text:
            continue
        path = user_path(text).absolute()
        try:
            read.check(path, place)
        except ConfigError as error:
            problems += error.problems
        if (other := known.setdefault(path, place)) != place:
            problems.append(Problem(place, f"{text!r} is written by {other} too: name another file"))
    return problems


def _streamed(experiment: Experiment) -> dict[str, Sensor]:
    """Return the sensors whose scans come by the inputs."""
    return raw_sensors(experiment.preprocessors, experiment.tracker.sensors)


def _unheard(parts: Parts, experiment: Experiment) -> list[Problem]:
    """Return why no message of an input could be used, by what comes of the sample of its format."""
    problems = []
    for i, feed in enumerate(parts.inputs):
        memory = feed.format.start()
        decoded = feed.format.decode(memory, feed.format.sample())
        if decoded.refused and not decoded.messages:
            problems.append(Problem(f"inputs[{i}].format", decoded.refused[0]))
        if {message.sensor for message in decoded.messages} == {""}:
            try:
                Placing(_streamed(experiment), feed.names, None).sensor("")
            except ValueError as error:
                problems.append(Problem(f"inputs[{i}]", str(error)))
    return problems


def _unknown_sensors(parts: Parts, experiment: Experiment) -> list[Problem]:
    sensors = _streamed(experiment)
    known = ", ".join(map(repr, sensors))
    return [
        Problem(f"inputs[{i}].{f'sensors.{stated}' if stated else 'sensor'}", f"must be one of {known}, got {name!r}")
        for i, feed in enumerate(parts.inputs)
        for stated, name in feed.names.items()
        if name not in sensors
    ]
