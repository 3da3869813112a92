"""A number that is nearly right is told with how near it had to be."""

from __future__ import annotations

import numpy as np
import pytest

from vedette.testing import Broken
from vedette.testing.comparisons import same


def test_what_is_nearly_right_is_told_with_its_tolerance() -> None:
    with pytest.raises(Broken, match=r"^noise\[1\]: must be 0 to within 1e-09, got -8\.3e-05$"):
        same("noise", np.array([0.0, -8.3e-5]), np.zeros(2), tolerance=1e-9, scale=1.0)


def test_what_is_plainly_wrong_is_told_plainly() -> None:
    with pytest.raises(Broken, match=r"^move\[0\]: must be 0, got 1$"):
        same("move", np.ones(1), np.zeros(1))


def test_what_differs_in_the_last_digits_is_told_with_them() -> None:
    with pytest.raises(Broken, match=r"must be 32\.4522\d+, got 32\.4522\d+$") as told:
        same("move", np.array([32.4522814 + 1e-12]), np.array([32.4522814]), 0.0)
    wanted, got = str(told.value).partition("must be ")[2].split(", got ")
    assert wanted != got
