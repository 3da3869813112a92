"""Laws of lifecycles over longer lives, and of parameters whose names promise something.

`max_out_of_coverage`, `max_without_detection` and `lifetime` (s), `max_spread` (m), `hits`, `misses` and `drop` (nats) are
taken at their word.
"""

from __future__ import annotations

from contextlib import suppress
from itertools import product
from typing import Any

import numpy as np
from attrs import evolve

from vedette.space import Array, Mask
from vedette.supporting import Lifecycle
from vedette.testing.comparisons import Closed, Lacking, closed_if, demand, same, stated
from vedette.testing.law import Law
from vedette.testing.laws.lifecycle_cases import Lives, areas_of, judged, live
from vedette.tracking import pytrees
from vedette.types import Review

ONES = np.ones(2)


def scan(dt: float, hit: float, p_detect: float, existence: float = 1.0, spread: float = 1.0) -> Review:
    """Return one scan of two tracks."""
    return Review(dt, existence * ONES, hit * ONES, p_detect * ONES, spread * ONES)


def after(lifecycle: Lifecycle, scans: list[Review], memory: Any = None) -> tuple[Any, Mask, Mask]:
    """Return memory and verdicts after some scans, of which a track survived all or not."""
    memory = lifecycle.start(ONES) if memory is None else memory
    lived = np.ones(2, dtype=bool)
    confirmed = lived
    for one in scans:
        memory, confirmed, alive = judged(lifecycle, memory, one)
        lived = lived & alive
    return memory, np.asarray(confirmed), lived


def found_tracks_live(lifecycle: Lifecycle, drawn: Lives) -> None:
    """A track that every scan detects, however many, lives; if it outlives one miss, it outlives misses far apart."""
    often = [scan(drawn.dt, 1.0, 0.9)] * 60
    demand(after(lifecycle, often)[2].all(), f"review: a track detected in each of 60 scans, {drawn.dt:g} s apart, ended")
    cycle = [scan(0.1, 1.0, 0.9)] * 29 + [scan(0.1, 0.0, 0.9)]
    if after(lifecycle, cycle)[2].all():
        demand(after(lifecycle, cycle * 8)[2].all(), "review: misses far apart, one in 30 scans, add up and end a track")


def next_to_no_hit_is_none(lifecycle: Lifecycle, drawn: Lives) -> None:
    """A hit of probability 1e-9 counts as none."""
    none = evolve(drawn, hit=np.where(drawn.hit < 0.5, 0.0, drawn.hit))
    little = evolve(drawn, hit=np.where(drawn.hit < 0.5, 1e-9, drawn.hit))
    for one, other in zip(live(lifecycle, little), live(lifecycle, none), strict=True):
        same("verdicts", np.array(one), np.array(other), 0.0)


def waiting_in_parts_is_waiting(lifecycle: Lifecycle, drawn: Lives) -> None:
    """While nothing can be detected, it does not matter how many scans say so, but how long it lasts; of new tracks, too."""
    for hits, wait in product((0, 1, 20), (2.0, 10.0, 40.0, 200.0, 1000.0, 5000.0)):
        found, _, _ = after(lifecycle, [scan(0.1, 1.0, 0.9)] * hits)
        ends = []
        for parts in (1, 64):
            one, memory, lived = scan(wait / parts, 0.0, 0.0), found, ONES > 0
            for _ in range(parts):
                one = evolve(one, existence=lifecycle.predict(one.existence, one.dt))
                memory, _, alive = judged(lifecycle, memory, one)
                lived = lived & alive
            ends.append(lived)
        told = f"{hits} hits and {wait:g} s without a look a track lives on: {ends[0][0]} by one scan, {ends[1][0]} by 64"
        demand(np.all(ends[0] == ends[1]), f"review: after {told}")


