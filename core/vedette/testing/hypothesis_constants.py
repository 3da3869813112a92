"""Draws of Hypothesis that depend on the seed alone."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from unittest.mock import patch

try:
    from hypothesis.internal.conjecture import providers
    from hypothesis.internal.constants_ast import Constants
except ImportError:  # a version of Hypothesis that has them elsewhere
    providers = Constants = None  # type: ignore[assignment,misc]

NAMES = ("_get_local_constants", "CONSTANTS_CACHE")
"""What is replaced in `providers`."""


@contextmanager
def constants_of_no_module() -> Iterator[None]:
    """Keep Hypothesis from drawing constants that it finds in the loaded modules.

    It takes 5 % of its numbers from the sources of whatever local modules are loaded, so the same seed draws other
    examples in a test run alone, in a whole session and on another machine. There is no setting for it; a version of
    Hypothesis without these names is left as it is, and the test of repeatability tells.
    """
    with ExitStack() as patches:
        if all(hasattr(providers, name) for name in NAMES):
            nothing = Constants()
            patches.enter_context(patch.object(providers, "_get_local_constants", lambda: nothing))
            patches.enter_context(patch.object(providers, "CONSTANTS_CACHE", type(providers.CONSTANTS_CACHE)(1024)))
        yield
