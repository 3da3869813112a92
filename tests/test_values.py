"""A value made by the compiled maker is what the class itself makes."""

import gc
import weakref

import attrs
import numpy as np
import pytest

from vedette import values
from vedette.filters import Hypotheses
from vedette.tracking.pytrees import mapped
from vedette.tracking.tracker import State
from vedette.types import Gaussian, Innovation

needs_maker = pytest.mark.skipif(not values.COMPILED, reason="nothing is compiled here: the maker is the class")


@pytest.mark.parametrize("cls", [Gaussian, Innovation, Hypotheses, State])
def test_a_value_holds_its_fields_and_is_frozen(cls):
    given = [np.full(2, float(i)) for i, _ in enumerate(attrs.fields(cls))]
    made, plain = values.maker(cls)(*given), cls(*given)
    assert type(made) is cls
    for field in attrs.fields(cls):
        assert getattr(made, field.name) is getattr(plain, field.name)
    assert repr(made) == repr(plain)
    with pytest.raises(attrs.exceptions.FrozenInstanceError):
        setattr(made, attrs.fields(cls)[0].name, 1)
    assert attrs.asdict(attrs.evolve(made)).keys() == attrs.asdict(plain).keys()


@pytest.mark.parametrize("fields", [values.MOST, values.MOST + 1], ids=["the most", "one more"])
def test_a_class_of_more_fields_than_compiled_code_takes_makes_its_values_itself(fields):
    names = [f"x{i}" for i in range(fields)]
    many = attrs.make_class("Many", names, frozen=True, slots=True)
    made = values.evolver(many)(values.maker(many)(*map(np.array, range(len(names)))), x0=np.array(7))
    doubled = mapped(lambda part: 2 * part, made)
    assert type(doubled) is many
    assert attrs.astuple(doubled) == (14, *range(2, 2 * len(names), 2))


@needs_maker
def test_wrong_arguments_and_classes_are_refused():
    make = values.maker(Gaussian)
    for given in ((), (1,), (1, 2, 3)):
        with pytest.raises(TypeError, match="takes its 2 fields in order"):
            make(*given)
    with pytest.raises(TypeError):
        make(1, cov=2)

    @attrs.frozen(slots=False)
    class WithoutSlots:
        x: int

    with pytest.raises((TypeError, AttributeError)):
        values.maker(WithoutSlots)


def test_nothing_is_left_behind():
    class Watched:
        alive = 0

        def __init__(self):
            Watched.alive += 1

        def __del__(self):
            Watched.alive -= 1

    make = values.maker(Gaussian)
    evolve = values.evolver(Gaussian)
    for _ in range(100):
        evolve(make(Watched(), Watched()), cov=Watched())
    circle = []
    circle.append(make(circle, Watched()))
    del circle
    gc.collect()
    assert Watched.alive == 0


@pytest.mark.parametrize("cls", [Gaussian, State])
def test_an_evolved_value_differs_in_the_named_fields_alone(cls):
    names = [field.name for field in attrs.fields(cls)]
    value, evolve = cls(*(np.full(2, float(i)) for i, _ in enumerate(names))), values.evolver(cls)
    for changed in ((), names[:1], names[-1:], names[1::2], names[::-1], ["".join(["me", "an"])] if "mean" in names else ()):
        changes = {name: object() for name in changed}
        after = evolve(value, **changes)
        assert type(after) is cls
        for name in names:
            assert getattr(after, name) is changes.get(name, getattr(value, name))
    with pytest.raises(TypeError):
        evolve(value, nothing=1)


@needs_maker
def test_only_values_of_the_class_are_evolved():
    evolve = values.evolver(Gaussian)
    for given in ((), (1,), (Innovation(*range(5)),), (Gaussian(1, 2), 3)):
        with pytest.raises(TypeError):
            evolve(*given)


@needs_maker
def test_only_what_may_be_part_of_a_cycle_is_collected_as_garbage():
    """A value of arrays, numbers and such values is not followed; one that holds anything else is, and goes in a cycle."""
    new, changed = values.maker(Gaussian), values.evolver(Gaussian)
    plain, mutable = new(np.zeros(2), np.eye(2)), []
    for leaf in (plain, new((plain, 1.0), plain), changed(plain, mean=(None, "x"))):
        assert not gc.is_tracked(leaf)
    for followed in (new({}, plain), new(mutable, plain), new((plain, mutable), plain), changed(plain, cov=mutable)):
        assert gc.is_tracked(followed)

    known = {}
    value = known["value"] = new(known, plain)
    gone = weakref.ref(value)
    del known, value
    gc.collect()
    assert gone() is None