def a_look_at_nothing_keeps_the_verdict(lifecycle: Lifecycle, drawn: Lives) -> None:
    """Scans of no time that could not detect a track end none, new or old, and leave confirmed what 3 hits and 30 did."""
    stayed = ONES > 0
    for hits in (0, 1, 3, 30):
        memory, confirmed, alive = after(lifecycle, [scan(drawn.dt, 1.0, 0.9)] * hits)
        _, still, left = after(lifecycle, [scan(0.0, 0.0, 0.0)] * 30, memory)
        demand(np.all(left | ~alive), f"review: 30 scans that could not detect it ended a track of {hits} hits")
        stayed = stayed & (confirmed | (hits < 3))
    demand(np.all(still | ~(stayed & alive)), "confirmed: a track that none could detect is no longer")


def memory_does_not_grow(lifecycle: Lifecycle, drawn: Lives) -> None:
    """What is kept of a track does not grow with the scans."""
    sizes = [pytrees.size(after(lifecycle, [scan(drawn.dt, 1.0, 0.9)] * scans)[0]) for scans in (3, 12)]
    demand(sizes[0] == sizes[1], f"memory: holds {sizes[0]} numbers after 3 scans and {sizes[1]} after 12")


def asks_for_what_it_uses(lifecycle: Lifecycle, drawn: Lives) -> None:
    """Unless it `needs_spread`, its verdicts are the same without one."""
    wide = [evolve(one, spread=1e7 * ONES) for one in [scan(drawn.dt, 1.0, 0.9)] * 4]
    with_it, without = after(lifecycle, wide), after(lifecycle, [evolve(one, spread=None) for one in wide])
    same("confirmed without a spread", without[1].astype(float), with_it[1].astype(float), 0.0)
    same("alive without a spread", without[2].astype(float), with_it[2].astype(float), 0.0)


def what_does_not_exist_is_not_confirmed(lifecycle: Lifecycle, drawn: Lives) -> None:
    """Unless certain: a track that surely is no target is not both confirmed and alive, whatever is detected."""
    memory = lifecycle.start(1e-3 * ONES)
    _, confirmed, alive = after(lifecycle, [scan(drawn.dt, 1.0, 0.9, 1e-9)] * 30, memory)
    demand(not np.any(confirmed & alive), "review: a track is confirmed whose existence is 1e-9")


def _ends_at(lifecycle: Lifecycle, name: str, hidden: list[Review], limit: float, lives: bool) -> None:
    found, _, alive = after(lifecycle, [scan(0.01 * limit, 1.0, 0.9)] * 40)
    closed_if(not alive.all(), "it ends tracks that are detected")
    for share, wanted in ((0.9, True), (1.2, False)) if lives else ((1.2, False),):
        _, _, lived = after(lifecycle, [evolve(one, dt=share * one.dt) for one in hidden], found)
        demand(not wanted or lived.all(), f"review: a track ended after {share} times {name}, {limit:g}: it should live on")
        demand(wanted or not lived.any(), f"review: a track lives after {share} times {name}, {limit:g}: it should end")


def waits_out_of_coverage(lifecycle: Lifecycle, drawn: Lives) -> None:
    """If it has `max_out_of_coverage`: a track that no sensor covers lives for that long, and no longer."""
    limit = stated(lifecycle, "max_out_of_coverage", "s")
    other = np.inf
    with suppress(Lacking):
        other = stated(lifecycle, "max_without_detection", "s")
    lives = 0.9 * limit < other
    _ends_at(lifecycle, "max_out_of_coverage", [scan(limit / 5, 0.0, 0.0)] * 5, limit, lives)
    again = [scan(min(0.3 * limit, 0.5 * other), 0.0, 0.0), scan(0.01, 1.0, 0.9)] * 12
    demand(after(lifecycle, again)[2].all(), "review: times out of coverage add up although it was covered in between")


def waits_without_detection(lifecycle: Lifecycle, drawn: Lives) -> None:
    """If it has `max_without_detection`: a track that is covered and never detected ends by then."""
    limit = stated(lifecycle, "max_without_detection", "s")
    _ends_at(lifecycle, "max_without_detection", [scan(limit / 5, 0.0, 0.9)] * 5, limit, False)


