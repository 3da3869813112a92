"""Lifecycles by the time since the last hit, by the last bits, by place, by spread, and one that never doubts."""

import numpy as np
from attrs import frozen

import vedette
from foreign import Foreign


@frozen(eq=False)
class Since:
    """Time without a hit and hits so far, both (*b, t)."""

    time: vedette.Array
    hits: vedette.Array


@frozen
class Recent(vedette.Lifecycle):
    """A track ends once it went without a hit for a time, and is confirmed after so many hits.

    Blackman, Multiple-Target Tracking with Radar Applications, 1986, section 4.2.
    """

    kind = "recent"
    certain = True
    silence: float = vedette.fields.quantity("s", "without a hit that ends a track", default=25, at_least=5, at_most=600)
    hits: int = vedette.fields.integer("that confirm, the first included", default=3, at_least=1, at_most=6)

    def start(self, existence):
        return Since(np.zeros(existence.shape), np.ones(existence.shape))

    def review(self, memory, scan):
        time = np.where(scan.hit >= 0.5, 0.0, memory.time + scan.dt)
        count = np.minimum(memory.hits + (scan.hit >= 0.5), 1000.0)
        return Since(time, count), count >= self.hits, time <= self.silence


@frozen
class Bits(vedette.Lifecycle):
    """The last looks as bits of one number: m of n confirm, `gone` zeros in a row end; out of sight, time ends it.

    Bar-Shalom, Willett, Tian, Tracking and Data Fusion, 2011, section 3.6 (M of N).
    """

    kind = "bits"
    certain = True
    n: int = vedette.fields.integer("looks that are remembered", default=6, at_least=3, at_most=12)
    m: int = vedette.fields.integer("of them that confirm", default=3, at_least=2, at_most=3)
    gone: int = vedette.fields.integer("looks without a hit that end a track", default=4, at_least=2, at_most=8)
    patience: float = vedette.fields.quantity("s", "out of sight until a track ends", default=40, at_least=5, at_most=600)

    def start(self, existence):
        bits = np.ones((*existence.shape, 12), dtype=bool)
        bits[..., 1:] = False
        return bits, np.zeros(existence.shape), np.zeros(existence.shape), np.zeros(existence.shape, dtype=bool)

    def review(self, memory, scan):
        bits, misses, unseen, confirmed = memory
        hit, looked = scan.hit >= 0.5, (scan.p_detect >= 0.05) | (scan.hit >= 0.5)
        pushed = np.concatenate([hit[..., None], bits[..., :-1]], axis=-1)
        bits = np.where(looked[..., None], pushed, bits)
        misses = np.where(looked, np.where(hit, 0.0, misses + 1), misses)
        unseen = np.where(looked, 0.0, unseen + scan.dt)
        confirmed = confirmed | (bits[..., : self.n].sum(axis=-1) >= self.m)
        return (bits, misses, unseen, confirmed), confirmed, (misses < self.gone) & (unseen <= self.patience)


@frozen
class InTheBay(vedette.Lifecycle):
    """Existence decides; a track also ends as soon as it is farther from a place than a reach.

    Musicki, Evans, Joint Integrated Probabilistic Data Association, IEEE T-AES 40, 2004.
    """

    kind = "in_the_bay"
    needs_place = True
    reach: float = vedette.fields.quantity("m", "from the origin", default=20_000, at_least=15_000, at_most=1e6)
    stay: float = vedette.fields.quantity(
        "s", "mean time for which a target is there", default=400, at_least=20, at_most=1e5
    )
    confirm: float = vedette.fields.probability("existence that confirms", default=0.9, at_least=0.6, at_most=0.99)
    end: float = vedette.fields.probability("existence below which a track ends", default=0.03, at_least=1e-3, at_most=0.2)

    @property
    def least_existence(self):
        return self.end

    def start(self, existence):
        return None

    def predict(self, existence, dt):
        return existence * np.exp(-dt / self.stay)

    def review(self, memory, scan):
        near = np.linalg.norm(scan.place, axis=-1) <= self.reach
        return None, scan.existence >= self.confirm, (scan.existence >= self.end) & near


