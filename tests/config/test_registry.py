"""What is installed: classes are checked when they are registered."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, ClassVar

import attrs
import numpy as np
import pytest
from attrs import frozen

import vedette
from vedette import Array, Associator, ConfigError, MotionModel, PluginError, Registry, Sensor, Space, fields
from vedette.config.parameters import ROLES
from vedette.roles import Component


@frozen
class Still(MotionModel):
    """Nothing moves.

    For tests.
    """

    kind: ClassVar[str] = "still"
    factor: float = fields.quantity("1", "without a default")
    sigma: float = fields.quantity("m", "standard deviation", above=0, default=2.0)

    @property
    def state(self) -> Space:
        return Space.of(x="m")

    def move(self, x: Array, dt: float) -> Array:
        return x

    def noise(self, x: Array, dt: float) -> Array:
        return np.eye(1)


@frozen
class AlsoStill(Still):
    """Takes the same name."""


@frozen
class Even(Associator):
    """All alike."""

    kind: ClassVar[str] = "still"

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        return np.full_like(scores, 1 / scores.shape[-1])


class Plain(Even):
    """Derived, but not made an attrs class itself."""


@frozen
class Half(MotionModel):
    """Lacks two methods."""

    kind: ClassVar[str] = "half"

    def noise(self, x: Array, dt: float) -> Array:
        return np.eye(1)


@frozen
class Nameless(Associator):
    """Has no kind."""

    associate = Even.associate


@frozen
class Homeless(Component):
    """Plays no role."""

    kind: ClassVar[str] = "homeless"


@frozen
class Unchecked(Even):
    """A parameter that takes whatever comes."""

    sigma: float = attrs.field()


@frozen
class Unresolved(Even):
    """An annotation that leads nowhere."""

    sigma: Nowhere = fields.quantity("m", "unknown")  # type: ignore[name-defined]  # noqa: F821


@frozen
class Buried(Even):
    """A part where a config cannot reach it."""

    sensors: list[Sensor] = fields.part("many")


@frozen
class Inner:
    """A table with a parameter that nothing checks."""

    depth: float = attrs.field()


@frozen
class Outer(Even):
    """Holds such a table."""

    inner: Inner | None = fields.part("a table", default=None)


@frozen
class KindTaken(Even):
    """Has a parameter where configs look for the kind."""

    kind_of_thing: float = attrs.field(alias="kind", converter=float)


def test_components_are_found_by_role_and_kind() -> None:
    registry = Registry.of(Even, Still)
    assert registry.get("motion", "still").cls is Still
    assert registry.get("associator", "still").cls is Even
    assert [(entry.role, entry.kind) for entry in registry] == [("motion", "still"), ("associator", "still")]
    assert registry.find("sensor", "still") is None


def test_a_listing_says_all_that_a_user_needs() -> None:
    (entry,) = Registry.of(Still)
    assert json.loads(json.dumps(entry.describe())) == {
        "role": "motion",
        "kind": "still",
        "distribution": "given here",
        "version": "",
        "summary": "Nothing moves.",
        "parameters": [
            {"name": "factor", "type": "number", "unit": "1", "doc": "without a default", "required": True},
            {
                "name": "sigma",
                "type": "number",
                "unit": "m",
                "doc": "standard deviation",
                "required": False,
                "default": 2.0,
                "limits": {"above": 0},
            },
        ],
    }


def test_a_role_added_later_needs_no_change(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(PluginError, match=r"Homeless.*none of the roles"):
        Registry.of(Homeless)
    monkeypatch.setitem(ROLES, "home", Homeless)
    assert Registry.of(Homeless).get("home", "homeless").cls is Homeless


@pytest.mark.parametrize(
    ("classes", "message"),
    [
        ((Still, AlsoStill), r"motion kind 'still' is brought by .*Still\)"),
        ((Half,), "incomplete; a motion must also define"),
        ((Plain,), "Plain.*not an attrs class"),
        ((Nameless,), "Nameless.*has no `kind"),
        ((Homeless,), "plays none of the roles"),
        ((Unchecked,), "sigma: nothing checks"),
        ((Unresolved,), "annotations cannot be resolved: .*Nowhere"),
        ((Buried,), r"sensors: a config cannot fill list\[.*use X"),
        ((Outer,), "Outer.*Inner: depth: nothing checks"),
        ((KindTaken,), "`kind` must be a ClassVar"),
        ((Even(),), "is not a class"),
        ((int,), "int.*plays none of the roles"),
    ],
)
def test_a_class_that_breaks_the_contract_is_refused_at_once(classes: tuple[Any, ...], message: str) -> None:
    with pytest.raises(PluginError, match=message):
        Registry.of(*classes)


def test_what_is_missing_is_told_with_what_there_is() -> None:
    registry = Registry.of(Still, Even)
    with pytest.raises(ConfigError, match=r"motion: unknown kind 'stil'; did you mean 'still'\?"):
        registry.get("motion", "stil")
    with pytest.raises(ConfigError, match="sensor: unknown kind 'still'; it is a kind"):
        registry.get("sensor", "still")
    with pytest.raises(ConfigError, match=r"sensors: is not a role.*'sensor'"):
        registry.get("sensors", "radar")


def test_the_registry_is_a_value() -> None:
    assert Registry.of(Still, Even) == Registry.of(Even, Still)
    assert Registry.of(Still) != Registry.of(Even)
    with pytest.raises(attrs.exceptions.FrozenInstanceError):
        Registry.of(Still).entries = ()  # type: ignore[misc]


def test_everything_of_this_distribution_is_registered() -> None:
    registry = Registry.installed()
    assert [str(plugin) for plugin in registry.broken] == []
    brought = {entry.cls.__module__.partition(".")[0] for entry in registry if entry.distribution == "vedette"}
    roots = [Path(vedette.__file__).parents[1], *(Path(vedette.__file__).parents[2] / f for f in ("plugins", "simulators"))]
    packages = {folder.name for root in roots for folder in root.glob("vedette*") if (folder / "__init__.py").is_file()}
    assert brought == packages - {"vedette_adapters"}, "which brings no component"
