"""What wrong components of several roles are made of."""

from itertools import count

import numpy as np
from attrs import frozen

from vedette import Space

CALLS = count()
"""What a component that keeps a state between calls keeps it in."""


@frozen
class Unwrapped(Space):
    """A space whose differences go the long way round."""

    def difference(self, a, b):
        return a - b


@frozen
class FromZero(Space):
    """A space whose angles run from 0 to 2 pi."""

    def canonical(self, x):
        return np.where([axis.period is not None for axis in self.axes], np.mod(x, 2 * np.pi), x)


def over(space, cls):
    """The property that gives `space` as another class of space."""
    return property(lambda self: cls(space.axes))


def changed(values, change):
    """A copy of an array, changed in place by a function."""
    copy = np.array(values)
    change(copy)
    return copy


def put(matrix, row, column, value, symmetric=False):
    """The matrix with one entry replaced."""
    copy = np.array(matrix)
    copy[..., row, column] = value
    if symmetric:
        copy[..., column, row] = value
    return copy
