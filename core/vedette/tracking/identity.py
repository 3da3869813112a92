"""Returns that name their object: what a code says of whose a return is, and which code a track bears.

The code that a track bears is not known: codes may be wrong. Of each track, `Names` keeps the few codes that it most likely
bears, with their probabilities; the rest is spread evenly over all codes. Where a code is a class that many objects share,
all classes have their probabilities: `classes.py`.
"""

from __future__ import annotations

import numpy as np
from attrs import Factory, evolve, field, frozen

from vedette import fields
from vedette.space import Array, Indices, Mask
from vedette.tracking import pytrees
from vedette.tracking.classes import class_evidence, confusion_fault, given_classes, shares_fault
from vedette.types import Detections, Frame, Newborn

KEPT = 3
"""So many codes are kept of a track."""

STRAY = 1.0
"""After so many returns of a code that no gate of its track held, another track may bear it. Of 1, 2, 3 chosen on six draws
of two aircraft of one code in adsb/area_20min.csv: with 3, a track whose aircraft had left took the other's returns.
"""

CLASSES = -1.0
"""What stands for a number of stray returns where codes are classes, of which no track has all returns."""

FADES = 0.9
"""Each return of its code that a track took leaves so much of the count of those that it did not: chosen by hand."""

CHANGES = 1e-3
"""Probability that from one scan to the next a track has gone over to an object of another code: chosen by hand."""


@frozen
class Identity:
    """How far the codes by which returns name their objects are to be believed.

    With probability `wrong` a code is any of the `codes` there are; otherwise it is the object's own. So a pair of a track
    that bears a code and a return of the same one scores log(codes (1 - wrong) + wrong) more than one without a code would,
    and a pair of unlike codes log(wrong). A return of a code that a track bears starts no second track, unless `wrong` is
    above 0 and such a return of late lay outside the track's gate. Bar-Shalom, Willett, Tian, Tracking and Data Fusion,
    2011, section 8.5.

    With `confusion`, a code is a class, from 0 on, that many objects share: its rows say how an object of each class is
    named. A pair then scores log(p(code | the track's classes) / p(code | no target)) more, and a class keeps no other
    track from starting.
    """

    wrong: float = fields.probability("that a return bears another object's code; 0: never", default=0.01)
    codes: int = fields.integer(
        "number of codes that there are: the fewer, the likelier that two agree by chance", default=1000
    )

    confusion: Array | None = fields.array(
        "1", "of each class, a row: the probability of being named each; default: codes name one object each",
        ndim=2, default=None, check=confusion_fault,
    )  # fmt: skip
    share: Array = fields.array("1", "how common each class is; default: alike", ndim=1, default=())
    false_share: Array = fields.array("1", "how often each names what is no target; default: alike", ndim=1, default=())

    def __attrs_post_init__(self) -> None:
        if self.codes < 2:
            raise ValueError(f"codes: must be >= 2, got {self.codes}")
        for name, shares in (("share", self.share), ("false_share", self.false_share)):
            if fault := shares_fault(shares, 0 if self.confusion is None else len(self.confusion)):
                raise ValueError(f"{name}: {fault}")


@frozen(eq=False)
class Names:
    """The codes (*b, t, 3) that tracks or leaves may bear, -1 for none, their probabilities, and `stray` (*b, t): how many
    returns of the likeliest lay outside the gate, of late; CLASSES of a track whose codes are classes.
    """

    codes: Indices
    shares: Array
    stray: Array = field(default=Factory(lambda self: np.zeros(self.codes.shape[:-1]), takes_self=True))

    @property
    def borne(self) -> Indices:
        """The code (*b, t) that each track bears, -1 where none is likelier than not."""
        first = np.argmax(self.shares, axis=-1)[..., None]
        code = np.take_along_axis(self.codes, first, -1)[..., 0]
        return np.where(np.take_along_axis(self.shares, first, -1)[..., 0] > 0.5, code, -1)


def unnamed(how: Identity, shape: tuple[int, ...]) -> Names:
    """Return what is known of the codes of new tracks: nothing."""
    if how.confusion is not None:
        count = len(how.confusion)
        shares = how.share if len(how.share) else np.full(count, 1.0 / count)
        codes, even = np.broadcast_to(np.arange(count), (*shape, count)), np.broadcast_to(shares, (*shape, count))
        return Names(codes, even, np.full(shape, CLASSES))
    return Names(np.full((*shape, KEPT), -1), np.zeros((*shape, KEPT)))


def pair_evidence(how: Identity, names: Names | None, codes: Indices, shape: tuple[int, ...]) -> Array:
    """Return the log of p(code | track) over p(code | another source) (*b, t, k), for the codes of returns (*b, k).

    shape: (*b, t), of the tracks.
    """
    known = unnamed(how, shape) if names is None else names
    if how.confusion is not None:
        return class_evidence(known.shares, codes, how.confusion, how.false_share)
    seen = codes[..., None, :]
    share: Array = np.zeros((*shape, codes.shape[-1]))
    listed = np.zeros(share.shape, dtype=bool)
    for slot in range(KEPT):
        same = (known.codes[..., slot, None] == seen) & (known.shares[..., slot, None] > 0)
        share += np.where(same, known.shares[..., slot, None], 0.0)
        listed |= same
    rest = np.maximum(1.0 - np.sum(known.shares, axis=-1), 0.0)[..., None] / how.codes
    ratio = how.codes * (1.0 - how.wrong) * np.where(listed, share, rest) + how.wrong
    with np.errstate(divide="ignore"):
        return np.where(seen >= 0, np.log(ratio), 0.0)


