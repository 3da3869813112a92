"""The text of a drafted config: TOML with a comment on everything that was guessed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from attrs import frozen

from vedette_tools import toml_text
from vedette_tools.drafting.table import Table

HEIGHTS = ("z", "altitude")
"""How a source names the third axis of a position."""

_GUESS = "a guess: no track was found in the data"


@frozen
class Facts:
    """What a config says of one sensor; `third` is the noise of what it measures beside a position, up to `fastest` or over
    a `height`.
    """

    sigmas: tuple[float, ...]
    probability: float
    clutter: float
    reach: float
    area: float
    period: float
    scans: int
    chains: int
    third: float = 0.0
    fastest: float = 0.0
    height: float = 1.0


def written(
    table: Table, facts: Mapping[str, Facts], accel: float, speed: float, notes: Mapping[str, str], *, steady: bool = False
) -> str:
    """Return the config; `steady` says that the targets' own acceleration is below `accel`."""
    return "\n".join(_lines(table, facts, accel, speed, notes, steady)) + "\n"


def rounded(value: float) -> float:
    """Return a number to two significant digits."""
    return float(f"{value:.2g}")


def _lines(
    table: Table, facts: Mapping[str, Facts], accel: float, speed: float, notes: Mapping[str, str], steady: bool
) -> Iterator[str]:
    name = table.path or "a data frame"
    yield f"# Drafted by `vedette new config` from {toml_text.comment(name)}. Comments say what was found or assumed."
    yield f"title = {toml_text.value(name)}"
    yield ""
    yield "[source]"
    source = table.source()
    for name in ("kind", "path", "delimiter", "decimal"):
        if name in source:
            yield f"{name} = {toml_text.value(source[name])}"
    yield f"frame = {toml_text.value(table.frame)}  # where x and y point, and from which of them bearings run"
    if table.sort:
        yield "sort = true  # the rows are not in the order of time"
    if "origin" in notes:
        latitude, longitude, _ = notes["origin"].split(",")
        yield f"origin = {{ latitude = {latitude.strip()}, longitude = {longitude.strip()} }}  # the middle of the positions"
    for text in table.assumed:
        yield f"# assumed: {toml_text.comment(text)}"
    if table.left_out:
        yield f"# not read: {', '.join(map(toml_text.comment, table.left_out))}"
    for place in ("detections", "platform"):
        if place in source:
            yield ""
            yield f"[source.{place}]"
            for name, value in source[place].items():
                yield f"{name} = {toml_text.value(value)}"
    for name, of_sensor in facts.items():
        yield ""
        yield from _sensor(table, name, of_sensor, speed)
    yield ""
    yield "[estimator]"
    yield f'kind = "{"ekf" if table.polar else "kalman"}"'
    fitted = sum(of_sensor.chains for of_sensor in facts.values())
    told = f"of greatest likelihood over {_count(fitted, 'stretch', 'stretches')} of tracks" if fitted else _GUESS
    told = "these targets keep their courses; with less a filter would hardly notice a turn" if steady else told
    space = ', axes = ["x", "y", "z"]' if table.third in HEIGHTS else ""
    yield f'motion = {{ kind = "constant_velocity", sigma_accel = {rounded(accel)!r}{space} }}  # {told}'
    yield ""
    yield "[associator]"
    yield 'kind = "jpda"'
    yield ""
    yield "[birth]"
    pace = rounded(max(1.5 * speed, 1e-3))
    told = f"m/s: the targets move at some {rounded(speed):g} along an axis" if fitted else _GUESS
    if table.third == "range_rate":
        yield 'kind = "from_returns"  # a return tells the speed along its line, `crossing_speed` how fast it may cross it'
    else:
        yield 'kind = "from_returns"'
        up = f", vz = {pace!r}" if table.third else ""
        yield f"spread = {{ vx = {pace!r}, vy = {pace!r}{up} }}  # {told}"
    yield ""
    yield "[lifecycle]"
    yield 'kind = "existence"'
    yield "confirm = 0.99  # the probability of being a target at which a track is shown"


def _sensor(table: Table, name: str, facts: Facts, speed: float) -> Iterator[str]:
    yield f"[sensors.{toml_text.key(name)}]"
    apart = f", usually {facts.period:.3g} s apart" if facts.scans > 1 else ""
    yield f"# {_count(facts.scans, 'scan')}{apart}; {_count(facts.chains, 'stretch', 'stretches')} of tracks found"
    doubt = "" if facts.chains else f"  # {_GUESS}"
    if table.polar:
        yield f'kind = "range_bearing{"_rate" if table.third else ""}"'
        yield f"sigma_range = {rounded(facts.sigmas[0])!r}{doubt}"
        yield f'sigma_bearing = "{rounded(math.degrees(facts.sigmas[1])):g} deg"{doubt}'
        if table.third:
            yield f"sigma_rate = {rounded(facts.third)!r}"
            yield f"max_rate = {rounded(1.1 * facts.fastest)!r}"
            yield f"crossing_speed = {rounded(max(1.5 * speed, 1e-3))!r}"
        yield f"max_range = {rounded(1.1 * facts.reach)!r}"
        clutter = f"clutter_per_scan = {rounded(facts.clutter)!r}  # returns that belong to no track"
    else:
        if table.third:
            flat, up = rounded(facts.sigmas[0] ** 2), rounded(facts.third**2)
            yield 'kind = "linear"'
            yield 'axes = ["x", "y", "z"]'
            yield f"R = [[{flat!r}, 0, 0], [0, {flat!r}, 0], [0, 0, {up!r}]]  # m^2: {rounded(facts.third):g} m in height"
        else:
            yield 'kind = "cartesian_position"'
            yield f"sigma = {rounded(facts.sigmas[0])!r}{doubt}"
        density = rounded(facts.clutter / facts.area / (facts.height if table.third else 1.0))
        clutter = f"clutter_density = {density!r}  # {rounded(facts.clutter):g} returns a scan that belong to no track"
    yield f"detection_probability = {rounded(facts.probability)!r}"
    yield clutter


def _count(number: int, one: str, many: str = "") -> str:
    return f"{number} {one if number == 1 else many or f'{one}s'}"
