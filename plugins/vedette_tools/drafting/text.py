"""The text of a drafted config: TOML with a comment on everything that was guessed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from vedette import Gate
from vedette_tools import toml_text
from vedette_tools.drafting.design import GATE, Design, Facts, rounded
from vedette_tools.drafting.table import Table

LIVES, STAYS, LOOKS = 3600.0, 600.0, 20.0
"""s: how long targets that report in turn stay, at least, and others unless stated; some report every few minutes only. By
hand, on AIS. All stay for so many scans, however seldom these come."""

WANDERING = {"x": "error_x", "y": "error_y"}
"""Measured axis to the state axis that holds its correlated error."""

RECEIVER = 1.0
"""m: a receiver of satellites errs by more, but for corrections; less is what its own filter leaves. By hand."""

_GUESS = "a guess: no track was found in the data"


def written(
    table: Table,
    facts: Mapping[str, Facts],
    design: Design,
    notes: Mapping[str, str],
    *,
    steady: bool = False,
    said: Sequence[str] = (),
) -> str:
    """Return the config; `steady`: the targets' own acceleration is below that of the design; what is `said` leads."""
    return (
        "\n".join([*(f"# {toml_text.comment(line)}" for line in said), *_lines(table, facts, design, notes, steady)]) + "\n"
    )


def _lines(
    table: Table, facts: Mapping[str, Facts], design: Design, notes: Mapping[str, str], steady: bool
) -> Iterator[str]:
    name = table.path or "a data frame"
    yield f"# Drafted by `vedette new config` from {toml_text.comment(name)}. Comments say what was found or assumed."
    yield f"title = {toml_text.value(name)}"
    yield ""
    yield from _source(table, notes)
    for name, of_sensor in facts.items():
        yield ""
        yield from _sensor(table.of(name), name, of_sensor, design)
        if name in table.links:
            yield ""
            yield from _groups(table.of(name), name, table.links[name])
    yield ""
    fitted = sum(of_sensor.chains for of_sensor in facts.values())
    yield from _estimator(table, facts, design, fitted, steady)
    yield from _gate(table, facts, design)
    if design.sure:
        yield ""
        yield "[identity]"
        yield "wrong = 0.0  # no name is another object's: returns and their names are as likely so as with 0.01"
    yield ""
    yield "[associator]"
    yield 'kind = "jpda"'
    yield ""
    yield from _birth(table, design, fitted)
    yield ""
    yield from _lifecycle(facts)


def _source(table: Table, notes: Mapping[str, str]) -> Iterator[str]:
    source = table.source()
    yield "[source]"
    for name in ("kind", "path", "delimiter", "decimal", "dates"):
        if name in source:
            yield f"{name} = {toml_text.value(source[name])}"
    yield f"frame = {toml_text.value(table.frame)}  # where x and y point, and from which of them bearings run"
    if table.sort:
        yield "sort = true"
    if "origin" in notes:
        latitude, longitude, _ = notes["origin"].split(",")
        why = (
            "the middle of the positions"
            if table.origin is None
            else "a plane reaches more rows from here than from elsewhere"
        )
        yield f"origin = {{ latitude = {latitude.strip()}, longitude = {longitude.strip()} }}  # {why}"
    for text in table.said:
        yield f"# assumed: {toml_text.comment(text)}"
    if table.left_out:
        yield f"# not read: {', '.join(map(toml_text.comment, table.left_out))}"
    for place in ("detections", "platform", "truth"):
        if place in source:
            yield ""
            yield f"[source.{place}]"
            for name, value in source[place].items():
                yield f"{name} = {toml_text.value(value)}"


def _gate(table: Table, facts: Mapping[str, Facts], design: Design) -> Iterator[str]:
    alone = any(of_sensor.in_turn and not of_sensor.named for of_sensor in facts.values())
    if alone or design.gate != GATE:
        yield ""
        yield "[gate]"
    if design.gate != GATE:
        yield f"probability = {design.gate!r}  # fewer tracks are broken than with {GATE:g}"
    if alone:
        threshold = rounded(Gate(design.gate).threshold(3 if table.third else 2), 4)
        yield f"largest_distance = {threshold!r}  # what lies beyond is another target's: false reports are too rare to be"


