"""What a law is, how often it is tried, and the probability that a correct component fails it."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from operator import attrgetter
from typing import Any, Literal

from attrs import evolve, field, frozen

from vedette.testing.comparisons import Misuse


@frozen
class Profile:
    """How thoroughly the kit tests.

    `examples` of an exact law, `trials` of a statistical one, each of `runs` runs; `steps` of the long run.
    `alpha` is the probability that one statistical test fails a correct component. `shrink`: look for a small
    counterexample. `seconds` of CPU time that a law may take.
    """

    name: str
    examples: int
    trials: int
    runs: int
    steps: int
    alpha: float = 1e-7
    seed: int = 0
    shrink: bool = True
    seconds: float = 60.0

    @classmethod
    def named(cls, name: str, seed: int = 0) -> Profile:
        """Return `fast` for every commit, or `nightly` for a thorough test."""
        known = {profile.name: profile for profile in (FAST, NIGHTLY)}
        if name not in known:
            raise Misuse(f"profile: must be one of {', '.join(map(repr, known))}, got {name!r}")
        return evolve(known[name], seed=seed)


FAST = Profile("fast", examples=20, trials=2, runs=400, steps=3_000)
NIGHTLY = Profile("nightly", examples=400, trials=10, runs=6000, steps=10_000, seconds=1200.0)

Effort = Literal["exact", "statistical", "long", "shown"]


@frozen
class Law:
    """A sentence, and a function of a component and drawn data that raises Broken where the sentence is false.

    `needs` names the attribute of the component without which the law does not apply (`divisible`, `traits.draws`), or with
    which (`not draws`). An `exact` law is tried on one `share`th of the examples. A `statistical` one may fail a correct
    component with the profile's alpha. A `long` one is tried once, and so is a `shown` one, on what the component's class
    shows and not on what is drawn.
    """

    check: Callable[[Any, Any], None]
    needs: str = ""
    effort: Effort = "exact"
    share: int = 1
    name: str = field(init=False)

    @name.default
    def _name(self) -> str:
        return self.check.__name__

    @property
    def sentence(self) -> str:
        """What the law says."""
        return inspect.cleandoc(self.check.__doc__ or "").partition("\n")[0]

    @property
    def lacks(self) -> str:
        """Why it does not apply to a component that is not as it `needs`."""
        name = self.needs.removeprefix("not ")
        return f"it {'does not declare' if name == self.needs else 'declares'} `{name.rpartition('.')[2]}`"

    def applies(self, component: Any) -> bool:
        """Return whether a component is as it `needs`."""
        name = self.needs.removeprefix("not ")
        return not name or bool(attrgetter(name)(component)) is (name == self.needs)

    def examples(self, profile: Profile) -> int:
        """Return how often it is tried."""
        return {"exact": -(-profile.examples // self.share), "statistical": profile.trials}.get(self.effort, 1)
