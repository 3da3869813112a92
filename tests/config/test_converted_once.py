"""A value of a config is converted once where it is right, and judged with all the others where one is wrong."""

from __future__ import annotations

from typing import Any, ClassVar

import attrs
import numpy as np
import pytest
from attrs import frozen

import vedette
from vedette import Array, Associator, ConfigError, Registry, fields
from vedette.config.builder import Builder
from vedette.config.parameters import parameters

SEEN: list[Any] = []


def noted(value: Any) -> Any:
    SEEN.append(value)
    if value == "bad":
        raise ValueError("must not be bad")
    return f"read {value}"


@frozen
class Noting(Associator):
    """Notes what its converter is given."""

    kind: ClassVar[str] = "noting"
    first: Any = attrs.field(converter=noted)
    second: float = fields.quantity("m", "a length", above=0)
    inner: Inner | None = fields.part("a table", default=None)
    last: int = fields.integer("a count", default=1)

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        return np.full_like(scores, 1 / scores.shape[-1])


@frozen
class Inner:
    """A table within."""

    depth: Any = attrs.field(converter=noted)


@pytest.fixture(autouse=True)
def forgotten() -> None:
    SEEN.clear()


def walked(**given: Any) -> tuple[Any, list[str]]:
    builder = Builder(Registry.of(Noting))
    built = builder.construct(Noting, parameters(Noting), given, "", set())
    return built, [str(problem) for problem in builder.problems]


def test_each_value_is_converted_once() -> None:
    built, problems = walked(first=1, second="3 km", inner={"depth": 2})
    assert problems == []
    assert (built.first, built.second, built.inner.depth) == ("read 1", 3000.0, "read 2")
    assert sorted(SEEN) == [1, 2]


def test_every_wrong_value_is_told_in_the_order_of_the_class() -> None:
    _, problems = walked(first="bad", inner={"depth": "bad"}, last=-1)
    assert [problem.split(":")[0] for problem in problems] == ["first", "second", "inner.depth", "last"]
    assert problems[1] == "second: missing: a length, in m"


def test_a_study_sweeps_values_as_they_are() -> None:
    config = {
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1}},
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
        "associator": {"kind": "nearest"},
        "birth": {"kind": "from_returns", "spread": {"vx": 10, "vy": 10}},
        "lifecycle": {"kind": "m_of_n"},
    }
    from vedette.config.overrides import apply_changes

    for value in (None, 0.1 + 0.2, "3", "true", "[1, 2", {"x": None}, [[1, 2], [3, 4]], 10**20, "a\nb"):
        changed = apply_changes(config, [("title", value)])
        assert changed["title"] is value
    with pytest.raises(ConfigError, match=r"^seed=3: must be a path\.to\.key"):
        apply_changes(config, [("seed=3", 3)])
    with pytest.raises(ConfigError, match=r"^sensors\.radra\.sigma: there is no sensors\.radra.*'radar'"):
        apply_changes(config, [("sensors.radra.sigma", 3)])
    assert vedette.load(apply_changes(config, [("associator.kind", "gnn")])).tracker.associator.kind == "gnn"
