"""Draws of Hypothesis that depend on the seed alone, and are no copies of one another."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

try:
    from hypothesis.internal import entropy
    from hypothesis.internal.conjecture import providers
    from hypothesis.internal.conjecture.engine import ConjectureRunner
    from hypothesis.internal.constants_ast import Constants
except ImportError:  # a version of Hypothesis that has them elsewhere
    providers = Constants = ConjectureRunner = entropy = None  # type: ignore[assignment,misc]


@contextmanager
def _replaced(owner: Any, **others: Any) -> Iterator[None]:
    """Replace what a version of Hypothesis has of these names; one without them is left as it is, and a test tells."""
    with ExitStack() as patches:
        for name in [name for name in others if hasattr(owner, name)]:
            patches.enter_context(patch.object(owner, name, others[name]))
        yield


@contextmanager
def constants_of_no_module() -> Iterator[None]:
    """Keep Hypothesis from drawing constants that it finds in the loaded modules.

    It takes 5 % of its numbers from the sources of whatever local modules are loaded, so the same seed draws other
    examples in a test run alone, in a whole session and on another machine. There is no setting for it.
    """
    cache = getattr(providers, "CONSTANTS_CACHE", None)
    nothing = None if providers is None else Constants()
    with _replaced(providers, _get_local_constants=lambda: nothing, CONSTANTS_CACHE=cache and type(cache)(1024)):
        yield


@contextmanager
def examples_of_their_own() -> Iterator[None]:
    """Keep Hypothesis from trying an example again with a part copied over another: of 20, that makes up to 8 such.

    And from collecting all garbage when it begins, to see who holds its own generator: it takes .07 s.
    """
    idle = SimpleNamespace(collect=lambda: 0, get_referrers=lambda one: [one])
    with _replaced(ConjectureRunner, generate_mutations_from=lambda *_: None), _replaced(entropy, gc=idle):
        yield
