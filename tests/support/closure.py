"""What a module's behaviour follows from: the files of the modules that it imports, and those that they import.

A name is followed to the module that defines it, past the packages that pass it on: `from vedette import Space` leads to
`vedette.space` alone. Imports for type checkers change no behaviour and are not followed. They are looked for in the text:
to parse all modules takes ten times as long, in each process that runs tests.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from support.architecture import modules
from support.paths import ROOT

FOLDERS = ("core", "plugins", "simulators")


def closure(names: Iterable[str]) -> set[Path]:
    """Return the files of modules of the repository and of all that they import."""
    found, todo = set[str](), [*names]
    while todo:
        name = todo.pop()
        if name in known() and name not in found:
            found.add(name)
            todo += _needs(name)
    return {known()[name] for name in found}


_UNSEEN = re.compile(r'("""|\'\'\')(?s:.*?)\1|^( *)if TYPE_CHECKING:\n(?:\2 .*\n|\n)+|#.*$', re.MULTILINE)
_IMPORT = re.compile(r"^ *(?:from (\S+) )?import (\([^)]*\)|.*)$", re.MULTILINE)


@cache
def imports_of(path: Path) -> frozenset[str]:
    """Return the modules that a file beside them imports, as a test does."""
    return frozenset(_imports(_code(path)))


@cache
def known() -> dict[str, Path]:
    """Return the modules of the repository that a component may import."""
    return {name: path for folder in FOLDERS for name, path in modules(ROOT / folder).items()}


@cache
def _code(path: Path) -> str:
    """Return the text of a file without docstrings, comments and what is for type checkers only."""
    return _UNSEEN.sub("", path.read_text(encoding="utf-8") + "\n")


def _imported(code: str) -> Iterator[tuple[str, str, str]]:
    """Yield from where what is imported, and under which name."""
    for module, names in _IMPORT.findall(code):
        for alias in filter(None, (part.strip() for part in names.strip("()").split(","))):
            name, _, other = alias.partition(" as ")
            yield module, name, other or name


@cache
def _passed_on(package: str) -> dict[str, tuple[str, str]]:
    """Return from where a package has each name that it passes on; its stub tells of those that are looked up when used."""
    stub = known()[package].with_suffix(".pyi")
    code = _code(stub if stub.exists() else known()[package])
    return {other: (module, name) for module, name, other in _imported(code) if module}


@cache
def _needs(name: str) -> frozenset[str]:
    return frozenset(_imports(_code(known()[name])))


def _imports(code: str) -> Iterator[str]:
    used = _IMPORT.sub("", code)
    for module, name, other in _imported(code):
        yield _home(module, name) if module else name
        whole = f"{module}.{name}" if module else name
        if whole in known():
            for attribute in re.findall(rf"(?<![\w.]){re.escape(other)}\.(\w+)", used):
                yield _home(whole, attribute)


@cache
def _home(module: str, name: str) -> str:
    """Return the module that defines a name which `module` has."""
    if f"{module}.{name}" in known():
        return f"{module}.{name}"
    if module in known() and known()[module].name == "__init__.py" and name in _passed_on(module):
        return _home(*_passed_on(module)[name])
    return module
