"""What lifecycles make of a scan is the same compiled as in numpy."""

import numpy as np
import pytest

from vedette_standard import compiled
from vedette_standard.lifecycles.existence import by_existence
from vedette_standard.lifecycles.limited import limited
from vedette_standard.lifecycles.m_of_n import m_of_n
from vedette_standard.lifecycles.score import by_score

pytestmark = pytest.mark.skipif(not hasattr(m_of_n, "__wrapped__"), reason="numpy runs")
RNG = np.random.default_rng(0)


def flags(shape):
    return RNG.random(shape) < 0.3


def share(shape):
    return np.where(RNG.random(shape) < 0.2, RNG.integers(0, 2, shape), RNG.random(shape))


def cases(shape):
    bits = RNG.integers(0, 1 << 60, shape) >> RNG.integers(0, 60, shape)
    yield m_of_n, (bits, RNG.integers(0, 9, shape), flags(shape), share(shape), share(shape), 0.1, 3, 5, 4)
    yield m_of_n, (bits, RNG.integers(0, 99, shape), flags(shape), share(shape), share(shape), 0.5, 60, 60, 60)
    ages = RNG.random(shape) * 9, RNG.random(shape) * 9
    yield limited, (*ages, share(shape), share(shape), flags(shape), 0.1, 1.5, 6.0, np.inf)
    yield by_existence, (flags(shape), share(shape), 0.7, 0.5, 0.2)
    odds = RNG.normal(size=shape), RNG.normal(size=shape), RNG.random(shape)
    for own in (seen := share(shape)), share(shape):
        yield by_score, (*odds, flags(shape), seen, own, share(shape), 1 - 5e-13, 2.0, -2.0, 3.0)


@pytest.mark.parametrize("shape", [(1,), (7,), (3, 2), (0,)])
def test_compiled_and_in_numpy_they_agree(shape):
    for function, given in cases(shape):
        own = getattr(compiled._module, function.__name__)(*given)
        for got, wanted in zip(own, function.__wrapped__(*given), strict=True):
            assert got.dtype == wanted.dtype
            np.testing.assert_allclose(got, wanted, rtol=1e-13)


def test_what_the_compiled_ones_do_not_take_goes_to_numpy():
    for function, given in cases((6,)):
        every_second = [np.repeat(one, 2)[::2] if isinstance(one, np.ndarray) else one for one in given]
        assert getattr(compiled._module, function.__name__)(*every_second) is None
        for got, wanted in zip(function(*every_second), function(*given), strict=True):
            np.testing.assert_allclose(got, wanted, rtol=1e-13)
