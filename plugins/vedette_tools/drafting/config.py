"""A config for a table of detections: columns and units by its header, noise and rates by its rows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from math import log, sqrt
from time import process_time
from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette.config import load
from vedette.errors import InputError
from vedette.experiment import Experiment
from vedette.progress import Progress, silent
from vedette.space import Array, Indices
from vedette.types import Recording, Scan
from vedette_files import NORTH_EAST, CsvSource
from vedette_files.columnar import TablePath
from vedette_report.error_in_time import Compared, Path, compared
from vedette_tools.drafting.cadence import left_out_period
from vedette_tools.drafting.chains import LEAST, Chain, chains, spacing, unbroken
from vedette_tools.drafting.height_and_rate import UNSURE, VELOCITY, own_share, recedes, third_noise
from vedette_tools.drafting.noise import Noise, Windows, estimated, loglik, plausible
from vedette_tools.drafting.proof import BUDGET, LESS, proved
from vedette_tools.drafting.reports import in_turn, of_owners
from vedette_tools.drafting.several import FLAT, stand
from vedette_tools.drafting.table import AID, NO_WISHES, Table, read_table
from vedette_tools.drafting.text import WIDE, Design, Facts, written
from vedette_tools.drafting.titles import meaning
from vedette_tools.drafting.trial import tried
from vedette_tools.drafting.wishes import Wishes

UNREAD = 0.5
"""A table of which more rows cannot be read is not the one that its header says."""

MOST_SCANS = 1500
"""So many scans of a sensor tell its noise."""

SURE = 10.0
"""Another reading must be likelier by this, in logarithms, than the one that the titles suggest."""

JUMP = 3.5
"""A second difference of so many usual ones is taken as a jump to another target: noise alone makes one in 5,000."""

ALL = 0.5
"""Targets that give returns in fewer of the scans than this report in turn."""

SELDOM = 0.1
"""Some targets report so many times as often as those do that report seldom among the first. By hand, on AIS."""

TOGETHER, MOST_REPORTS = 3.0, 6000
"""Where more returns come at a time, they are a look at all targets; of what objects report, so many are followed."""

REPORTED = 5.0
"""m: the deviation along an axis that satellites leave in positions which objects report of themselves; a jitter of their
times, which would look like a larger one, is taken for motion. Chosen by hand, seen on one recording of aircraft."""

NOISELESS = 0.1
"""Velocities are told by returns of which the errors make less than this part of their mean square."""

TRUE = 0.999
"""The part of the positions that objects report of themselves which are of an object: nothing else sends any. By hand,
chosen on the ships with odd numbers of one recording, in the order of their names.
"""

HELD_RUNS, HELD_ROWS = 20, 3
"""So many positions, usually in so many rows each, are not measured in each row."""

ABSURD = 500.0
"""m: positions are never so wrong that a larger error explains what else has none. Chosen by hand."""

WANDERS = 30.0
"""Errors that last longer than so many scans are not told from motion. Chosen by hand."""

PROVEN = 2000
"""On so many returns a draft is tried."""

FORGETTING = 100
"""A target whose course is as good as straight is still drafted with process noise that is felt after so many scans."""

TRACKER: dict[str, Any] = {
    "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
    "associator": {"kind": "jpda"},
    "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
    "lifecycle": {"kind": "existence"},
}


@frozen(eq=False)
class Seen:
    """What one sensor's returns show: its scans' times, the positions of its returns, where it stood, the chains, and what
    else it measured.
    """

    times: Array
    spots: tuple[Array, ...]
    stands: Array
    chains: tuple[Chain, ...]
    thirds: tuple[Array, ...] = ()

    @property
    def in_turn(self) -> bool:
        """Whether a scan is a look at a few targets only."""
        looks = sum(chain.looks for chain in self.chains)
        return sum(len(chain.times) for chain in self.chains) < ALL * looks

    @property
    def rough(self) -> float:
        """The usual second difference along the chains, in m; inf without any."""
        seconds = [np.linalg.norm(np.diff(chain.spots, 2, axis=0), axis=-1) for chain in self.chains]
        return float(np.median(np.concatenate(seconds))) if seconds else np.inf

    @property
    def period(self) -> float:
        """The usual time between scans, in s, or between reports of a target; 1 for a single one."""
        if self.in_turn:
            return float(np.median(np.concatenate([np.diff(chain.times) for chain in self.chains])))
        return float(np.median(np.diff(np.unique(self.times)))) if len(self.times) > 1 else 1.0

    @property
    def least_accel(self) -> float:
        """Return the acceleration noise, m/s^2, that moves a target by the sensor's own error in `FORGETTING` scans.

        Over t s that is accel t^1.5 / sqrt(3). With less, the filter believes its prediction for ever.
        """
        return float(np.sqrt(3) * self.error / (FORGETTING * self.period) ** 1.5) if self.chains else 0.0

    @property
    def least_felt(self) -> float:
        """The acceleration noise that moves a target, over the longest chain, as far as so many returns tell its place.

        With less, the data themselves do not tell it from none; with more, targets that keep their courses are doubted.
        """
        longest = max(chain.looks for chain in self.chains)
        return self.least_accel * float((FORGETTING / longest) ** 1.5 / np.sqrt(longest))

    @property
    def error(self) -> float:
        """The error of a return along an axis, in m, by the usual second difference, whose median is 2.9 times that."""
        return self.rough / 2.9


@frozen
class Draft:
    """A commented config, as TOML, and in one sentence why it does not fit its data, "" if it does."""

    text: str
    failure: str


def draft_config(path: TablePath) -> str:
    """Return a commented config, as TOML, that tracks the targets of a CSV or Parquet file, or of a data frame."""
    return drafted(path).text


def drafted(path: TablePath, use: str = AID, wishes: Wishes = NO_WISHES, progress: Progress = silent) -> Draft:
    """Return a config that tracks the targets of a CSV or Parquet file, or of a data frame.

    use: what names of objects are to it, "aid", "truth" or "ignore"; wishes: what need not be guessed. InputError if the
    file has no header, or no column that looks like a time or a position.
    """
    begun = process_time()
    table = read_table(path, use, wishes)
    recording = _opened(table)
    if any("is out of order" in problem.text for problem in recording.refused):
        table = evolve(table, sort=True)
        recording = _opened(table)
    rows = recording.rows["detections"]
    if rows.refused > UNREAD * rows.total:
        told = f"{rows.refused} of {rows.total} rows cannot be read, the first of them"
        raise InputError(f"{table.path or path}: {told} {recording.refused[0]}")
    best = _gapless(_best(Reading.of(table, recording)))
    table = best.table if best.table.periods else table
    if table.third and (why := _useless(best)):
        table = table.without_third(why)
        best = _best(Reading.of(table, _opened(table)))
    if best.table.third == "range_rate" and _taken_out(best):
        title = best.table.measured["range_rate"]
        resting = best.table.at_rest(f"{title} is over ground: the platform's own motion is not in it")
        best = evolve(best, table=resting, recording=_opened(resting))
    best, lost = _stood(best)
    sigmas = {name: _believed(table.of(name), plausible(noise.sensor)) for name, noise in best.noise.items()}
    facts = {name: _facts(seen, sigmas[name], table.of(name).reported) for name, seen in best.seen.items()}
    accels = [best.noise[name].accel for name, seen in best.seen.items() for _ in seen.chains]
    accel, floor = float(np.median(accels)) if accels else 0.1, min(seen.least_accel for seen in best.seen.values())
    floored = max(accel, floor)
    speed, period = _speed(best.seen.values()), min(seen.period for seen in best.seen.values())
    named = bool(table.identity) and table.use == AID
    first = Design(floored, speed, found=floored, sharp=speed / sqrt(period), sure=named)
    if errors := _correlated(best):
        facts = {name: evolve(one, errors=errors) for name, one in facts.items()}
        felt = max(errors.correlated.accel, *(seen.least_felt for seen in best.seen.values()))
        first = evolve(first, accel=felt, correlated=True, gate=WIDE)

    def text(design: Design, said: Sequence[str] = ()) -> str:
        steady = accel < floor and design.accel == first.accel
        return written(best.table, facts, design, best.recording.notes, steady=steady, said=said)

    some = _some(best.recording.scans)
    steady = best.followed / max(best.returns, 1)
    vague = max(_vague(seen, facts[name].sigmas[0]) for name, seen in best.seen.items())
    proof = proved(
        first, lambda design: tried(text(design), some), steady, errors=not table.reports,
        in_turn=any(one.in_turn for one in facts.values()), lone=best.lone, vague=vague, progress=progress,
        budget=max(BUDGET - (process_time() - begun), 0.0),
    )  # fmt: skip
    ended = process_time() - begun > BUDGET
    if named and proof.trial is not None and len(facts) == 1 and not ended:
        # A name that is wrong or lacking breaks a chain, not a track: the tracks know better how often targets are detected.
        often = float(np.clip(proof.trial.detected, 0.3, 0.99))
        plain = dict(facts)
        facts = {name: one if one.in_turn else evolve(one, probability=often) for name, one in plain.items()}
        again = tried(text(proof.design), some)
        if again is None or again.share < (1 - LESS) * proof.trial.share or again.broken > 1.1 * proof.trial.broken + 0.5:
            facts = plain
    if lost := lost or best.table.unknown or _held(best):
        return Draft(text(proof.design, (lost, *proof.said)), lost)
    return Draft(text(proof.design, proof.said), proof.failure)


def _stood(best: Reading) -> tuple[Reading, str]:
    """Return the reading with the sensors where they stand, where others report positions, and what hinders that, or "".

    Ranges and bearings are around the platform. Of one that no column tells, the returns say where it stands: they lie where
    objects report to be. What reports call x and y is tried both ways where bearings run from north.
    """
    table = best.table
    if not table.others:
        return best, ""
    polar = [name for name in best.seen if name not in table.others]
    readings = [best, *map(_read, _turned(table))]
    told = [{name: it for name in polar if (it := _agreed(one, name)) is not None} for one in readings]
    best, agreed = max(zip(readings, told, strict=True), key=lambda pair: sum(share for _, share in pair[1].values()))
    flat = all(set(each) == set(FLAT) for each in table.others.values())
    if table.platform or (flat and not agreed):
        return best, ""
    if missing := [name for name in polar if name not in agreed]:
        why = f"no column tells where {' and '.join(missing)} stands, and no returns lie where objects report to be"
        return best, f"nothing fits these data: {why}; give a file of its positions: --platform FILE"
    said = [
        f"{name} stands at x = {x:.0f}, y = {y:.0f} m, for so {share:.0%} of the reports have a return"
        for name, ((x, y), share) in agreed.items()
    ]
    stands = {name: (round(float(x), 1), round(float(y), 1)) for name, ((x, y), _) in agreed.items()}
    return _read(evolve(best.table, stands=stands, assumed=(*best.table.assumed, *said))), ""


def _held(best: Reading) -> str:
    """Say that positions are repeated until the next one comes, as where rows are of another sensor; or return ""."""
    spots = (
        np.concatenate([places for seen in best.seen.values() for places in seen.spots]) if best.lone else np.zeros((0, 2))
    )
    runs = np.diff(np.flatnonzero(np.any(np.diff(spots, axis=0) != 0, axis=-1)))
    if len(runs) < HELD_RUNS or np.median(runs) < HELD_ROWS:
        return ""
    told = f"each position stands in some {np.median(runs):.0f} rows, until the next one comes"
    return f"nothing fits these data: {told}; keep the first row of each, with its own time"


def _read(table: Table) -> Reading:
    return Reading.of(table, _opened(table))


def _turned(table: Table) -> Iterator[Table]:
    """Yield the table with x and y of the reports the other way round, if bearings run from north and titles do not tell."""
    flat = {name: each for name, each in table.others.items() if set(each) == set(FLAT)}
    if flat and table.frame == NORTH_EAST and all(meaning(each["x"]).axis in FLAT for each in flat.values()):
        turned = {name: dict(zip(FLAT, (each["y"], each["x"]), strict=True)) for name, each in flat.items()}
        yield evolve(table, others={**table.others, **turned})


def _agreed(reading: Reading, name: str) -> tuple[Array, float] | None:
    """Return where a sensor's returns say that it stands, by the positions that objects report, and how many agree."""
    reports = [chain for other in reading.table.others for chain in reading.seen[other].chains]
    seen = reading.seen[name]
    width = max(
        3.0 * seen.error if seen.chains else 0.0, *(reading.seen[other].error for other in reading.table.others), 1.0
    )
    return stand(reports, seen.times, seen.spots, width) if reports and np.isfinite(width) else None


