"""Components of a study broken one at a time: each break names beforehand the claims whose verdicts it moves."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
import pytest
from attrs import evolve, frozen

from vedette import Gaussian
from vedette_report.findings import Cell, Claim


@frozen
class Break:
    """What replaces an attribute of a component's class or module, made from the right one; the claims it moves."""

    cls: Any
    name: str
    wrong: Callable[[Any], Any]
    moves: tuple[str, ...]


def sure(figures: Mapping[Any, Cell]) -> dict[Any, Cell]:
    """Return the figures, trimmed where they are, as if they were without chance, so that few runs decide."""
    values = {key: cell.measured if cell.trimmed is None else cell.trimmed[0] for key, cell in figures.items()}
    return {key: evolve(cell, measured=values[key], error=0.0, trimmed=None) for key, cell in figures.items()}


def verdicts(claims: Iterable[Claim]) -> dict[str, str]:
    """Return text to verdict of what is judged, with remarks as such."""
    return {claim.text: claim.verdict for claim in claims}


def moved(study: Callable[[], Mapping[str, str]], right: Mapping[str, str], broken: Break) -> set[str]:
    """Return the claims whose verdict differs from the right one while the component is broken."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(broken.cls, broken.name, broken.wrong(getattr(broken.cls, broken.name)))
        if hasattr(broken.cls, "twin"):
            patch.setattr(broken.cls, "twin", None)  # what is compiled is not broken
        now = study()
    return {text for text, verdict in right.items() if now[text] != verdict}


def named(claims: Iterable[str], beginnings: Iterable[str]) -> set[str]:
    """Return the claims that begin so; each beginning must be that of one."""
    found = {begin: [text for text in claims if text.startswith(begin)] for begin in beginnings}
    assert all(len(texts) == 1 for texts in found.values()), found
    return {text for texts in found.values() for text in texts}


def made_of(elements: Iterable[Any]) -> set[str]:
    """Return all components that a paper's elements name, as "role kind"."""
    return {part for element in elements for part in element.made_of}


def blind(right: Callable[..., Any]) -> Callable[..., Any]:
    """Break an associator: it sees no return."""
    return lambda self, scores, evidence: right(self, np.where(np.arange(scores.shape[-1]) > 0, -np.inf, scores), evidence)


def straight_for_ever(right: Callable[..., Any]) -> Callable[..., Any]:
    """Break an IMM: its first mode is all but certain."""

    def update(self: Any, belief: Any, innovation: Any, weights: Any) -> Any:
        made = right(self, belief, innovation, weights)
        first = np.arange(made.log_prob.shape[-1]) == 0
        return evolve(made, log_prob=np.broadcast_to(np.where(first, -1e-9, -40.0), made.log_prob.shape))

    return update


def too_sure(right: Callable[..., Any]) -> Callable[..., Any]:
    """Break a Kalman filter: what it predicts has a fifth of the covariance."""

    def predict(self: Any, belief: Any, dt: Any, rng: Any) -> Any:
        made = right(self, belief, dt, rng)
        return Gaussian(made.mean, made.cov if dt == 0 else 0.2 * made.cov)

    return predict
