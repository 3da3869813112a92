"""Lifecycles with one thing wrong."""

import numpy as np

from support.mutants.parts import CALLS
from vedette import Gaussian
from vedette_standard.lifecycles.existence import Existence
from vedette_standard.lifecycles.m_of_n import MOfN

LIFECYCLES = [
    ("new tracks exist twice", MOfN, "newborn_tracks_exist_in_part",
     {"newborn": lambda s, n: (MOfN.newborn(s, n)[0], np.full(n, 2.0))}),
    ("one existence for all new tracks", MOfN, "newborn_tracks_exist_in_part",
     {"newborn": lambda s, n: (MOfN.newborn(s, n)[0], np.ones(1))}),
    ("existence grows with time", Existence, "survival_is_a_probability", {"survive": lambda s, e, dt: e * (1 + dt)}),
    ("existence falls per scan", Existence, "survival_is_a_probability", {"survive": lambda s, e, dt: 0.9 * e}),
    ("survival linear in time", Existence, "two_waits_make_one",
     {"survive": lambda s, e, dt: e * max(0.0, 1 - dt / s.lifetime)}),
    ("verdicts as numbers", MOfN, "verdicts_are_one_a_track",
     {"review": lambda s, m, e, h, x: (lambda r: (r[0], r[1].astype(int), r[2]))(MOfN.review(s, m, e, h, x))}),
    ("only the best track is confirmed", Existence, "tracks_are_judged_alone",
     {"review": lambda s, m, e, h, x: (lambda r: (r[0], e == e.max(), r[2]))(Existence.review(s, m, e, h, x))}),
    ("keeps a state between calls", Existence, "pure",
     {"review": lambda s, m, e, h, x: (lambda r: (r[0], r[1], r[2] & (next(CALLS) % 2 == 0)))(
         Existence.review(s, m, e, h, x))}),
    ("one run's verdict for all", Existence, "batches_as_it_loops",
     {"review": lambda s, m, e, h, x: (lambda r: (r[0], r[1] | (r[1].any() & (r[1].ndim > 1)), r[2]))(
         Existence.review(s, m, e, h, x))}),
    ("tracks that end though they last", MOfN, "lasting_as_declared", {"permanent": True}),
    ("a hit ends a track", MOfN, "a_hit_never_harms", {"review": lambda s, m, e, h, x: MOfN.review(s, m, e, 1.0 - h, x)}),
    ("explained returns start tracks", MOfN, "explained_returns_start_nothing",
     {"starts": lambda s, name, claimed: claimed > 0.2}),
    ("tracks start elsewhere", MOfN, "tracks_start_where_they_were_seen",
     {"prior": lambda s, seen, a, n: (lambda p: Gaussian(p.mean[:, [1, 0, 2, 3]], p.cov))(MOfN.prior(s, seen, a, n))}),
    ("velocity without doubt", MOfN, "tracks_start_where_they_were_seen",
     {"prior": lambda s, seen, a, n: (lambda p: Gaussian(p.mean, p.cov * np.diag([1, 1, 0, 0]) +
                                                         (p.cov - p.cov * np.eye(4))))(MOfN.prior(s, seen, a, n))}),
]  # fmt: skip
