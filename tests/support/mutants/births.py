"""Births with one thing wrong."""

import numpy as np
from attrs import evolve

from support.mutants.parts import CALLS
from vedette import Gaussian
from vedette_standard.births.from_returns import FromReturns


def begins(change):
    """With something changed in what begins: a function of the newborn tracks, the detections and what claims them."""
    return {"begin": lambda s, f, e, o, n, d, c: change(FromReturns.begin(s, f, e, o, n, d, c), d, c)}


def started(claimed, least):
    """Of returns that are claimed less than `least`."""
    return lambda s, f, e, o, n, d, c: FromReturns.begin(s, f, e, o, n, d, np.where(c < least, 0.0, 1.0))


def prior(change):
    return begins(lambda made, d, c: evolve(made, prior=change(made.prior)))


BIRTHS = [
    ("new tracks exist twice", FromReturns, "newborn_tracks_are_whole",
     begins(lambda made, d, c: evolve(made, existence=2.0 * np.ones(len(made.returns))))),
    ("one existence for all new tracks", FromReturns, "newborn_tracks_are_whole",
     begins(lambda made, d, c: evolve(made, existence=np.ones(1)))),
    ("a return starts two tracks", FromReturns, "newborn_tracks_are_whole",
     begins(lambda made, d, c: evolve(made, returns=0 * made.returns))),
    ("velocity without doubt", FromReturns, "newborn_tracks_are_whole",
     prior(lambda p: Gaussian(p.mean, p.cov * np.diag([1.0, 1.0, 0.0, 0.0])))),
    ("claimed returns start tracks", FromReturns, "claimed_returns_start_nothing", {"begin": started(None, 2.0)}),
    ("padding starts tracks", FromReturns, "padding_starts_nothing",
     {"begin": lambda s, f, e, o, n, d, c: FromReturns.begin(s, f, e, o, n, evolve(d, valid=np.ones_like(d.valid)), c)}),
    ("the first fifty returns", FromReturns, "padding_starts_nothing",
     {"begin": lambda s, f, e, o, n, d, c: FromReturns.begin(
         s, f, e, o, n, evolve(d, valid=d.valid & (np.arange(len(d.valid)) < 50)), c)}),
    ("tracks start elsewhere", FromReturns, "tracks_start_near_their_returns",
     prior(lambda p: Gaussian(p.mean + 300.0, p.cov))),
    ("a mean velocity of 1, in whatever unit", FromReturns, "births_know_no_unit",
     prior(lambda p: Gaussian(p.mean + np.array([0.0, 0.0, 1.0, 1.0]), p.cov))),
    ("keeps a state between calls", FromReturns, "pure",
     begins(lambda made, d, c: evolve(made, existence=made.existence / (1 + next(CALLS) % 2)))),
]  # fmt: skip
