"""Parameters and units: what is taken, what it becomes, and what is said of what is not."""

import math
import re

import numpy as np
import pytest
from attrs import fields as attrs_fields
from attrs import frozen
from hypothesis import given, settings
from hypothesis import strategies as st

from vedette import fields
from vedette.units import in_unit, say, spellings

exactly = settings(max_examples=100)


@frozen
class Example:
    speed: float = fields.quantity("m/s", "speed", default=1.0, above=0, at_most=100)
    bearing: float = fields.quantity("rad", "bearing", default=0.0)
    part: float = fields.probability("part", default=0.5)
    sure: float = fields.probability("sure", default=0.5, above=0, below=1)
    count: int = fields.integer("count", default=2, at_least=1, at_most=9)
    optional: float | None = fields.quantity("s", "optional", default=None, at_least=0)
    word: str = fields.choice("word", ("one", "two"), default="one")
    path: str = fields.text("path", default="")
    names: tuple[str, ...] = fields.words("names", default=())
    columns: dict[str, str] = fields.names("columns")
    on: bool = fields.flag("on", default=False)
    matrix: np.ndarray = fields.array(
        "1", "matrix", ndim=2, default=[[1.0]], check=lambda m: "is odd" if len(m) % 2 == 0 else None
    )
    spread: dict[str, float] = fields.table("spread", unit="m")
    absent: dict[str, tuple[float, float]] = fields.table("absent", pairs=True)


ACCEPTED = [
    ("speed", 3, 3.0),
    ("speed", "36 km/h", 10.0),
    ("speed", "10 kn", 10 * 1852 / 3600),
    ("speed", "2.5", 2.5),
    ("speed", np.float32(2.5), 2.5),
    ("speed", 100, 100.0),
    ("bearing", "180 deg", math.pi),
    ("bearing", "-3 mrad", -0.003),
    ("bearing", "1600 mil", math.pi / 2),
    ("part", 0, 0.0),
    ("part", 1, 1.0),
    ("count", 9.0, 9),
    ("count", "3", 3),
    ("optional", None, None),
    ("optional", "2 min", 120.0),
    ("optional", "250 ms", 0.25),
    ("word", "two", "two"),
    ("path", "a b", "a b"),
    ("names", ["a", "b"], ("a", "b")),
    ("columns", {"x": "north"}, {"x": "north"}),
    ("on", True, True),
    ("spread", {"x": "1 km", "y": 2}, {"x": 1000.0, "y": 2.0}),
    ("absent", {"turn_rate": [0, 0.1]}, {"turn_rate": (0.0, 0.1)}),
]


@pytest.mark.parametrize(("name", "given", "held"), ACCEPTED)
def test_what_is_taken_becomes_a_plain_value(name, given, held):
    value = getattr(Example(**{name: given}), name)
    assert value == (pytest.approx(held, rel=1e-15) if isinstance(held, float) else held)
    assert type(value) is type(held)


REFUSED = [
    ("speed", 0, "must be > 0 and <= 100, got 0 m/s"),
    ("speed", -3, "must be > 0 and <= 100, got -3 m/s"),
    ("speed", "400 km/h", "must be > 0 and <= 100, got 111.111 m/s"),
    ("speed", "3 m", "must be in m/s or km/h or kn, got '3 m'"),
    ("speed", "fast", "must be a number in m/s, got 'fast'"),
    ("speed", "", "must be a number in m/s, got ''"),
    ("speed", None, "must be a number in m/s, got None"),
    ("speed", True, "must be a number in m/s, got True"),
    ("speed", [1.0], "must be a number in m/s, got [1.0]"),
    ("speed", math.nan, "must be a finite number of at most 1e+15, got nan"),
    ("speed", "inf", "must be a finite number of at most 1e+15, got 'inf'"),
    ("bearing", 1e16, "must be a finite number of at most 1e+15, got 1e+16"),
    ("bearing", 10**400, "must be a number in rad, got 1000"),
    ("part", 1.01, "must be >= 0 and <= 1, got 1.01"),
    ("part", -0.1, "must be >= 0 and <= 1, got -0.1"),
    ("part", "50 %", "must be a number without a unit, got '50 %'"),
    ("sure", 1, "must be > 0 and < 1, got 1"),
    ("sure", 0, "must be > 0 and < 1, got 0"),
    ("count", 2.5, "must be a whole number, got 2.5"),
    ("count", 0, "must be >= 1 and <= 9, got 0"),
    ("optional", -1, "must be >= 0, got -1 s"),
    ("word", "three", "must be one of 'one', 'two', got 'three'"),
    ("word", ["one"], "must be one of 'one', 'two', got ['one']"),
    ("path", 3, "must be a string, got 3"),
    ("names", "ab", "must be a list of strings, got 'ab'"),
    ("names", [1], "must be a list of strings, got [1]"),
    ("columns", {"x": 1}, "must be a table of names to strings, got {'x': 1}"),
    ("on", 1, "must be true or false, got 1"),
    ("matrix", [1.0], "must have 2 axes, got 1: [1.0]"),
    ("matrix", [[1.0], [1.0, 2.0]], "must be numbers with 2 axes and rows of one length"),
    ("matrix", [["a"]], "must be numbers with 2 axes and rows of one length"),
    ("matrix", [[math.nan]], "must be finite numbers of at most 1e+15"),
    ("matrix", [[1e16]], "must be finite numbers of at most 1e+15"),
    ("matrix", [[1.0], [2.0]], "is odd"),
    ("spread", [1.0], "must be a table of names, got [1.0]"),
    ("spread", {"x": "1 s"}, "x: must be in m or km or NM or ft, got '1 s'"),
    ("absent", {"a": 1.0}, "a: must be [mean, standard deviation], got 1.0"),
    ("absent", {"a": [1.0]}, "a: must be [mean, standard deviation], got [1.0]"),
    ("absent", {"a": [0, -1]}, "a: the standard deviation must be >= 0, got -1"),
]


