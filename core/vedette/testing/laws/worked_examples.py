"""The law of every role that a class' docstring holds it to: an oracle of numbers, beside those that code can check."""

from __future__ import annotations

import doctest
import sys
from traceback import walk_tb
from typing import Any

from vedette.config.parameters import parameters, tables
from vedette.roles import Component
from vedette.testing.comparisons import Broken, closed_if
from vedette.testing.law import Law


def worked_examples_hold(component: Component, drawn: Any) -> None:
    """The worked examples in its class' docstring, and in those of its methods and tables, give what they say."""
    tried = type(component)
    owner = next(cls for cls in tried.__mro__ if cls.__doc__ or cls is object)
    told: list[doctest.DocTest] = []
    try:
        own = tables(parameters(tried))
    except TypeError:  # a parameter that no config can state
        own = []
    for cls in (owner, *own):
        names = {**vars(sys.modules[cls.__module__]), owner.__name__: tried}
        told += [test for test in doctest.DocTestFinder().find(cls, cls.__name__, globs=names) if test.examples]
    closed_if(not told, "its docstring has no worked example (`>>>`), so its formula is not checked")
    try:
        for test in told:
            doctest.DebugRunner(verbose=False).run(test)
    except doctest.DocTestFailure as other:
        wanted, shown = other.example.want.rstrip(), other.example.source.rstrip()
        raise Broken(f"`{shown}` must give {wanted or 'nothing'}, gave {other.got.rstrip() or 'nothing'}") from None
    except doctest.UnexpectedException as raised:
        kind, error, way = raised.exc_info
        how = "raised" if len(list(walk_tb(way))) > 2 else "gave what raises"  # by what it calls, or by the example itself
        raise Broken(f"{how} {kind.__name__}: {error}, in `{raised.example.source.rstrip()}`") from None


OF_ALL = (Law(worked_examples_hold, effort="shown"),)
