"""Hits against the detection probability, and false returns against the clutter density, that a tracker declares."""

from __future__ import annotations

from vedette.metrics.consistency import Verdict
from vedette.testing.bands import binomial_band
from vedette.testing.montecarlo import Runs


def hits_verdicts(played: Runs, share: float) -> list[Verdict]:
    """Judge for each sensor how often it detected the target, by the binomial's exact tails.

    Where the probability depends on the state the sum's tails lie within those of its mean.
    Hoeffding, On the Distribution of the Number of Successes in Independent Trials, Annals of Math. Statistics 27, 1956.
    """
    verdicts = []
    for name, looks in played.looks.items():
        count, declared, each = looks.seen.size, float(looks.declared.mean()), share / len(played.looks)
        low, high = binomial_band(count, declared, each)
        figure = float(looks.seen.mean())
        text = f"hits of {name}: {figure:.3g} a look, declared {declared:.3g}, band {low:.3g} to {high:.3g}"
        if not low <= figure <= high:
            text += f": the detection probability is too {'small' if figure > high else 'large'}"
        verdicts.append(Verdict("hits", figure, low, high, each, text))
    return verdicts


def returns_verdicts(played: Runs, share: float) -> list[Verdict]:
    """Judge for each sensor with clutter how many false returns came, by the binomial's exact tails.

    Clutter is thinned from candidates, each of which is one with the density there over a bound: so it is counted.
    """
    verdicts = []
    for name, looks in played.looks.items():
        count, expected, each = int(looks.candidates.sum()), float(looks.expected.sum()), share / len(played.looks)
        if not count:
            continue
        false = float(looks.false.sum())
        low, high = binomial_band(count, expected / count, each)
        scale = count / expected if expected else 1.0
        figure, low, high = scale * false / count, scale * low, scale * high
        text = f"false returns of {name}: {false:.0f}, {expected:.0f} by its clutter density, band {low:.3g} to {high:.3g}"
        if not low <= figure <= high:
            size = f"{figure:.3g} times too small" if figure > high else f"{1 / max(figure, 1e-300):.3g} times too large"
            text += f": the density is {size}" if expected else ": it declares none"
        verdicts.append(Verdict("false returns", figure, low, high, each, text))
    return verdicts