def _gapless(best: Reading) -> Reading:
    """Return the reading with the scans that the file leaves out for want of returns, if its times show such.

    The targets must still be seen: of reports that come one by one, none is a look at all targets.
    """
    counted = {name: (seen.times, [len(places) for places in seen.spots]) for name, seen in best.seen.items()}
    periods = {name: period for name, scans in counted.items() if (period := left_out_period(*scans)) is not None}
    if not periods:
        return best
    told = "gaps of whole periods are scans without returns, which the file leaves out"
    table = evolve(best.table, periods=periods, assumed=(*best.table.assumed, told))
    filled = Reading.of(table, _opened(table))
    return filled if filled.followed >= 0.95 * best.followed else best


def _useless(best: Reading) -> str:
    """Say why what is measured beside a position cannot be drafted, or return ""."""
    sensors = [seen for name, seen in best.seen.items() if name not in best.table.others]
    if not all(len(seen.chains) and np.isfinite(third_noise(seen.chains, seen.thirds)) for seen in sensors):
        return "no track was found that tells its noise"
    if best.table.third != "range_rate":
        return ""
    shares = [own_share(seen.chains, seen.thirds, seen.stands) for seen in sensors]
    moves = set(VELOCITY) & set(best.table.platform)
    if not moves and any(share > 0.5 or error > UNSURE for share, error in shares if error):
        return "it needs the velocity of the platform, which no column tells"
    if not all(recedes(seen.chains, seen.thirds, seen.stands, relative=not _taken_out(best)) for seen in sensors):
        return "it falls where ranges grow, and a range rate must rise; turn its sign and draft anew"
    return ""


