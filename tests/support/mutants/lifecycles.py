"""Lifecycles with one thing wrong."""

from attrs import evolve

from support.mutants.parts import CALLS
from vedette_standard.lifecycles.existence import Existence
from vedette_standard.lifecycles.m_of_n import MOfN
from vedette_standard.lifecycles.single_target import SingleTarget

LIFECYCLES = [
    ("existence grows with time", Existence, "survival_is_a_probability", {"predict": lambda s, e, dt: e * (1 + dt)}),
    ("existence falls per scan", Existence, "survival_is_a_probability", {"predict": lambda s, e, dt: 0.9 * e}),
    ("survival linear in time", Existence, "two_waits_make_one",
     {"predict": lambda s, e, dt: e * max(0.0, 1 - dt / s.lifetime)}),
    ("verdicts as numbers", MOfN, "verdicts_are_one_a_track",
     {"review": lambda s, m, r0: (lambda r: (r[0], r[1].astype(int), r[2]))(MOfN.review(s, m, r0))}),
    ("only the best track is confirmed", Existence, "tracks_are_judged_alone",
     {"review": lambda s, m, r0: (lambda r: (r[0], r0.existence == r0.existence.max(), r[2]))(Existence.review(s, m, r0))}),
    ("keeps a state between calls", Existence, "pure",
     {"review": lambda s, m, r0: (lambda r: (r[0], r[1], r[2] & (next(CALLS) % 2 == 0)))(
         Existence.review(s, m, r0))}),
    ("writes into the memory that it is given", MOfN, "pure",
     {"review": lambda s, m, r0: (lambda r: (m.detected.__setitem__(..., r[0].detected), r)[1])(MOfN.review(s, m, r0))}),
    ("one run's verdict for all", Existence, "batches_as_it_loops",
     {"review": lambda s, m, r0: (lambda r: (r[0], r[1] | (r[1].any() & (r[1].ndim > 1)), r[2]))(
         Existence.review(s, m, r0))}),
    ("tracks that end though they last", MOfN, "permanent_as_declared", {"permanent": True}),
    ("permanent, but not certain", SingleTarget, "permanent_as_declared", {"certain": False}),
    ("certain, but existence falls", Existence, "certain_as_declared", {"certain": True}),
    ("tracks out of coverage go on", MOfN, "unseen_tracks_end",
     {"review": lambda s, m, r0: (lambda r: (r[0], r[1], r[2] | (r0.p_detect == 0)))(MOfN.review(s, m, r0))}),
    ("a chance in a million is coverage", MOfN, "unseen_tracks_end", {"least_covered": 1e-7}),
    ("a hit ends a track", MOfN, "a_hit_never_harms",
     {"review": lambda s, m, r0: MOfN.review(s, m, evolve(r0, hit=1.0 - r0.hit))}),
]  # fmt: skip
