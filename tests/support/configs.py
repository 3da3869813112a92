"""Tables inside tables, as components have them, and a whole config."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import attrs
from attrs import frozen

from vedette import Array, Associator, Registry, fields
from vedette.config.builder import Builder
from vedette.config.parameters import parameters


@frozen
class Rate:
    """A table inside a table."""

    per_scan: float = fields.quantity("1", "how many", at_least=0)


@frozen
class Region:
    """A plain table."""

    width: float = fields.quantity("m", "east to west", above=0)
    corners: Array | None = fields.array("m", "a matrix", ndim=2, default=None)
    rates: dict[str, Rate] = fields.part("a table of tables", default=attrs.Factory(dict))


def _lower(instance: Any, attribute: attrs.Attribute[Any], value: float) -> None:
    if value > instance.high:
        raise ValueError(f"low: must be at most high, got {value:g} > {instance.high:g}")


@frozen
class Band(Associator):
    """Every shape that a parameter can have, and a rule across two of them."""

    kind: ClassVar[str] = "band"

    low: float = attrs.field(converter=float, validator=_lower)
    high: float = fields.quantity("1", "upper end")
    region: Region | None = fields.part("optional table", default=None)
    inner: Associator | None = fields.part("optional component", default=None)
    several: tuple[Associator, ...] = fields.part("list of components", default=())
    named: Mapping[str, Associator] = fields.part("table of components", default=attrs.Factory(dict))
    _hidden: int = fields.integer("a private name", default=3)
    words: tuple[str, ...] = fields.words("a list", default=())

    def __attrs_post_init__(self) -> None:
        if len(self.several) > 2:
            raise ValueError(f"several[2]: must be two at most, got {len(self.several)}")
        if self._hidden > 100:
            raise ValueError(f"_hidden: must be 100 at most, got {self._hidden}")
        if self.high > 1000:
            raise ValueError("the band is too high as a whole")

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        return scores


SMALL = Registry.of(Band)
LEAST = {"kind": "band", "low": 1, "high": 2}


def walk(config: Mapping[str, Any], registry: Registry = SMALL) -> Any:
    """The band of a config, or the problems' lines."""
    builder, own = Builder(registry), parameters(Band)
    meant = builder.check_names(config, ["kind", *(parameter.name for parameter in own)], "", "band")
    built = builder.construct(Band, own, config, "", meant)
    return [str(problem) for problem in builder.problems] or built


def tracker_config() -> dict[str, Any]:
    return {
        "estimator": {
            "kind": "imm",
            "modes": [
                {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.05}},
                {"kind": "ukf", "motion": {"kind": "coordinated_turn", "sigma_accel": "0.02 g", "sigma_turn_rate": 0.01}},
            ],
            "transition": [[0.95, 0.05], [0.05, 0.95]],
            "absent": {"turn_rate": [0.0, 0.01]},
        },
        "sensors": {
            "radar": {"kind": "range_bearing", "sigma_range": 10.0, "sigma_bearing": "0.5 deg", "max_range": "10 NM"},
            "lidar": {"kind": "cartesian_position", "sigma": 1},
        },
        "gate": {"probability": 0.95, "clutter": "nonparametric"},
        "associator": {"kind": "pda"},
        "birth": {"kind": "from_returns", "spread": {"vx": 10, "vy": 10, "turn_rate": 0.01}},
        "lifecycle": {"kind": "m_of_n"},
    }


def experiment_config() -> dict[str, Any]:
    return {**tracker_config(), "title": "two sensors", "seed": 7, "judge": {"cover_radius": 30}}