def _taken_out(best: Reading) -> bool:
    """Return whether range rates are clearly without the platform's own motion."""
    rated = [seen for name, seen in best.seen.items() if name not in best.table.others]
    shares = [own_share(seen.chains, seen.thirds, seen.stands) for seen in rated]
    return all(share < 0.5 and 0 < error < UNSURE for share, error in shares)


def _opened(table: Table) -> Recording:
    experiment = _experiment(table)
    sensors, source = experiment.tracker.sensors, experiment.source
    assert isinstance(source, CsvSource)
    if table.frame_table is not None:
        return source.open_frame(table.frame_table.frame, sensors)
    return source.open(sensors, np.random.default_rng(0))


def _experiment(table: Table) -> Experiment:
    parts = dict(TRACKER)
    if table.third and not table.polar:
        motion = {"kind": "constant_velocity", "sigma_accel": 1.0, "axes": ["x", "y", "z"]}
        parts |= {
            "estimator": {"kind": "ekf", "motion": motion},
            "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0, "vz": 10.0}},
        }
    return load(parts | {"sensors": {name: _sensor(table.of(name)) for name in table.sensors}, "source": table.source()})


def _sensor(table: Table) -> dict[str, Any]:
    """Return the config of a sensor whose errors are not known yet."""
    polar: dict[str, Any] = {"sigma_range": 1.0, "sigma_bearing": 1e-3}
    polar |= dict(zip(FLAT, table.stands[table.sensors[0]], strict=True)) if table.sensors[0] in table.stands else {}
    if table.third == "range_rate":
        return {"kind": "range_bearing_rate", **polar, "sigma_rate": 1.0}
    if table.polar:
        return {"kind": "range_bearing", **polar}
    if table.third:
        return {"kind": "linear", "axes": ["x", "y", "z"], "R": np.eye(3).tolist()}
    return {"kind": "cartesian_position", "sigma": 1.0}