def _birth(table: Table, design: Design, fitted: int) -> Iterator[str]:
    pace = rounded(1.5 * design.speed)
    told = f"m/s: the targets move at some {rounded(design.speed):g} along an axis" if fitted else _GUESS
    yield "[birth]"
    if table.third == "range_rate":
        yield 'kind = "from_returns"  # a return tells the speed along its line, `crossing_speed` how fast it may cross it'
    else:
        yield 'kind = "from_returns"'
        up = f", vz = {pace!r}" if table.third else ""
        yield f"spread = {{ vx = {pace!r}, vy = {pace!r}{up} }}  # {told}"


def _lifecycle(facts: Mapping[str, Facts]) -> Iterator[str]:
    yield "[lifecycle]"
    yield 'kind = "existence"'
    yield "confirm = 0.99  # the probability of being a target at which a track is shown"
    in_turn = any(of_sensor.in_turn for of_sensor in facts.values())
    least = LIVES if in_turn else STAYS
    lives = rounded(max(least, *(max(LOOKS * of_sensor.period, of_sensor.longest) for of_sensor in facts.values())))
    if in_turn or lives > least:
        yield f'lifetime = "{lives:g} s"'
    if in_turn:
        yield "delete = 0.001"
    if in_turn or any(of_sensor.view is not None for of_sensor in facts.values()):
        yield f'max_out_of_coverage = "{lives:g} s"  # as {"no scan covers" if in_turn else "not all scans cover"} a target'


def _estimator(table: Table, facts: Mapping[str, Facts], design: Design, fitted: int, steady: bool) -> Iterator[str]:
    kind = "ekf" if table.polar else "kalman"
    told = f"of greatest likelihood over {_count(fitted, 'stretch', 'stretches')} of tracks" if fitted else _GUESS
    told = "these targets keep their courses; with less a filter would hardly notice a turn" if steady else told
    space = ', axes = ["x", "y", "z"]' if table.upward else ""

    wandering = next((each.errors.correlated for each in facts.values() if each.errors), None) if design.correlated else None

    def motion(accel: float) -> str:
        motion = f'{{ kind = "constant_velocity", sigma_accel = {rounded(accel)!r}{space} }}'
        if wandering is None:
            return f"motion = {motion}"
        size, tau = rounded(design.errors * wandering.correlated), rounded(wandering.tau)
        names = ", ".join(map(toml_text.value, WANDERING.values()))
        errors = f'{{ kind = "gauss_markov", axes = [{names}], sigma = {size!r}, tau = {tau!r} }}'
        return f'motion = {{ kind = "product", models = [{motion}, {errors}] }}'

    yield "[estimator]"
    if not design.agile:
        yield f'kind = "{kind}"'
        yield f"{motion(design.accel)}  # {told}"
        return
    period = min(of_sensor.period for of_sensor in facts.values())
    begin, end = rounded(0.1 / design.lasts / period), rounded(1.0 / design.lasts / period)
    yield 'kind = "imm"  # the targets keep their courses, or manoeuvre'
    yield f"rates = [[{-begin!r}, {begin!r}], [{end!r}, {-end!r}]]  # 1/s: out of the one, out of the other"
    for accel in (design.accel, design.agile):
        yield ""
        yield "[[estimator.modes]]"
        yield f'kind = "{kind}"'
        part = design.accel / design.found if design.found else 1.0
        quiet = told if part == 1 else f"{part:.2g} times that {told}"
        agile = "with it fewer tracks break, or returns are likelier"
        yield f"{motion(accel)}  # {quiet if accel == design.accel else agile}"


def _sensor(table: Table, name: str, facts: Facts, design: Design) -> Iterator[str]:
    yield f"[sensors.{toml_text.key(name)}]"
    apart = f", usually {facts.period:.3g} s apart" if facts.scans > 1 and not facts.in_turn else ""
    if facts.in_turn:
        yield f"# targets report one by one, usually every {facts.period:.3g} s: a scan without a report tells little"
    few = f"the first {facts.scans} of {facts.of} scans" if facts.scans < facts.of else _count(facts.scans, "scan")
    yield f"# {few}{apart}; {_count(facts.chains, 'stretch', 'stretches')} of tracks found"
    if facts.exact:
        yield "# these positions hold no errors: are they the truth of a simulation? A filter has nothing to do there"
    elif table.reported and facts.sigmas[0] < RECEIVER:
        yield "# smoothed by the receivers' own filters: all positions of one may be off by metres, which no track shows"
    doubt = "" if facts.chains else f"  # {_GUESS}"
    yield from (_polar if table.polar else _in_space if table.third else _in_plane)(table, name, facts, design, doubt)
    often = min(design.often * facts.probability, 0.5) if facts.in_turn else facts.probability
    yield f"detection_probability = {rounded(often)!r}"
    if table.polar:
        yield f"clutter_per_scan = {rounded(facts.clutter)!r}  # returns that belong to no track"
        return
    density = rounded(facts.clutter / facts.area / (facts.height if table.third else 1.0))
    yield f"clutter_density = {density!r}  # {rounded(facts.clutter):g} returns a scan that belong to no track"


