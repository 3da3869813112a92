"""Numbers as text: the compiled module writes what Python does, byte for byte."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vedette_files import texts

TENS = np.array([float(f"1e{k}") for k in range(-323, 309)])
EDGES = np.concatenate([TENS, np.nextafter(TENS, 0.0), np.nextafter(TENS, math.inf), 2.0 ** np.arange(-1074, 1024)])


def oracle(numbers):
    return [repr(number) if math.isfinite(number) else "null" for number in numbers]


@pytest.mark.parametrize("write", [texts.texts, texts.plain_texts])
@given(numbers=st.lists(st.floats() | st.integers(-(2**60), 2**60).map(float)))
def test_any_numbers(write, numbers):
    assert write(np.array(numbers, dtype=float)) == oracle(numbers)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_where_the_exponent_begins_and_digits_change_their_number(sign):
    bits = np.random.default_rng(1).integers(0, 2**63, 20_000).view(float)
    for numbers in (EDGES, bits, np.arange(20_000) / 1000):
        signed = np.copysign(numbers, sign)
        assert texts.texts(signed) == oracle(signed.tolist())


def test_rows_of_a_slice_and_whole_numbers_come_flat():
    assert texts.texts(np.arange(6).reshape(2, 3)[:, ::2]) == ["0.0", "2.0", "3.0", "5.0"]