@frozen(eq=False)
class Reading:
    """One way to read a table: what it gives, what each sensor's returns show, and their noise."""

    table: Table
    recording: Recording
    seen: dict[str, Seen]
    noise: dict[str, Noise]

    @classmethod
    def of(cls, table: Table, recording: Recording) -> Reading:
        """Read it."""
        seen = {name: _of_targets(table.of(name), each) for name, each in _seen(table, recording).items()}
        return cls(table, recording, seen, {name: _noise(table.of(name), sensor) for name, sensor in seen.items()})

    @property
    def followed(self) -> int:
        """How many returns the chains hold."""
        return sum(len(chain.times) for seen in self.seen.values() for chain in seen.chains)

    @property
    def returns(self) -> int:
        """How many returns the sensors gave in the scans that were looked at."""
        return sum(len(places) for seen in self.seen.values() for places in seen.spots)

    @property
    def lone(self) -> bool:
        """Whether there is one return at a time."""
        return len(self.seen) == 1 and all(len(places) <= 1 for seen in self.seen.values() for places in seen.spots)

    @property
    def evidence(self) -> float:
        """How likely the returns are so."""
        return sum(noise.evidence for noise in self.noise.values())


def _best(first: Reading) -> Reading:
    """Return the reading of the platform's columns by which the returns are likeliest: targets hardly accelerate."""
    best = first
    for other in _readings(first.table):
        reading = Reading.of(other, _opened(other))
        if reading.evidence > best.evidence + SURE:
            best = reading
    return best