def _polar(table: Table, name: str, facts: Facts, design: Design, doubt: str) -> Iterator[str]:
    """Yield the lines of a sensor of ranges and bearings, up to its detection probability."""
    errors = design.errors
    beside = {"range_rate": "_rate", "elevation": "_elevation"}.get(table.third, "")
    yield f'kind = "range_bearing{beside}"'
    yield f"sigma_range = {rounded(errors * facts.sigmas[0])!r}{doubt}"
    yield f'sigma_bearing = "{rounded(math.degrees(errors * facts.sigmas[1])):g} deg"{doubt}'
    if table.upward:
        yield f'sigma_elevation = "{rounded(math.degrees(errors * facts.third)):g} deg"'
    elif table.third:
        yield f"sigma_rate = {rounded(errors * facts.third)!r}"
        yield f"max_rate = {rounded(1.1 * facts.fastest)!r}"
        yield f"crossing_speed = {rounded(1.5 * design.speed)!r}"
    yield f"max_range = {rounded(1.1 * facts.reach)!r}"
    if name in table.stands:
        yield from (f"{axis} = {rounded(place, 6)!r}" for axis, place in zip("xy", table.stands[name], strict=True))


def _groups(table: Table, name: str, link: float) -> Iterator[str]:
    """Yield the lines of what makes one return of an object's several."""
    yield f"[preprocessors.{toml_text.key(name)}]"
    yield 'kind = "grouped_returns"'
    yield f"link = {link!r}  # m: returns nearer to each other are of one object"
    yield f"sensors = {toml_text.value({name: table.sensor()})}  # of one return, to tell where it is"


def _in_space(table: Table, name: str, facts: Facts, design: Design, doubt: str) -> Iterator[str]:
    """Yield those of a sensor of positions with heights."""
    flat, up = (rounded((design.errors * sigma) ** 2) for sigma in (facts.sigmas[0], facts.third))
    yield 'kind = "linear"'
    yield 'axes = ["x", "y", "z"]'
    told = f"# m^2: {rounded(design.errors * facts.third):g} m in height"
    yield f"R = [[{flat!r}, 0, 0], [0, {flat!r}, 0], [0, 0, {up!r}]]  {told}"


def _in_plane(table: Table, name: str, facts: Facts, design: Design, doubt: str) -> Iterator[str]:
    """Yield those of a sensor of positions in the plane."""
    size = facts.sigmas[0]
    if design.correlated and facts.errors is not None:
        yield f"# {facts.errors.told(name, 'each axis', 'm')}"
        yield "# so err the estimates of a filter: if these are such, track the returns that they were made of"
        yield 'kind = "biased"  # the error of a return goes on in the next: a part of the state, beside the motion'
        yield f"add = {{ {', '.join(f'{axis} = {toml_text.value(own)}' for axis, own in WANDERING.items())} }}"
        wandering = rounded(design.errors * facts.errors.correlated.correlated)
        yield f"spread = {{ {', '.join(f'{own} = {wandering!r}' for own in WANDERING.values())} }}"
        yield ""
        yield f"[sensors.{toml_text.key(name)}.of]"
        size = facts.errors.correlated.white
    yield 'kind = "cartesian_position"'
    yield f"sigma = {rounded(design.errors * size)!r}{doubt}"
    if facts.view is not None:
        box = [f"{axis} = {{ low = {a:.6g}, high = {b:.6g} }}" for axis, a, b in zip("xy", *facts.view, strict=True)]
        yield f"view = {{ {', '.join(box)} }}  # of its returns, for others saw targets beyond"


def _count(number: int, one: str, many: str = "") -> str:
    return f"{number} {one if number == 1 else many or f'{one}s'}"
