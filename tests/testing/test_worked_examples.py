"""What a class' docstring shows is held to: told where there is nothing, and what was given where it is another thing."""

import numpy as np  # noqa: F401 - an example's
import pytest
from attrs import frozen

from vedette import Preprocessor, Space, fields
from vedette.testing import FAST, examine, laws_of
from vedette.testing.strategies import components
from vedette_standard.sensors.cartesian_position import CartesianPosition


class Passing(Preprocessor):
    measurement = Space.of(x="m", y="m")

    @property
    def sensors(self):
        return {"eye": CartesianPosition(sigma=1.0)}

    def process(self, scans):
        return scans["eye"].detections


def showing(example, table=""):
    """A preprocessor, named Shown, with a table, named Table: both with what their docstrings show."""

    @frozen
    class Table:
        half: float = fields.quantity("m", "half of it", default=1.0)

        def twice(self):
            return 2 * self.half

    Table.twice.__doc__ = f"Return twice that.\n\n{table}\n"

    @frozen
    class Shown(Passing):
        kind = "test_shown"
        table: Table = fields.part("a table", default=Table())

    Shown.__doc__ = f"Passes returns on.\n\n{example}\n"
    return Shown


@pytest.mark.parametrize(
    ("example", "table", "verdict", "text"),
    [
        ("", "", "skipped", "its docstring has no worked example (`>>>`), so its formula is not checked"),
        (">>> list(Shown().sensors)\n['eye']", "", "held", ""),
        (">>> x = np.arange(2.0)\n>>> x.tolist()\n[0.5]", "", "failed", "`x.tolist()` must give [0.5], gave [0.0, 1.0]"),
        (">>> Shown().process({})", "", "failed", "raised KeyError: 'eye', in `Shown().process({})`"),
        (">>> Shown().sensors['ear']", "", "failed", "gave what raises KeyError: 'ear', in `Shown().sensors['ear']`"),
        ("", ">>> 2 * 1.5\n4.0", "failed", "`2 * 1.5` must give 4.0, gave 3.0"),
    ],
)
def test_what_is_shown_is_so(example, table, verdict, text):
    shown = showing(example, table)
    (law,) = (law for law in laws_of(shown) if law.name == "worked_examples_hold")
    found = examine(shown, law, components(shown), FAST)
    assert (found.verdict, found.text) == (verdict, text)
    assert bool(found.replay) == (verdict == "failed")
