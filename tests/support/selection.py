"""Which kinds' laws a run of the tests tries, and which costly tests: those that changed, and a share of the others.

What changed is told since the branch left main. The hash of the commit draws these, so that the same commit tries
the same kinds. Of what depends on a change, as all does on the kernels, at most `MOST_KINDS` and `MOST_COSTLY` are tried:
those whose own file changed, then drawn ones; otherwise a run would take twice its time. Without git, as in an sdist,
without history, with `--all` and in the nightly profile all are tried. Of cases that take turns one is tried in every run.
"""

from __future__ import annotations

import hashlib
import subprocess
from collections.abc import Iterable, Mapping
from itertools import groupby
from pathlib import Path

from attrs import frozen

from support.closure import closure, imports_of, known
from support.paths import ROOT
from vedette.roles import Component
from vedette.testing import laws_of

SHARE = 40
"""One of so many unchanged kinds is tried."""

MOST_KINDS, MOST_COSTLY = 10, 6
"""Kinds, and costly tests, of one change that are tried; by hand: 10 s of CPU each, of eight minutes."""

OF_ALL = (
    "core/cpp/",
    "core/vedette/config/parameters.py",
    *(
        f"core/vedette/testing/{name}.py"
        for name in ("kit", "hypothesis_constants", "strategies", "counterexamples", "limits")
    ),
    "tests/testing/test_conformance.py",
)
"""Files and folders on which the laws of all kinds depend, whatever they import."""

CONFIGURED = ("core/cpp/", "plugins/vedette_standard/", "simulators/")
"""Folders of components that a test may name in a config, without an import."""


@frozen
class Since:
    """What changed: the commits compared, and the files that differ, those not yet committed among them."""

    base: str
    head: str
    files: frozenset[str]


def since(root: Path = ROOT) -> Since | None:
    """Return what changed since the branch left main, on main itself by its last commit; None if git cannot tell."""
    head, top = _git(root, "rev-parse", "HEAD"), _git(root, "rev-parse", "--show-toplevel")
    if top is None or Path(top).resolve() != root.resolve():  # unpacked within another repository
        return None
    forks = (_git(root, "merge-base", "HEAD", main) for main in ("origin/main", "main"))
    fork = next(filter(None, forks), None)
    base = _git(root, "rev-parse", "--verify", "-q", "HEAD^") if fork == head else fork
    if head is None or base is None:
        return None
    changed = _git(root, "diff", "--name-only", "--no-renames", base)
    new = _git(root, "ls-files", "--others", "--exclude-standard")
    return (
        None if changed is None or new is None else Since(base, head, frozenset([*changed.splitlines(), *new.splitlines()]))
    )


def _git(root: Path, *words: str) -> str | None:
    try:
        done = subprocess.run(["git", "-C", str(root), *words], capture_output=True, text=True, check=False)
    except OSError:
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def changed(classes: Iterable[type[Component]], files: frozenset[str]) -> set[type[Component]]:
    """Return the classes that these files may have changed, their role's laws among them; those of others always."""
    classes = set(classes)
    if any(file.startswith(OF_ALL) for file in files):
        return classes
    return {cls for cls in classes if cls.__module__ not in known() or files & files_of(cls)}


def files_of(cls: type[Component]) -> set[str]:
    """Return the files that a class and its role's laws follow from, but for parts that the kit puts into it."""
    laws = {law.check.__module__ for law in laws_of(cls)}
    return {path.relative_to(ROOT).as_posix() for path in closure([cls.__module__, *laws])}


def drawn(classes: Iterable[type[Component]], head: str) -> set[type[Component]]:
    """Return the share of the classes that a commit draws."""
    names = {_name(cls): cls for cls in classes}
    return {names[name] for name in a_share(names, head)}


def _name(cls: type[Component]) -> str:
    return f"{cls.__module__}.{cls.__qualname__}"


def _file(cls: type[Component]) -> str:
    return known()[cls.__module__].relative_to(ROOT).as_posix()


def a_share(names: Iterable[str], head: str) -> list[str]:
    """Return the share of some names that a commit draws."""
    ordered = _shuffled(names, head)
    return ordered[: -(-len(ordered) // SHARE)]


def _shuffled(names: Iterable[str], head: str) -> list[str]:
    return sorted(names, key=lambda name: hashlib.sha256(f"{head} {name}".encode()).digest())


def _most(touched: Mapping[str, bool], head: str, most: int) -> set[str]:
    """Return at most so many of the names that a change touched, first those whose own file it is."""
    return set(sorted(_shuffled(touched, head), key=lambda name: not touched[name])[:most])


def costly(tests: Mapping[str, Path], what: Since | None) -> set[str]:
    """Return those of some costly tests, name to file, or to the page whose blocks one runs, that are tried.

    What changed is that file, what it imports, the plugin or room that its folder mirrors, or what configs name everywhere.
    """
    if what is None:
        return set(tests)
    changed_files = {path for path in set(tests.values()) if _is_changed(path, what.files)}
    own = {path for path in changed_files if path.relative_to(ROOT).as_posix() in what.files}
    touched = {name: path in own for name, path in tests.items() if path in changed_files}
    return _most(touched, what.head, MOST_COSTLY) | {*a_share(tests.keys() - touched.keys(), what.head)}


def by_turns(cases: Iterable[str], what: Since | None) -> set[str]:
    """Return of the cases of each test the share that a commit draws, which is one at least."""
    tests = groupby(sorted(cases), key=lambda name: name.partition("[")[0])
    return set() if what is None else {name for _, its in tests for name in a_share(its, what.head)}


def _is_changed(test: Path, files: frozenset[str]) -> bool:
    file = test.relative_to(ROOT).as_posix()
    mirrored = file.partition("/")[2].partition("/")[0]
    near = ("tests/support/", *CONFIGURED, f"plugins/vedette_{mirrored}/", f"core/vedette/{mirrored}/")
    imported = {path.relative_to(ROOT).as_posix() for path in closure(imports_of(test))}
    return bool(files & {file, *imported}) or any(name.startswith(near) for name in files)


def chosen(classes: Iterable[type[Component]], what: Since | None) -> tuple[set[type[Component]], str]:
    """Return the classes whose laws are tried, and a line that says why these."""
    classes = set(classes)
    if what is None:
        return classes, f"laws of all {len(classes)} kinds, as git does not tell what changed"
    touched = changed(classes, what.files)
    others = drawn(classes - touched, what.head)
    names = {_name(cls): cls for cls in touched}
    own = {name: cls.__module__ not in known() or _file(cls) in what.files for name, cls in names.items()}
    tried = {names[name] for name in _most(own, what.head, MOST_KINDS)}
    many = f"{len(tried)} of {len(touched)}" if len(tried) < len(touched) else f"{len(touched)}"
    line = f"laws of {many} of {len(classes)} kinds, which changed since {what.base[:10]}"
    if others:
        line += f", and of {len(others)} that {what.head[:10]} draws: {', '.join(sorted(cls.__name__ for cls in others))}"
    return tried | others, f"{line}; --all tries all"