def _readings(table: Table) -> Iterator[Table]:
    """Yield the other ways to read a platform: bearings from north instead of the bow, x and y the other way round."""
    if not table.platform:
        return
    swapped = dict(table.platform)
    plainly = set(FLAT) <= set(swapped) and all(meaning(swapped[axis]).axis in FLAT for axis in FLAT)
    if plainly:  # else the titles say which is which: north, latitude
        for one, other in (("x", "y"), ("vx", "vy")):
            if one in swapped and other in swapped:
                swapped[one], swapped[other] = swapped[other], swapped[one]
        yield evolve(table, platform=swapped, frame=NORTH_EAST)
    if "heading" in table.platform:
        for platform in (table.platform, swapped) if plainly else (table.platform,):
            plain = {axis: title for axis, title in platform.items() if axis != "heading"}
            frame = table.frame if platform is table.platform else NORTH_EAST
            yield evolve(table, platform=plain, frame=frame, left_out=(*table.left_out, table.platform["heading"]))


def _seen(table: Table, recording: Recording) -> dict[str, Seen]:
    sensors = _experiment(table).tracker.sensors
    by_sensor = {}
    for name, sensor in sensors.items():
        scans = [scan for scan in recording.scans if scan.sensor == name][:MOST_SCANS]

        def spots(scan: Scan) -> Array:
            placed = sensor if scan.pose is None else sensor.at(scan.pose)  # noqa: B023
            return placed.invert(scan.detections.z).mean[..., :2]

        if scans:
            codes = [scan.detections.identity for scan in scans if scan.detections.identity is not None]
            place = np.array(table.stands.get(name, (0.0, 0.0)))
            stands = np.array([place if scan.pose is None else scan.pose.position[:2] for scan in scans])
            times, places = np.array([scan.time for scan in scans]), tuple(map(spots, scans))
            named = np.concatenate(codes) if codes else None
            followed = _followed(times, places, stands, named, reported=table.of(name).reported)
            followed = evolve(followed, chains=tuple(_timed(chain, scans) for chain in followed.chains))
            thirds = tuple(scan.detections.z[:, 2] for scan in scans) if table.of(name).third else ()
            by_sensor[name] = evolve(followed, thirds=thirds)
    return by_sensor


def _timed(chain: Chain, scans: Sequence[Scan]) -> Chain:
    """Return a chain at its returns' own times, where they have such."""
    times = [scans[i].detections.time for i in chain.scans.tolist()]
    told = [chain.times[i] if each is None else each[chain.returns[i]] for i, each in enumerate(times)]
    return evolve(chain, times=np.array(told)) if np.all(np.diff(told) > 0) else chain


