"""Keys of the first contract are read as those of the second: a lifecycle's own births, and both given."""

import pytest

import vedette
from vedette import ConfigError

PARTS = {
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
    "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
    "associator": {"kind": "pda"},
}
SPREAD = {"vx": 3.0, "vy": 4.0}
PLACE = SPREAD | {"x": 1.0, "y": 2.0}


@pytest.mark.parametrize(
    ("old", "birth", "lifecycle"),
    [
        ({"kind": "m_of_n", "spread": SPREAD}, {"kind": "from_returns", "spread": SPREAD}, {"kind": "m_of_n"}),
        (
            {"kind": "existence", "spread": SPREAD, "initial": 0.4, "lifetime": 50.0},
            {"kind": "from_returns", "spread": SPREAD, "initial": 0.4},
            {"kind": "existence", "lifetime": 50.0},
        ),
        ({"kind": "score", "spread": SPREAD}, {"kind": "from_returns", "spread": SPREAD, "initial": 0.1}, {"kind": "score"}),
        (
            {"kind": "single_target", "spread": PLACE, "offset": {"x": 5.0}},
            {"kind": "given", "spread": PLACE, "offset": {"x": 5.0}},
            {"kind": "single_target"},
        ),
    ],
    ids=lambda part: part["kind"],
)
def test_an_old_lifecycle_builds_the_birth_that_goes_with_it(old, birth, lifecycle):
    new = vedette.build(PARTS | {"birth": birth, "lifecycle": lifecycle})
    assert vedette.build(PARTS | {"lifecycle": old}) == new


def test_an_override_of_the_lifecycle_takes_its_birth_along():
    config = PARTS | {"lifecycle": {"kind": "existence", "spread": PLACE, "initial": 0.4}}
    changed = vedette.load(config, overrides=["lifecycle.kind=single_target", "lifecycle.offset={x=5.0}"]).tracker
    given = {"kind": "given", "spread": PLACE, "offset": {"x": 5.0}}
    assert changed == vedette.build(PARTS | {"birth": given, "lifecycle": {"kind": "single_target"}})


def test_both_names_are_an_error():
    twice = PARTS | {"birth": {"spread": SPREAD}, "lifecycle": {"kind": "m_of_n", "spread": SPREAD}}
    with pytest.raises(ConfigError, match=r"lifecycle\.spread: is the old name of `birth\.spread`.*`birth\.spread`"):
        vedette.build(twice)
    with pytest.raises(ConfigError, match=r"detectors: is the old name of `preprocessors`.*`preprocessors`"):
        vedette.build(PARTS | {"lifecycle": {"kind": "m_of_n", "spread": SPREAD}, "detectors": {}, "preprocessors": {}})