def keeps_to_max_spread(lifecycle: Lifecycle, drawn: Lives) -> None:
    """If it has `max_spread`: a track lives while its position is known that well, and ends when it is not."""
    limit = stated(lifecycle, "max_spread", "m")
    found, _, _ = after(lifecycle, [scan(0.1, 1.0, 0.9)] * 20)
    demand(after(lifecycle, [scan(0.1, 1.0, 0.9, 1.0, 0.9 * limit)], found)[2].all(), "review: ended below max_spread")
    demand(not after(lifecycle, [scan(0.1, 1.0, 0.9, 1.0, 1.1 * limit)], found)[2].any(), "review: lives above max_spread")


def misses_in_a_row(lifecycle: Lifecycle, drawn: Lives) -> None:
    """If it has `misses`: so many looks missed in a row end a track, and no fewer."""
    limit = int(stated(lifecycle, "misses", "1"))
    found, _, alive = after(lifecycle, [scan(0.001, 1.0, 1.0)] * 70)
    closed_if(not alive.all(), "it ends tracks that are detected")
    for looks, lives in ((limit - 1, True), (limit, False)):
        _, _, lived = after(lifecycle, [scan(0.001, 0.0, 1.0)] * looks, found)
        told = f"review: a track {'ended' if lives else 'lives'} after {looks} misses in a row, `misses` is {limit}"
        demand(lived.all() if lives else not lived.any(), told)


def confirms_after_hits(lifecycle: Lifecycle, drawn: Lives) -> None:
    """If it has `hits`: so many detections in a row, with the first, confirm a track, looks elsewhere aside; no fewer do."""
    wanted = getattr(lifecycle, "hits", None)
    if not isinstance(wanted, int) or isinstance(wanted, bool) or wanted < 2:
        raise Closed("it has no `hits` above 1")
    _, confirmed, alive = after(lifecycle, [scan(0.001, 1.0, 0.9), scan(0.0, 0.0, 0.0)] * (wanted - 1))
    told = "with scans between that could not detect it"
    demand((confirmed & alive).all(), f"review: {wanted} detections, the first included, {told}, do not confirm a track")
    if wanted > 2:
        _, confirmed, _ = after(lifecycle, [scan(0.001, 1.0, 0.9)] * (wanted - 2))
        demand(not confirmed.any(), f"review: fewer than {wanted} detections confirm a track")


def ends_below_its_least_existence(lifecycle: Lifecycle, drawn: Lives) -> None:
    """If it states `least_existence`: a track that falls below ends, and one that is detected lives above."""
    least = lifecycle.least_existence
    closed_if(lifecycle.certain or not 0 < least < 1, "it states no `least_existence`")
    for share, lives in ((1.1, True), (0.9, False)):
        if (existence := float(least * share)) >= 1:
            continue
        start = lifecycle.start(min(1.1 * least, 1.0) * ONES)
        _, _, alive = after(lifecycle, [scan(0.01, 1.0, 0.9, existence)] * 8, start)
        told = f"a track with existence {existence:g} {'ended' if lives else 'lives'}, least_existence is {least:g}"
        demand(alive.all() if lives else not alive.any(), f"review: {told}")


def survives_its_lifetime(lifecycle: Lifecycle, drawn: Lives) -> None:
    """If it has `lifetime`: existence fades as exp(-dt / lifetime)."""
    limit = stated(lifecycle, "lifetime", "s")
    waits: Array = limit * np.array([0.1, 1.0, 3.0])
    found = np.array([lifecycle.predict(ONES, float(wait))[0] for wait in waits])
    same("predict", found, np.exp(-waits / limit), 1e-6, 1.0)