def weighed(how: Identity, names: Names | None, codes: Indices, scores: Array) -> Array:
    """Return log scores (*b, t, 1+k) with the evidence of the codes (*b, k) of returns."""
    with_codes = scores.copy()
    with_codes[..., 1:] += pair_evidence(how, names, codes, scores.shape[:-1])
    return with_codes


def taken(how: Identity, names: Names, weights: Array, codes: Indices) -> Names:
    """Return what is known of tracks after a scan, by their weights (*b, t, 1+k) and the codes (*b, t, k) of their returns.

    Of several returns only the likeliest counts, with its weight.
    """
    if not codes.shape[-1]:
        return names
    if how.confusion is not None:
        return Names(names.codes, given_classes(names.shares, weights, codes, how.confusion), names.stray)
    best = np.argmax(weights[..., 1:], axis=-1)[..., None]
    code = np.take_along_axis(codes, best, -1)[..., 0]
    weight = np.where(code >= 0, np.take_along_axis(weights[..., 1:], best, -1)[..., 0], 0.0)
    held, shares = names.codes.copy(), names.shares.copy()
    rest = np.maximum(1.0 - np.sum(shares, axis=-1), 0.0)
    new = ~np.any(held == code[..., None], axis=-1) & (weight > 0)
    at = (*np.nonzero(new), np.argmin(shares, axis=-1)[new])
    held[at], shares[at] = code[new], rest[new] / how.codes
    share = how.wrong / how.codes
    likely = shares * np.where(held == code[..., None], 1.0 - how.wrong + share, share)
    total = np.sum(likely, axis=-1) + rest * share
    known = (total > 0) & (weight > 0)
    stays = 1.0 - CHANGES if how.wrong else 1.0
    given = likely / np.where(known, total, 1.0)[..., None] * stays
    part = np.where(known, weight, 0.0)[..., None]
    borne = (code == names.borne) & (weight > 0.5)
    return Names(held, (1.0 - part) * shares + part * given, np.where(borne, FADES * names.stray, names.stray))


def after_scan(
    how: Identity, names: Names | None, observed: Detections | Frame, weights: Array, returns: Indices | None, claims: Array
) -> Names | None:
    """Return what is known of tracks after a scan, whose returns are claimed (k,); None where no return ever had a code.

    returns (t, w): those that the weights (*b, t, 1+w) are of; None: all of the scan.
    """
    codes = observed.identity
    if codes is None:
        return names
    shape = weights.shape[:-1]
    names = unnamed(how, shape) if names is None else names
    if returns is None:
        of_pairs = np.broadcast_to(codes[..., None, :], (*shape, codes.shape[-1]))
    else:
        of_pairs = np.where(returns >= 0, codes[returns], -1) if len(codes) else np.full(returns.shape, -1)
    after = taken(how, names, weights, of_pairs)
    if how.confusion is not None or claims.shape != codes.shape or not (strays := strayed(names, codes, claims)).any():
        return after
    lost = np.isin(names.borne, codes[strays])
    again = np.where(names.stray >= STRAY, 0.0, after.stray + 1.0)
    return evolve(after, stray=np.where(lost, again, after.stray))


def strayed(names: Names, codes: Indices, claims: Array) -> Mask:
    """Return which returns (k,) bear a code that a track bears, and are claimed (k,) by none."""
    return (codes >= 0) & (claims < 0.5) & np.isin(codes, names.borne[names.stray != CLASSES])


def without_second(
    how: Identity, names: Names | None, codes: Indices | None, begin: Newborn, inside: Mask | None
) -> Newborn:
    """Return the tracks that begin, without those whose code a track bears; of several of one code, the first.

    inside (k,): returns within some gate, which come after those that are not.
    """
    if codes is None or how.confusion is not None or not len(begin.returns):
        return begin
    code = codes[begin.returns]
    order = np.arange(len(code)) if inside is None else np.argsort(inside[begin.returns], kind="stable")
    first = np.zeros(len(code), dtype=bool)
    first[order[np.unique(code[order], return_index=True)[1]]] = True
    keep = first | (code < 0)
    if names is not None:
        bearing = names.borne if how.wrong == 0 else names.borne[names.stray < STRAY]
        keep &= ~np.isin(code, bearing[bearing >= 0])
    return begin if keep.all() else pytrees.take(begin, keep, 0)


def begun(how: Identity, observed: Detections | Frame, returns: Indices) -> Names:
    """Return what is known of the codes of tracks that begin at these returns (j,)."""
    nothing = unnamed(how, returns.shape)
    if observed.identity is None:
        return nothing
    return taken(how, nothing, np.tile([0.0, 1.0], (len(returns), 1)), observed.identity[returns][:, None])
