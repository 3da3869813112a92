"""What a draft states of motion and detector, chosen by how likely it finds a file's boxes, each from those before it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from attrs import asdict, evolve, frozen

from vedette.types import Scan
from vedette_tools.drafting.trial import tried

FRAMES = 400
"""So many frames, the first, decide; some tenth of a second of computing for each trial over them."""

ROUNDS, DOUBLINGS = 2, 6
"""Each number is changed in turn, so many times around, and so often in a turn: without errors likelihood has no top."""


@frozen
class Guess:
    """Numbers of a draft, in the units of its config; `detected` is a probability, or 0 if it is known from true boxes."""

    accel: float = 0.5
    growth: float = 0.2
    in_sight: float = 2.0
    hidden: float = 0.5
    detected: float = 0.0
    false: float = 0.0

    @property
    def numbers(self) -> dict[str, float]:
        """Those that are to be found."""
        return asdict(self, filter=lambda _, value: bool(value))

    def changed(self, name: str, factor: float) -> Guess:
        """Return the same with a number times `factor`; of a probability, its odds."""
        value = getattr(self, name)
        if name == "detected":
            odds = value / (1.0 - value) * factor
            return evolve(self, detected=odds / (1.0 + odds))
        return evolve(self, **{name: value * factor})


def likeliest(first: Guess, text: Callable[[Guess], str], scans: Sequence[Scan]) -> Guess:
    """Return the guess that finds the first frames likeliest, by doubling and halving one number after the other.

    `text` gives the config, as TOML, of a guess. Of a config that cannot run on the frames, it is the first.
    """
    known: dict[Guess, float] = {}

    def loglik(guess: Guess) -> float:
        if guess not in known:
            trial = tried(text(guess), scans[:FRAMES])
            known[guess] = -float("inf") if trial is None else trial.loglik
        return known[guess]

    best = first
    for _ in range(ROUNDS):
        for name in first.numbers:
            up, down = best.changed(name, 2.0), best.changed(name, 0.5)
            factor, after = (2.0, up) if loglik(up) >= loglik(down) else (0.5, down)
            for _ in range(DOUBLINGS):
                if loglik(after) <= loglik(best) + 1e-9 * abs(loglik(best)):
                    break
                best, after = after, after.changed(name, factor)
    return best