def falls_by_its_drop(lifecycle: Lifecycle, drawn: Lives) -> None:
    """If it has `drop`: a confirmed track ends when its log odds have fallen that far below their best, and not before."""
    limit, best = stated(lifecycle, "drop", "1"), 24.0
    closed_if(limit > 20.0, "its `drop` is more than log odds have room for")

    def odds(values: Array, hit: float) -> list[Review]:
        return [scan(1e-3, hit, 1.0, float(1.0 / (1.0 + np.exp(-value)))) for value in values]

    memory, confirmed, _ = after(lifecycle, odds(np.arange(-1.0, best + 0.5), 1.0), lifecycle.start(0.1 * ONES))
    closed_if(not confirmed.all(), "log odds of 24 do not confirm a track")
    _, _, lived = after(lifecycle, odds(best - limit * np.array([0.3, 0.6, 0.9]), 0.0), memory)
    demand(lived.all(), f"review: a track ended whose log odds had fallen by 0.9 of its drop, {limit:g}")
    _, _, lived = after(lifecycle, odds(best - limit * np.array([0.5, 1.1]), 0.0), memory)
    demand(not lived.any(), f"review: a track lives whose log odds have fallen by 1.1 of its drop, {limit:g}")


def forgets_as_stated(lifecycle: Lifecycle, drawn: Lives) -> None:
    """If it has `forget`: a confirmed track that is lost lives for that long, and no longer."""
    limit = stated(lifecycle, "forget", "s")
    closed_if(not after(lifecycle, [scan(0.01 * limit, 1.0, 0.9)] * 40)[1].all(), "forty detections do not confirm a track")
    _ends_at(lifecycle, "forget", [scan(limit / 5, 0.0, 0.9, 1e-3)] * 5, limit, True)


def coasts_as_stated(lifecycle: Lifecycle, drawn: Lives) -> None:
    """If it has `tentative` and `confirmed`: so many detections due may a track miss in a row, and no more."""
    limits = [stated(lifecycle, name, "1") for name in ("tentative", "confirmed")]
    for hits, limit in zip((0, 70), limits, strict=True):
        found, confirmed, alive = after(lifecycle, [scan(0.001, 1.0, 0.9)] * hits or [scan(0.0, 0.0, 0.0)])
        if confirmed.all() != (hits > 0) or not alive.all():
            continue
        looks = int(np.ceil(limit / 0.9))
        for missed, lives in ((0.9 * limit, True), (1.1 * limit, False)):
            _, _, lived = after(lifecycle, [scan(0.001, 0.0, missed / looks)] * looks, found)
            demand(bool(lived.all()) == lives, f"review: with {missed:.3g} detections due, a track lives: {lived.all()}")


def survives_in_its_areas(lifecycle: Lifecycle, drawn: Lives) -> None:
    """If it has `survives_in`, with corners: a track that is detected lives within these areas, and ends outside."""
    closed_if(not (areas := areas_of(lifecycle)), Lacking("survives_in"))
    every, rng = np.concatenate(areas), np.random.default_rng(len(drawn.hit))
    place = every.mean(axis=0) + 1.2 * np.ptp(every, axis=0) * rng.uniform(-0.5, 0.5, (40, 2))
    inside = np.zeros(40, dtype=bool)
    for corners in areas:  # seen from inside, the corners go round once
        to = corners - place[:, None]
        way = np.arctan2(to[..., 1], to[..., 0])
        turn = np.roll(way, -1, axis=-1) - way
        inside |= np.abs(np.sum((turn + np.pi) % (2 * np.pi) - np.pi, axis=-1)) > np.pi
    ones = np.ones(40)
    _, _, alive = lifecycle.review(lifecycle.start(ones), Review(0.1, ones, ones, 0.9 * ones, ones, place))
    wrong = place[np.asarray(alive) != inside]
    demand(not len(wrong), f"review: at {wrong[:1].tolist()}, a track lives outside of its areas, or ends inside")


LAWS: tuple[Law, ...] = (*map(Law, (
    found_tracks_live, next_to_no_hit_is_none, waiting_in_parts_is_waiting, a_look_at_nothing_keeps_the_verdict,
    memory_does_not_grow, waits_out_of_coverage, waits_without_detection, keeps_to_max_spread, misses_in_a_row,
    confirms_after_hits, ends_below_its_least_existence, survives_its_lifetime, falls_by_its_drop, forgets_as_stated,
    coasts_as_stated, survives_in_its_areas,
)), Law(asks_for_what_it_uses, needs="not needs_spread"), Law(what_does_not_exist_is_not_confirmed, needs="not certain"),
)  # fmt: skip
