"""Lifecycles that count: with leakage over time, by a Bayesian detection rate, by Page's test."""

import numpy as np
from attrs import frozen
from scipy.special import betainc

import vedette
from foreign import Foreign


@frozen(eq=False)
class Level:
    """What a leaky counter keeps, all (*b, t): its level, and whether the track was confirmed."""

    level: vedette.Array
    confirmed: vedette.Mask


@frozen
class LeakyCounter(vedette.Lifecycle):
    """Hits over time: each hit fills a level that leaks, level' = level exp(-dt / memory) + hit; it starts at 1.

    A track is confirmed from `confirm` on and ends once its level is below `least`.
    Blackman, Popoli, Design and Analysis of Modern Tracking Systems, 1999, section 6.2 (windowed hits).
    """

    kind = "leaky_counter"
    certain = True
    memory: float = vedette.fields.quantity(
        "s", "time after which the level is down to 1/e", default=10, at_least=1, at_most=100
    )
    confirm: float = vedette.fields.quantity("1", "level that confirms", default=2.5, at_least=1, at_most=10)
    least: float = vedette.fields.quantity("1", "level below which a track ends", default=0.2, at_least=0.01, at_most=0.5)

    def start(self, existence):
        return Level(np.ones(existence.shape), np.full(existence.shape, self.confirm <= 1))

    def review(self, memory, scan):
        level = memory.level * np.exp(-scan.dt / self.memory) + scan.hit
        confirmed = memory.confirmed | (level >= self.confirm)
        return Level(level, confirmed), confirmed, level >= self.least


@frozen(eq=False)
class Rate:
    """Hits and misses beyond the prior (*b, t), faded, and the time since anything could be seen."""

    hits: vedette.Array
    misses: vedette.Array
    unseen: vedette.Array


@frozen
class DetectionRate(vedette.Lifecycle):
    """A Beta posterior of the rate at which expected detections happen: Beta(1 + hits, 1 + misses), older looks fading.

    Confirmed while P(rate > half) is high, ended when it is low, or after `patience` without a look at it.
    Gelman et al., Bayesian Data Analysis, 2013, chapter 2.
    """

    kind = "detection_rate"
    certain = True
    half: float = vedette.fields.probability("rate that tells targets from clutter", default=0.5, at_least=0.2, at_most=0.8)
    confirm: float = vedette.fields.probability(
        "that the rate is above, which confirms", default=0.9, at_least=0.7, at_most=0.99
    )
    end: float = vedette.fields.probability(
        "that the rate is above, below which a track ends", default=0.05, above=0, at_most=0.2
    )
    patience: float = vedette.fields.quantity("s", "time without a look after which a track ends", default=30, above=0)

    def __attrs_post_init__(self):
        if (1 - self.half) ** 10 >= self.end:  # nine misses are remembered at most
            raise ValueError(f"end: a track that is never detected would not end, at {self.end}")

    def start(self, existence):
        return Rate(np.ones(existence.shape), np.zeros(existence.shape), np.zeros(existence.shape))

    def review(self, memory, scan):
        looked = np.maximum(scan.hit, scan.p_detect) > 0.01
        kept = np.where(looked, 0.9, 1.0)
        hits = kept * memory.hits + scan.hit
        misses = kept * memory.misses + (1 - scan.hit) * scan.p_detect
        unseen = np.where(looked, 0.0, memory.unseen + scan.dt)
        above = betainc(1 + misses, 1 + hits, 1 - self.half)
        return Rate(hits, misses, unseen), above >= self.confirm, (above >= self.end) & (unseen <= self.patience)


@frozen(eq=False)
class Page:
    """Page's statistic (*b, t), and whether the track was confirmed."""

    statistic: vedette.Array
    confirmed: vedette.Mask


@frozen
class PageTest(vedette.Lifecycle):
    """Ends a track by Page's test for a fall of its detection rate from P_D to `lost`; existence confirms it.

    g' = max(0, g + (1 - hit) log((1 - lost) / (1 - P_D)) + hit log(lost / P_D)), P_D at least `lost`; ended where
    g > `alarm` or existence, which decays as exp(-dt / lifetime), is below `least`.
    Page, Continuous Inspection Schemes, Biometrika 41, 1954.
    """

    kind = "page_test"
    lost: float = vedette.fields.probability("that a lost track claims a return", default=0.1, at_least=0.01, at_most=0.5)
    alarm: float = vedette.fields.quantity("1", "nats that end a track", default=6, at_least=0.5, at_most=50)
    lifetime: float = vedette.fields.quantity(
        "s", "mean time for which a target stays", default=300, at_least=10, at_most=3600
    )
    confirm: float = vedette.fields.probability("existence that confirms", default=0.9, at_least=0.5, at_most=1)
    least: float = vedette.fields.probability("existence below which a track ends", default=0.02, above=0, at_most=0.1)

    def start(self, existence):
        return Page(np.zeros(existence.shape), existence >= self.confirm)

    def predict(self, existence, dt):
        return existence * np.exp(-dt / self.lifetime)

    def review(self, memory, scan):
        due = np.clip(scan.p_detect, self.lost, 0.999)
        step = (1 - scan.hit) * np.log((1 - self.lost) / (1 - due)) + scan.hit * np.log(self.lost / due)
        statistic = np.maximum(memory.statistic + step, 0.0)
        confirmed = memory.confirmed | (scan.existence >= self.confirm)
        alive = (statistic <= self.alarm) & (scan.existence >= self.least)
        return Page(statistic, confirmed), confirmed, alive


COMPONENTS = (
    Foreign("leaky counter", "lifecycle", LeakyCounter),
    Foreign("detection rate", "lifecycle", DetectionRate),
    Foreign("Page's test", "lifecycle", PageTest),
)
