"""Right components of kinds that Vedette does not ship, written by its contract and documentation alone.

Each module `<role>_*` ends with its table `COMPONENTS`. They are for holding the conformance kit to: none may be blamed.
"""

from collections.abc import Callable

from attrs import frozen

import vedette


@frozen
class Foreign:
    """One component: its name, its role, how to build it with ordinary parameters, and the laws that it is known to fail."""

    name: str
    role: str
    make: Callable[[], vedette.Component]
    known_failures: tuple[str, ...] = ()
