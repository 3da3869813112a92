"""What an unknown name was meant to be, also where it is the field's short one."""

import pytest

import vedette
from vedette import fields
from vedette.config.suggestions import nearest, which_kind
from vedette.units import in_unit, spellings
from vedette_tools.json_schema import schema

REGISTRY = vedette.Registry.installed()


@pytest.mark.parametrize(
    ("role", "given", "meant"),
    [
        ("associator", "JPDA", "jpda"),
        ("associator", "jpdaf", "jpda"),
        ("associator", "PDAF", "pda"),
        ("associator", "NN", "nearest"),
        ("estimator", "EKF", "ekf"),
        ("estimator", "KF", "kalman"),
        ("estimator", "imm ", "imm"),
        ("motion", "cv", "constant_velocity"),
        ("motion", "CA", "constant_acceleration"),
        ("motion", "CT", "coordinated_turn"),
        ("motion", "Constant Velocity", "constant_velocity"),
        ("lifecycle", "M-of-N", "m_of_n"),
        ("lifecycle", "IPDA", "existence"),
    ],
)
def test_the_fields_short_names_are_understood(role, given, meant):
    assert which_kind(given, REGISTRY.of_role(role)) == f" did you mean {meant!r}?"


@pytest.mark.parametrize("given", ["", "c", "F", "xyz", "9"])
def test_what_resembles_nothing_gets_no_question(given):
    assert all(which_kind(given, REGISTRY.of_role(role)) == "" for role in ("motion", "associator", "estimator"))


def test_every_abbreviation_is_of_one_kind_and_no_kind_itself():
    told = [name for entry in REGISTRY for name in entry.cls.abbreviations]
    assert len(set(told)) == len(told) > 20
    assert not set(told) & {entry.kind for entry in REGISTRY}
    assert all(name == name.lower().replace("_", "") for name in told)


def test_capitals_do_not_hide_a_name():
    assert nearest("Gate", ["gate", "judge"]) == "gate"
    assert nearest("SIGMA-ACCEL", ["sigma_accel"]) == "sigma_accel"


def test_an_unknown_kind_in_a_config_gets_the_question():
    with pytest.raises(vedette.ConfigError) as caught:
        vedette.build({"estimator": {"kind": "EKF", "motion": {"kind": "cv"}}, "associator": {"kind": "JPDA"}})
    text = str(caught.value)
    assert "estimator.kind: unknown kind 'EKF'; did you mean 'ekf'?" in text
    assert "associator.kind: unknown kind 'JPDA'; did you mean 'jpda'?" in text


@pytest.mark.parametrize(("given", "unit"), [("0.6deg", "rad"), ("10NM", "m"), ("-1.5e-3km", "m"), (".5m/s^2", "m/s^2")])
def test_a_unit_may_follow_without_a_space_also_in_the_schema(given, unit):
    jsonschema = pytest.importorskip("jsonschema")
    written = next(name for name in sorted(spellings(unit), key=len, reverse=True) if given.endswith(name))
    assert in_unit(given, unit) == in_unit(f"{given.removesuffix(written)} {written}", unit)
    checked = {"anyOf": [schema()["$defs"]["motion.constant_velocity"]["properties"]["sigma_accel"]]}
    jsonschema.validate("0.6m/s^2", checked)
    assert fields.quantity("rad", "an angle").metadata["read"]("0.6deg") == in_unit("0.6 deg", "rad")


@pytest.mark.parametrize("number", ["1e-6", "1E+3", "-2.5e-07", "20", ".5"])
@pytest.mark.parametrize("unit", ["1/m^2", "1/s", "1", "m", "m/s^1.5"])
def test_a_number_with_an_exponent_takes_any_unit(number, unit):
    """A density of "1e-6 1/m^2" was refused as no number in 1/m^2: the exponent was read as the unit's beginning."""
    assert in_unit(f"{number} {unit}", unit) == float(number)


@pytest.mark.parametrize("given", ["deg", "5kg", "5 deg deg", "1e400deg", "0.6 d eg", "--5deg"])
def test_what_is_no_number_with_a_unit_is_still_refused(given):
    with pytest.raises(ValueError, match=r"must be"):
        in_unit(given, "rad", 1e15)


@pytest.mark.parametrize("given", ["1_000", "1_000 km", "1_000km"])
def test_numbers_in_pythons_own_spelling_are_refused(given):
    with pytest.raises(ValueError, match=r"must be"):
        in_unit(given, "m")
