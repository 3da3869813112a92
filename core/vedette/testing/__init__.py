"""The conformance kit: laws that every component must keep, and the consistency of whole trackers.

The extra `vedette[testing]` installs what it needs. One line makes a pytest class with one test per law::

    from vedette.testing import conformance

    TestMyMotion = conformance(MyMotion)

Names are imported when first used, so that the pytest plugin costs other projects' sessions nothing. What judges whole
trackers comes from a plugin.
"""

from importlib import import_module
from typing import Any

from vedette.names import brought, look_up

_HOMES = {
    "comparisons": ("Broken", "Closed", "Misuse"),
    "kit": ("Outcome", "conformance", "examine", "laws_of", "own_laws"),
    "law": ("FAST", "NIGHTLY", "Law", "Profile"),
    "strategies": ("components",),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        return look_up(name, "vedette.testing")
    try:
        home = import_module(f"vedette.testing.{_HOME_OF[name]}")
    except ModuleNotFoundError as missing:
        if missing.name not in ("hypothesis", "pytest"):
            raise
        raise ModuleNotFoundError(
            f"vedette.testing needs {missing.name}: pip install 'vedette[testing]'", name=missing.name
        ) from None
    return getattr(home, name)


def __dir__() -> list[str]:
    return [*_HOME_OF, *brought("vedette.testing")]
