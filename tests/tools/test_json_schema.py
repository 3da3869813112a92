"""The JSON Schema of what is installed agrees with what builds."""

from __future__ import annotations

from typing import Any, ClassVar

import attrs
import pytest
from attrs import frozen
from jsonschema import Draft202012Validator

from vedette import Array, Associator, ConfigError, Registry
from vedette.config import load, to_config
from vedette_tools.json_schema import schema


@frozen
class Spot(Associator):
    """A third party's parameter that has a converter of its own.

    More text.
    """

    kind: ClassVar[str] = "spot"
    where: float = attrs.field(converter=lambda text: float(text.partition(":")[2]))

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        return scores


@pytest.fixture(scope="module")
def registry() -> Registry:
    installed = Registry.installed()
    return Registry((*installed, *Registry.of(Spot)))


@pytest.fixture(scope="module")
def validator(registry: Registry) -> Draft202012Validator:
    document = schema(registry)
    Draft202012Validator.check_schema(document)
    return Draft202012Validator(document)


def config(**more: Any) -> dict[str, Any]:
    straight = {"kind": "constant_velocity", "sigma_accel": 0.05}
    turning = {"kind": "coordinated_turn", "sigma_accel": "0.1 g", "sigma_turn_rate": 0.01}
    return {
        "estimator": {
            "kind": "imm",
            "modes": [{"kind": "ukf", "motion": straight}, {"kind": "ekf", "motion": turning}],
            "transition": [[0.95, 0.05], [0.05, 0.95]],
            "absent": {"turn_rate": [0, 0.01]},
        },
        "sensors": {
            "radar": {"kind": "range_bearing", "sigma_range": " 1e1 m", "sigma_bearing": "0.5 deg", "max_range": 1e4}
        },
        "associator": {"kind": "pda"},
        "birth": {"kind": "from_returns", "spread": {"vx": 10, "vy": 5, "turn_rate": "0.01"}},
        "lifecycle": {"kind": "m_of_n"},
        **more,
    }


SPOT = {"kind": "spot", "where": "at:3"}

RIGHT: list[dict[str, Any]] = [
    {},
    {"gate": {"probability": 0.9, "clutter": "nonparametric"}, "title": "x", "seed": 3, "judge": {"cover_radius": 20}},
    {"birth": {"kind": "from_returns", "spread": {"vx": "3", "vy": 4, "turn_rate": 1e-2}, "sensors": ["radar"]}},
    {"associator": SPOT},
    {"seed": "3", "$schema": "vedette.json"},
    {"source": None},
    {"gate": "off"},
]

WRONG: list[dict[str, Any]] = [
    {"estimator": {"kind": "immm"}},
    {"estimator": {"kind": "ekf"}},
    {"estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0}}},
    {"estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": "1 kg"}}},
    {"estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": True}}},
    {"estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_acel": 1}}},
    {"estimator": {"kind": "imm", "modes": {"kind": "ekf"}, "transition": [[1.0]]}},
    {"estimator": {"kind": "imm", "modes": [], "transition": [1.0]}},
    {"sensors": [{"kind": "cartesian_position", "sigma": 1}]},
    {"sensors": {"radar": "cartesian_position"}},
    {"associator": {"kind": "ekf"}},
    {"associator": "pda"},
    {"gate": {"probability": 1.5}},
    {"gate": "of"},
    {"gate": {"clutter": "sensr"}},
    {"birth": {"kind": "from_returns", "spread": [1, 2]}},
    {"lifecycle": {"kind": "m_of_n", "hits": 0}},
    {"lifecycle": {"kind": "m_of_n", "hits": 1.5}},
    {"seed": "one"},
    {"title": 3},
    {"tracker": {}},
    {"sede": 3},
]


@pytest.mark.parametrize("more", RIGHT)
@pytest.mark.costly
def test_right_configs_validate_and_build(more: dict[str, Any], registry: Registry, validator: Any) -> None:
    validator.validate(config(**more))
    validator.validate(
        {"associator": {"kind": "pda"}, **to_config(load(config(**{**more, "associator": {"kind": "pda"}}), registry))}
    )


@pytest.mark.parametrize("more", WRONG)
@pytest.mark.costly
def test_wrong_configs_neither_validate_nor_build(more: dict[str, Any], registry: Registry, validator: Any) -> None:
    assert not validator.is_valid(config(**more))
    with pytest.raises(ConfigError):
        load(config(**more), registry)


def test_what_is_missing_is_required(registry: Registry, validator: Any) -> None:
    for name in ("estimator", "sensors", "associator", "lifecycle"):
        less = config()
        del less[name]
        assert not validator.is_valid(less)
        with pytest.raises(ConfigError, match=f"^{name}: missing"):
            load(less, registry)


def test_every_installed_component_is_in_it_with_its_words(registry: Registry) -> None:
    definitions = schema(registry)["$defs"]
    for entry in registry:
        table = definitions[f"{entry.role}.{entry.kind}"]
        assert {"$ref": f"#/$defs/{entry.role}.{entry.kind}"} in definitions[entry.role]["oneOf"]
        own = [] if entry.role == "command" else [parameter.name for parameter in entry.parameters]
        assert list(table["properties"])[: 1 + len(entry.parameters)] == ["kind", *own]
        assert table["description"] == entry.summary
    sigma = definitions["motion.constant_velocity"]["properties"]["sigma_accel"]
    assert sigma["description"].endswith("in m/s^1.5")
    assert sigma["anyOf"][0] == {"type": "number", "exclusiveMinimum": 0}


def test_a_role_that_nothing_plays_takes_nothing() -> None:
    assert schema(Registry.of(Spot))["$defs"]["motion"] == {"not": {}}