@pytest.mark.parametrize(("name", "given", "message"), REFUSED)
def test_what_is_refused_is_told_with_its_name_and_without_it_to_the_config(name, given, message):
    with pytest.raises(ValueError, match="^" + re.escape(f"{name}: {message}")):
        Example(**{name: given})
    read = getattr(attrs_fields(Example), name).metadata["read"]
    with pytest.raises(ValueError, match="^" + re.escape(message)):
        read(given)


def test_arrays_are_read_only_copies_that_compare_as_values():
    mine = np.array([[2.0]])
    example = Example(matrix=mine)
    mine[0, 0] = 3.0
    assert example.matrix[0, 0] == 2.0
    with pytest.raises(ValueError, match="read-only"):
        example.matrix[0, 0] = 1.0
    assert example == Example(matrix=[[2]])
    assert example != Example(matrix=[[1.0]])


def test_tables_of_two_components_are_not_shared():
    assert Example().spread == {}
    assert Example().spread is not Example().spread


def test_every_parameter_says_its_unit_and_what_it_is():
    for parameter in attrs_fields(Example):
        assert parameter.metadata["doc"] == parameter.name
        assert "unit" in parameter.metadata


SI = ["m", "s", "m/s", "m/s^2", "m/s^1.5", "m/s^2.5", "rad", "rad/s", "rad/s^2", "rad/s^1.5"]


@exactly
@given(st.sampled_from(SI), st.floats(-1e6, 1e6))
def test_every_spelling_of_a_unit_is_proportional(unit, number):
    assert in_unit(f"{number!r} {unit}", unit) == in_unit(number, unit) == number
    for written in spellings(unit):
        factor = in_unit(f"1 {written}", unit)
        assert factor > 0
        assert in_unit(f"{number!r} {written}", unit) == pytest.approx(factor * number, rel=1e-15)


def test_the_factors_are_the_definitions():
    for text, unit, value in [
        ("1 NM", "m", 1852.0),
        ("3 um", "m", 3e-6),
        ("1 ft", "m", 0.3048),
        ("1 h", "s", 3600.0),
        ("3.6 km/h", "m/s", 1.0),
        ("3600 kn", "m/s", 1852.0),
        ("1 g", "m/s^2", 9.80665),
        ("180 deg", "rad", math.pi),
        ("180 deg/s", "rad/s", math.pi),
        ("180 deg/s^2", "rad/s^2", math.pi),
        ("0.3 m/s^2", "m/s^1.5", 0.3),  # what white noise gains in 1 s, as older configs write it
        ("180 deg/s^2", "rad/s^1.5", math.pi),
    ]:
        assert in_unit(text, unit) == pytest.approx(value, rel=1e-15)


def test_numbers_are_said_with_their_unit():
    assert say(1 / 3, "m") == "0.333333 m"
    assert say(2.0) == say(2.0, "") == "2"
    assert spellings("1") == ()
    assert spellings("1/m^2") == ("1/m^2",)


@frozen
class Squares:
    none: np.ndarray = fields.array("1", "of none", ndim=2, default=np.zeros((0, 0)))
    one: np.ndarray = fields.array("1", "of one", ndim=2, default=np.ones((1, 1)))


def test_an_empty_matrix_comes_back_from_plain_data():
    """A list of no rows does not say how many axes it has; once the config.json of no run could be read."""
    assert Squares(none=Squares().none.tolist()).none.shape == (0, 0)
    with pytest.raises(ValueError, match="2 axes"):
        Squares(one=[])
