"""Each mutant can be built, and differs from the right component in at least one call of its role."""

import re

import numpy as np
import pytest

import vedette
from mutants.foreign import MUTANTS
from mutants.foreign.base import ROLES, mutant
from mutants.foreign.probes import PROBES, declarations


def same(a, b):
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return (
            a.dtype == b.dtype
            and a.shape == b.shape
            and np.allclose(a, b, rtol=1e-7, atol=1e-9, equal_nan=a.dtype.kind == "f")
        )
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return False
    return a == b or (isinstance(a, float) and isinstance(b, float) and np.isclose(a, b, rtol=1e-9, equal_nan=True))


def behaviour(component, role):
    yield declarations(component, ROLES[role])
    yield from PROBES[role](component)


def differ(one, other, role):
    """Return whether two components declare or answer anything differently."""
    pairs = zip(behaviour(one, role), behaviour(other, role), strict=False)
    return any(len(a) != len(b) or not all(map(same, a, b)) for a, b in pairs)


@pytest.mark.parametrize("wrong", MUTANTS, ids=lambda m: m.name)
def test_a_mutant_can_be_built_and_behaves_otherwise(wrong):
    right, made = wrong.right(), wrong.make()
    assert isinstance(right, ROLES[wrong.role])
    assert isinstance(made, ROLES[wrong.role])
    assert differ(right, made, wrong.role)


@pytest.mark.parametrize("role", PROBES)
@pytest.mark.by_turns
def test_a_right_component_behaves_as_it_did(role):
    rights = {m.right.func: m.right for m in MUTANTS if m.role == role}
    for right in rights.values():
        assert not differ(right(), right(), role)


@pytest.mark.parametrize("role", PROBES)
@pytest.mark.by_turns
def test_a_mutant_without_a_fault_behaves_as_the_right_component(role):
    rights = {m.right.func: m.right for m in MUTANTS if m.role == role}
    for right in rights.values():
        faultless = mutant(role, "faultless", "None.", right)
        assert not differ(right(), faultless.make(), role)


def test_the_list_is_long_named_and_labelled():
    assert len(MUTANTS) >= 120
    assert len({m.name for m in MUTANTS}) == len(MUTANTS)
    assert len({m.make.func for m in MUTANTS}) == len(MUTANTS)
    assert all(re.fullmatch("[a-z0-9_]+", m.name) and m.fault.endswith(".") for m in MUTANTS)
    assert sum(m.label == "other_model" for m in MUTANTS) <= 0.15 * len(MUTANTS)


def test_a_mutant_keeps_the_parameters_of_the_right_component():
    for m in MUTANTS:
        assert issubclass(m.make.func, vedette.Component)
        assert all(getattr(m.make(), name) is not None for name in m.right.keywords)