def _followed(
    times: Array, spots: tuple[Array, ...], stands: Array, named: Indices | None = None, *, reported: bool = False
) -> Seen:
    """Follow the returns by the names of their objects (n,), if they have any.

    Else twice, first within what their spacing allows, then within what the first time showed; or one by one in time, if few
    come at once, and more can be followed so, or more steadily. What is `reported` by the objects comes one by one unless
    that follows less than half as much.
    """
    if named is not None and np.any(named >= 0):
        return Seen(times, spots, stands, tuple(of_owners(times, spots, named)))
    width = spacing(spots)
    seen = Seen(times, spots, stands, tuple(chains(times, spots, width)))
    if seen.chains:
        seen = evolve(seen, chains=tuple(chains(times, spots, min(width, 4.0 * max(seen.rough, 1e-6)))) or seen.chains)
    first = int(np.searchsorted(np.cumsum([len(places) for places in spots]), MOST_REPORTS, side="right"))
    count, held = sum(map(len, spots[:first])), sum(int(np.sum(chain.scans < first)) for chain in seen.chains)
    few = count < TOGETHER * first
    if count >= LEAST:
        single = evolve(seen, chains=tuple(in_turn(times[:first], spots[:first])))
        more = sum(len(chain.times) for chain in single.chains) - held
        least = -0.2 * count if few else 0.8 * count - held  # false returns of scans make no steady chains
        steadier = more > least and single.rough < 0.5 * seen.rough
        if steadier or ((few or reported) and more > 0.1 * count) or (reported and few and more > -0.5 * held):
            return single
    return seen


def _correlated(best: Reading) -> Compared | None:
    """Return how the errors of the sensor go on from return to return, if they do: of one sensor that measures places."""
    seen, *others = best.seen.values()
    if others or best.table.polar or best.table.third or best.table.reported or seen.in_turn:
        return None
    pieces = [piece for chain in seen.chains for piece in unbroken(chain, JUMP * seen.rough)]
    comparison = compared([Path(piece.times, piece.spots[:, axis]) for piece in pieces for axis in (0, 1)])
    return (
        comparison
        if comparison is not None and comparison.wins and comparison.correlated.tau < WANDERS * seen.period
        else None
    )


def _some(scans: Sequence[Scan]) -> Sequence[Scan]:
    """Return the first scans, up to so many returns as a draft is tried on."""
    total = np.cumsum([len(scan.detections.z) for scan in scans])
    return scans[: max(int(np.searchsorted(total, PROVEN, side="right")), 2)]


def _vague(seen: Seen, sigma: float) -> float:
    """Return the error of a position, in m, if it is absurd; else 0."""
    spread = float(np.max(np.std(np.concatenate(seen.spots), axis=0), initial=0.0))
    return sigma if sigma > max(ABSURD, spread / 3) else 0.0


def _speed(seen: Iterable[Seen]) -> float:
    """Return how fast targets move along an axis, in m/s, where they do; a guess without any chain.

    Between returns so far apart in time that the errors of their positions hardly count, and no farther: they may turn.
    """
    paces = [np.abs(_paces(chain, each.error)) for each in seen for chain in each.chains]
    every = np.concatenate(paces) if paces else np.full(1, 10.0)
    return max(float(np.sqrt(np.mean(every**2))), 0.5 * float(np.percentile(every, 95)), 1e-3)


def _paces(chain: Chain, error: float) -> Array:
    """Return the velocities (s, 2) along a chain."""
    for lag in (2**i for i in range(len(chain.times).bit_length())):
        if lag >= len(chain.times):
            break
        dt = (chain.times[lag:] - chain.times[:-lag])[:, None]
        paces: Array = (chain.spots[lag:] - chain.spots[:-lag]) / dt
        if np.mean(2.0 * (error / dt) ** 2) < NOISELESS * np.mean(paces**2):
            return paces
    net: Array = (chain.spots[-1:] - chain.spots[:1]) / (chain.times[-1] - chain.times[0])
    return net


def _noise(table: Table, seen: Seen) -> Noise:
    """Return the noise of one sensor and the targets that it saw; a guess by the extent if it shows none."""
    speed = _speed([seen])
    apart = [places - stand for places, stand in zip(seen.spots, seen.stands, strict=True)]
    far = float(np.median(np.linalg.norm(np.concatenate(apart), axis=-1))) if len(np.concatenate(apart)) else 1e3
    sigma = max(seen.error if seen.chains else far / 100, 1e-6)
    guess = (sigma, sigma / max(far, 1e-6)) if table.polar else (sigma,)
    if not seen.chains:
        return Noise(guess, 0.05 * speed / seen.period)
    windows = _windows(table, seen, [piece for chain in seen.chains for piece in unbroken(chain, JUMP * seen.rough)])
    start = (*guess, 0.05 * speed / seen.period)
    return estimated(windows, start, speed, lambda sigmas: _along_lines(table, sigmas))


