"""`--set path.to.key=value`."""

from __future__ import annotations

from typing import Any

import pytest

from vedette import ConfigError, Registry
from vedette.config import apply_overrides, load


def config() -> dict[str, Any]:
    return {
        "estimator": {
            "kind": "imm",
            "modes": [
                {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.05}},
                {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
            ],
            "transition": [[0.95, 0.05], [0.05, 0.95]],
        },
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}, "far lidar": {"kind": "cartesian_position"}},
        "associator": {"kind": "pda"},
        "birth": {"kind": "from_returns", "spread": {"vx": 10, "vy": 10}},
        "lifecycle": {"kind": "m_of_n", "hits": 4},
        "seed": 1,
    }


@pytest.mark.parametrize(
    ("override", "path", "value"),
    [
        ("seed=3", ["seed"], 3),
        ("estimator.modes[1].motion.sigma_accel=0.2", ["estimator", "modes", 1, "motion", "sigma_accel"], 0.2),
        ("estimator.transition[0][1] = 0.1", ["estimator", "transition", 0, 1], 0.1),
        ("estimator.transition=[[1, 0], [0, 1]]", ["estimator", "transition"], [[1, 0], [0, 1]]),
        ("estimator.modes[0]={kind='ukf'}", ["estimator", "modes", 0], {"kind": "ukf"}),
        ('sensors."far lidar".sigma=2', ["sensors", "far lidar", "sigma"], 2),
        ("sensors.'far lidar'.sigma=2", ["sensors", "far lidar", "sigma"], 2),
        ("title=a=b, c", ["title"], "a=b, c"),
        ('title="7"', ["title"], "7"),
        ("title=", ["title"], ""),
        ("title=2020-01-01", ["title"], "2020-01-01"),
        ("title=3\nseed = 4", ["title"], "3\nseed = 4"),
        ("source.path=../data/some folder", ["source", "path"], "../data/some folder"),
        ("sensors.radar.sigma=1.5 km", ["sensors", "radar", "sigma"], "1.5 km"),
        ("gate.probability=0.9", ["gate", "probability"], 0.9),
        ("sensors.radar2.kind=cartesian_position", ["sensors", "radar2", "kind"], "cartesian_position"),
        ("flag=true", ["flag"], True),
    ],
)
def test_one_value_is_set_and_nothing_else(registry: Registry, override: str, path: list[Any], value: object) -> None:
    changed: Any = apply_overrides(config(), [override], registry)
    wanted: Any = config()
    place = wanted
    for step in path[:-1]:
        place = place.setdefault(step, {}) if isinstance(place, dict) else place[step]
    place[path[-1]] = value
    assert changed == wanted
    assert type(value) is type(_at(changed, path))


def _at(value: Any, path: list[Any]) -> Any:
    for step in path:
        value = value[step]
    return value


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("seed", "must be written path.to.key=value"),
        ("=3", "must be written path.to.key=value"),
        ("a..b=3", "must be written path.to.key=value"),
        ("estimator.modes[-1].kind=ekf", "must be written path.to.key=value"),
        ("estimator.modes[2].kind=ekf", "estimator.modes has [0] to [1], there is no [2]"),
        ("estimator.modes.kind=ekf", "estimator.modes is a list of 2, so there is no 'kind' in it"),
        ("estimator[0]=ekf", "estimator is a table, not a list: there is no [0] in it"),
        ("[0]=ekf", "the config is a table, not"),
        ("seed.value=3", "seed is 1, so there is no 'value' in it"),
        ("lifecycle.hits[0]=3", "lifecycle.hits is 4, not a list"),
        ("sensors.radra.sigma=3", "there is no sensors.radra; did you mean 'radar'?"),
        ("estimatr.kind.x=3", "there is no estimatr; did you mean 'estimator'?"),
        ("estimator.mods[0].kind=ekf", "there is no list estimator.mods; did you mean 'modes'?"),
        ("judge[0]=3", "there is no list judge"),
        ("estimator.transition=[[1, 0], [.2, .8]]", "write 0.2, not .2"),
    ],
)
def test_a_wrong_path_is_told(registry: Registry, override: str, message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        apply_overrides(config(), [override], registry)
    assert str(caught.value).startswith(f"--set {override}: ")
    assert message in str(caught.value)


def test_a_name_that_holds_dots_is_told_to_be_quoted(registry: Registry) -> None:
    with pytest.raises(ConfigError, match=r'quoted: sensors\."a\.b"'):
        apply_overrides({**config(), "sensors": {"a.b": {}}}, ["sensors.a.b.sigma=3"], registry)


def test_all_wrong_overrides_are_told_together(registry: Registry) -> None:
    with pytest.raises(ConfigError) as caught:
        apply_overrides(config(), ["seed.x=3", "seed=4", "sensors[0]=1"], registry)
    assert [problem.place for problem in caught.value.problems] == ["--set seed.x=3", "--set sensors[0]=1"]


def test_a_path_through_a_ready_object_is_told(registry: Registry) -> None:
    ready = load(config(), registry, overrides=['sensors."far lidar".sigma=2']).tracker.associator
    with pytest.raises(ConfigError, match=r"associator is a Pda, so there.*'kind'"):
        apply_overrides({**config(), "associator": ready}, ["associator.kind=gnn"], registry)


def test_a_new_kind_drops_what_only_the_old_one_took(registry: Registry) -> None:
    changed = apply_overrides(config(), ["lifecycle.kind=single_target"], registry)
    assert changed["lifecycle"] == {"kind": "single_target"}
    kept = apply_overrides(config(), ["estimator.modes[1].kind=ukf"], registry)["estimator"]["modes"][1]
    assert kept == {"kind": "ukf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}}
    same = apply_overrides(config(), ["lifecycle.kind=m_of_n"], registry)
    assert same == config()


def test_a_new_kind_hides_no_mistake(registry: Registry) -> None:
    typo = {**config(), "lifecycle": {"kind": "m_of_n", "hitts": 3}}
    assert "hitts" in apply_overrides(typo, ["lifecycle.kind=single_target"], registry)["lifecycle"]
    unknown = apply_overrides(config(), ["lifecycle.kind=single_targt"], registry)
    assert unknown["lifecycle"]["hits"] == 4
    set_before = apply_overrides(config(), ["lifecycle.hits=2", "lifecycle.kind=single_target"], registry)
    assert set_before["lifecycle"]["hits"] == 2
    table = apply_overrides(config(), ["lifecycle={kind='m_of_n', hits=2}", "lifecycle.kind=single_target"], registry)
    assert table["lifecycle"] == {"kind": "single_target"}
    elsewhere = apply_overrides(config(), ["estimator.kind=kalman", "lifecycle.kind=single_target"], registry)
    assert "hits" not in elsewhere["lifecycle"]
    beside = apply_overrides(config(), ["associator.hits=2", "lifecycle.kind=single_target"], registry)
    assert "hits" not in beside["lifecycle"]  # a name that was set in another table


def test_overrides_are_applied_in_order(registry: Registry) -> None:
    changed = apply_overrides(
        config(), ["sensors.new.kind=cartesian_position", "sensors.new.sigma=1", "seed=2", "seed=5"], registry
    )
    assert changed["sensors"]["new"] == {"kind": "cartesian_position", "sigma": 1}
    assert changed["seed"] == 5
