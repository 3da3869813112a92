"""The compiled kernels beside their reference; tests that import this are skipped where nothing is compiled."""

from contextlib import contextmanager

import attrs
import numpy as np
import pytest
from hypothesis import strategies as st

from vedette import kernels
from vedette.kernels import (
    assignment,
    association,
    backward,
    boxes,
    clusters,
    joint,
    modes,
    reference,
    twins,
)

if kernels.weighted_update is reference.weighted_update:
    pytest.skip(f"kernels: {kernels.RUNNING}", allow_module_level=True)

from vedette.kernels import _compiled

REFERENCE = {
    name: getattr(home, name)
    for home in (
        reference,
        modes,
        association,
        assignment,
        backward,
        boxes,
        clusters,
        joint,
        twins,
    )
    for name in dir(kernels)
    if name[0] != "_" and hasattr(_compiled, name) and hasattr(home, name)
}


@contextmanager
def on(instruction_set):
    usual = _compiled.instruction_set()
    _compiled.use(instruction_set)
    try:
        yield
    finally:
        _compiled.use(usual)


@contextmanager
def without_reference(name):
    """The kernel takes the call itself, or fails."""

    def refused(*given):
        raise AssertionError(f"{name} left the call to the reference")

    _compiled.bind(name, refused)
    try:
        yield
    finally:
        _compiled.bind(name, REFERENCE[name])


seeds = st.integers(0, 2**32 - 1)


def agree(name, *given):
    expected = REFERENCE[name](*given)
    for instruction_set in _compiled.instruction_sets():
        with on(instruction_set):
            found = getattr(kernels, name)(*given)
        compare(found, expected, instruction_set)


def parts_of(result):
    return attrs.astuple(result, recurse=False) if attrs.has(type(result)) else result


def compare(found, expected, what):
    if isinstance(parts_of(expected), tuple):
        assert type(found) is type(expected), what
        for one, other in zip(parts_of(found), parts_of(expected), strict=True):
            compare(one, other, what)
        return
    expected = np.broadcast_to(expected, np.shape(found))  # the reference may leave out axes along which nothing changes
    scale = max(1.0, np.max(np.abs(expected), initial=0.0, where=np.isfinite(expected)))
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-11 * scale, err_msg=what)
