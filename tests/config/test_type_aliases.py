"""A parameter annotated with a type alias is described as with the type that the alias stands for."""

from __future__ import annotations

import typing
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
import pytest
from numpy.typing import NDArray

from vedette import Array, Associator
from vedette.config.parameters import in_words, shape_of

T = TypeVar("T", bound=np.generic)

HINTS: list[Any] = [float, str, Array, Array | None, Associator, Associator | None, dict[str, float], tuple[Associator, ...]]


@pytest.fixture
def alias() -> Callable[..., Any]:
    made: Callable[..., Any] | None = getattr(typing, "TypeAliasType", None)
    if made is None:
        pytest.skip("Python 3.11 has no type aliases of this sort")
    return made


@pytest.mark.parametrize("hint", [Array, Array | None, NDArray[np.float64]])
def test_an_array_is_described_as_one_whatever_numpy_calls_it(hint: Any) -> None:
    assert in_words(shape_of(hint), 1).startswith("list of numbers")
    assert in_words(shape_of(hint), 2).startswith("matrix")


@pytest.mark.parametrize("hint", HINTS)
def test_an_alias_is_what_it_stands_for(hint: Any, alias: Callable[..., Any]) -> None:
    assert shape_of(alias("Name", hint)) == shape_of(hint)
    assert shape_of(alias("Twice", alias("Name", hint))) == shape_of(hint)
    assert shape_of(tuple[alias("Name", hint), ...]) == shape_of(tuple[hint, ...])  # type: ignore[misc]


def test_an_alias_with_parameters_is_filled_in(alias: Callable[..., Any]) -> None:
    arrays = alias("Arrays", np.ndarray[Any, np.dtype[T]], type_params=(T,))
    assert in_words(shape_of(arrays[np.float64]), 2) == "matrix"
    assert shape_of(arrays[np.float64]) == shape_of(np.ndarray[Any, np.dtype[np.float64]])
