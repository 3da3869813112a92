"""What a module's behaviour follows from: the files of the modules that it imports, and those that they import.

A name is followed to the module that defines it, past the packages that pass it on: `from vedette import Space` leads to
`vedette.space` alone. Imports for type checkers change no behaviour and are not followed.
"""

from __future__ import annotations

import ast
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


@cache
def imports_of(path: Path) -> frozenset[str]:
    """Return the modules that a file beside them imports, as a test does."""
    return frozenset(_imports(ast.parse(path.read_text(encoding="utf-8"))))


@cache
def known() -> dict[str, Path]:
    """Return the modules of the repository that a component may import."""
    return {name: path for folder in FOLDERS for name, path in modules(ROOT / folder).items()}


@cache
def _tree(name: str) -> ast.Module:
    return ast.parse(known()[name].read_text(encoding="utf-8"))


@cache
def _passed_on(package: str) -> ast.Module:
    """Return the imports by which a package passes names on: those of its stub, where it looks names up when first used."""
    stub = known()[package].with_suffix(".pyi")
    return ast.parse(stub.read_text(encoding="utf-8")) if stub.exists() else _tree(package)


@cache
def _needs(name: str) -> frozenset[str]:
    return frozenset(_imports(_tree(name)))


def _imports(tree: ast.Module) -> Iterator[str]:
    packages = {}
    for node in _run(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name
                packages[alias.asname or alias.name] = alias.name
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            for alias in node.names:
                yield _home(node.module, alias.name)
                packages[alias.asname or alias.name] = f"{node.module}.{alias.name}"
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in packages:
            yield _home(packages[node.value.id], node.attr)


def _run(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield what is executed, in the order of the text."""
    todo = [tree]
    while todo:
        node = todo.pop()
        if not (isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)):
            yield node
            todo += reversed([*ast.iter_child_nodes(node)])


@cache
def _home(module: str, name: str) -> str:
    """Return the module that defines a name which `module` has."""
    if f"{module}.{name}" in known():
        return f"{module}.{name}"
    if module in known() and known()[module].name == "__init__.py":
        for node in ast.walk(_passed_on(module)):
            if isinstance(node, ast.ImportFrom) and node.module:
                for alias in node.names:
                    if name == (alias.asname or alias.name):
                        return _home(node.module, alias.name)
    return module