def _windows(table: Table, seen: Seen, pieces: Sequence[Chain]) -> Windows:
    lines = []
    for chain in pieces:
        line = np.tile(np.eye(2), (len(chain.times), 1, 1))
        if table.polar:
            along = chain.spots - seen.stands[chain.scans]
            r = np.maximum(np.linalg.norm(along, axis=-1), 1e-9)
            line[..., 0] = along / r[:, None]
            line[..., 1] = np.stack([-along[:, 1], along[:, 0]], axis=-1)
        lines.append(line)
    return Windows.of(pieces, lines)


def _along_lines(table: Table, sigmas: Array) -> Array:
    return sigmas if table.polar else np.repeat(sigmas, 2)


def _of_targets(table: Table, seen: Seen) -> Seen:
    """Return what a sensor shows without the chains that returns of no target make by chance: they would pass for noise.

    With the noise of the longest chains, those of targets are likelier than returns anywhere (the track score of Sittler,
    1964), by more than one in all returns is by chance.
    """
    every = np.concatenate(seen.spots) if seen.spots else np.zeros((0, 2))
    loose = len(every) - sum(len(chain.times) for chain in seen.chains)
    if len(seen.chains) < 2 or loose < len(seen.times):
        return seen
    longest = max(len(chain.times) for chain in seen.chains)
    sure = evolve(seen, chains=tuple(chain for chain in seen.chains if 2 * len(chain.times) >= longest))
    noise, speed = _noise(table, sure), _speed([sure])
    sigmas = _along_lines(table, np.array(noise.sensor))
    area = float(np.prod(np.maximum(np.ptp(np.percentile(every, [1, 99], axis=0), axis=0), 1e-9)))
    anywhere = log(loose / len(seen.times) / area)

    def score(chain: Chain) -> float:
        return loglik(_windows(table, seen, [chain]), sigmas, noise.accel, speed) - (len(chain.times) - 1) * anywhere

    kept = tuple(chain for chain in seen.chains if score(chain) > log(len(every)))
    return evolve(seen, chains=kept) if kept else sure


def _believed(table: Table, sigmas: tuple[float, ...]) -> tuple[float, ...]:
    """Return the errors of a sensor; positions that objects report of themselves are as good as satellites tell them."""
    return tuple(min(sigma, REPORTED) for sigma in sigmas) if table.reported else sigmas


def _facts(seen: Seen, sigmas: tuple[float, ...], reported: bool) -> Facts:
    hits, looks = sum(len(chain.times) for chain in seen.chains), sum(chain.looks for chain in seen.chains)
    every = np.concatenate(seen.spots)
    ranges = [np.linalg.norm(places - stand, axis=-1) for places, stand in zip(seen.spots, seen.stands, strict=True)]
    low, high = np.percentile(every, [1, 99], axis=0) if len(every) else (np.zeros(2), np.ones(2))
    third = max(third_noise(seen.chains, seen.thirds), 1e-6) if seen.thirds else 0.0
    others = np.concatenate(seen.thirds) if seen.thirds else np.zeros(1)
    each = len(every) / max(len(seen.times), 1)
    clutter = max((len(every) - hits) / max(len(seen.times), 1), 0.05 * min(1.0, each))
    return Facts(
        sigmas=sigmas,
        probability=_detected(seen, hits, looks),
        clutter=(1 - TRUE) * each if reported and seen.in_turn else clutter,
        reach=float(np.max(np.concatenate(ranges), initial=1.0)),
        area=float(np.prod(np.maximum(high - low, 10 * sigmas[0]))),
        period=seen.period,
        scans=len(seen.times),
        chains=len(seen.chains),
        third=third,
        fastest=float(np.max(np.abs(others), initial=0.0)),
        height=float(max(np.ptp(np.percentile(others, [1, 99])), 10 * third)) if len(others) else 1.0,
        in_turn=seen.in_turn,
    )


def _detected(seen: Seen, hits: int, looks: int) -> float:
    """Return the probability that a scan detects a target.

    Of targets that report in turn, a tenth of that by the longest waits: those that report seldom must not be given up.
    """
    if seen.in_turn:
        waits = np.concatenate([np.diff(chain.scans) for chain in seen.chains])
        return float(np.clip(SELDOM / np.percentile(waits, 95), 1e-4, 0.5))
    return float(np.clip(hits / looks, 0.3, 0.99)) if looks else 0.9