@frozen
class Sharp(vedette.Lifecycle):
    """A track lives while its position is known to a limit, and is confirmed once it was known to a third of it.

    Blackman, Popoli, Design and Analysis of Modern Tracking Systems, 1999, section 6.2.
    """

    kind = "sharp"
    certain = True
    needs_spread = True
    max_spread: float = vedette.fields.quantity("m", "deviation beyond which it ends", default=300, at_least=50, at_most=1e4)
    lonely: float = vedette.fields.quantity("s", "without a return that would be due", default=60, at_least=10, at_most=1e3)

    def start(self, existence):
        return np.zeros(existence.shape), np.zeros(existence.shape, dtype=bool)

    def review(self, memory, scan):
        lonely, confirmed = memory
        lonely = np.where(scan.hit >= 0.5, 0.0, lonely + scan.dt)
        confirmed = confirmed | ((scan.spread <= self.max_spread / 3) & (scan.hit >= 0.5))
        return (lonely, confirmed), confirmed, (scan.spread <= self.max_spread) & (lonely <= self.lonely)


@frozen
class Roster(vedette.Lifecycle):
    """A list of targets that are known to be there: all are confirmed and none ends.

    Blackman, Popoli, Design and Analysis of Modern Tracking Systems, 1999, section 1.3 (fixed number of targets).
    """

    kind = "roster"
    certain = permanent = True

    def start(self, existence):
        return None

    def review(self, memory, scan):
        all_of = np.ones(scan.existence.shape, dtype=bool)
        return None, all_of, all_of


@frozen
class Markov(vedette.Lifecycle):
    """Existence fades with time; a confirmed track stays so while it may exist at all, if `ever`.

    Musicki, Evans, Stankovic, Integrated Probabilistic Data Association, IEEE T-AC 39, 1994 (Markov chain one).
    """

    kind = "markov_existence"
    stay: float = vedette.fields.quantity("s", "after which 1/e of the doubt is left", default=300, at_least=20, at_most=1e4)
    confirm: float = vedette.fields.probability("existence that confirms", default=0.95, at_least=0.7, at_most=0.99)
    end: float = vedette.fields.probability("existence below which a track ends", default=0.02, at_least=1e-3, at_most=0.1)
    ever: bool = vedette.fields.flag("once confirmed, always confirmed", default=True)

    @property
    def least_existence(self):
        return self.end

    def start(self, existence):
        return existence >= self.confirm

    def predict(self, existence, dt):
        return existence * np.exp(-dt / self.stay)

    def review(self, memory, scan):
        above = scan.existence >= self.confirm
        kept = (memory | above) & (scan.existence > 0) if self.ever else above
        return kept, kept, scan.existence >= self.end


@frozen
class Minutes(vedette.Lifecycle):
    """Existence decides; times are in minutes.

    BIPM, The International System of Units, 2019, table 8.
    """

    kind = "minutes"
    lifetime: float = vedette.fields.quantity("min", "mean time of a target", default=10, at_least=1, at_most=100)
    max_out_of_coverage: float = vedette.fields.quantity(
        "min", "out of sight until it ends", default=1, at_least=0.5, at_most=9
    )

    def start(self, existence):
        return np.zeros(existence.shape)

    def predict(self, existence, dt):
        return existence * np.exp(-dt / 60 / self.lifetime)

    def review(self, memory, scan):
        unseen = np.where((scan.p_detect > 0.01) | (scan.hit > 0.5), 0.0, memory + scan.dt / 60)
        return unseen, scan.existence > 0.9, (scan.existence > 0.01) & (unseen <= self.max_out_of_coverage)


COMPONENTS = (
    Foreign("recent", "lifecycle", Recent),
    Foreign("bits", "lifecycle", Bits),
    Foreign("in the bay", "lifecycle", InTheBay),
    Foreign("sharp", "lifecycle", Sharp),
    Foreign("roster", "lifecycle", Roster),
    Foreign("Markov existence", "lifecycle", Markov),
    Foreign("minutes", "lifecycle", Minutes),
)
