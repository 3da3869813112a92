"""Which kinds' laws are tried by day: all whose code changed, and a share of the others."""

import os
import subprocess
import sys

import pytest
from attrs import evolve

from mutants.foreign import MUTANTS as FOREIGN
from support.closure import closure, known
from support.mutants.table import MUTANTS as OURS
from support.paths import ROOT
from support.selection import (
    MOST_COSTLY,
    MOST_KINDS,
    OF_ALL,
    SHARE,
    Since,
    by_turns,
    changed,
    chosen,
    costly,
    drawn,
    files_of,
    since,
)
from vedette.config.registry import Registry
from vedette.testing import FAST, examine, kit, laws_of
from vedette.testing.laws import trackers
from vedette.testing.strategies import components
from vedette.tracking.components import parts
from vedette_standard.associators.nearest import Nearest
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.lifecycles.m_of_n import MOfN
from vedette_standard.motion.constant_velocity import ConstantVelocity

KINDS = {entry.cls for entry in Registry.installed() if entry.role in kit._ROLES}


def names(paths):
    return {path.relative_to(ROOT).as_posix() for path in paths}


def of(*files):
    return {cls.__name__ for cls in changed(KINDS, frozenset(files))}


def test_a_name_is_followed_to_where_it_is_defined():
    found = names(closure(["vedette_standard.motion.constant_velocity"]))
    assert {"core/vedette/roles.py", "core/vedette/space.py", "plugins/vedette_standard/motion/blocks.py"} <= found
    assert (
        not {"core/vedette/__init__.py", "core/vedette/tracking/tracker.py", "plugins/vedette_standard/__init__.py"} & found
    )


@pytest.mark.parametrize(
    ("line", "reached"),
    [
        ("from vedette import Space", {"space"}),
        ("import vedette\nx = vedette.Space", {"space"}),
        ("import vedette as v\ndef f():\n    return v.Space", {"space"}),
        ("def f():\n    from vedette.space import Space", {"space"}),
        ("from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from vedette import Space", set()),
    ],
)
def test_an_import_is_seen_wherever_it_stands(line, reached, tmp_path, monkeypatch):
    from support import closure as written

    (tmp_path / "it.py").write_text(line)
    two = {name: known()[name] for name in ("vedette", "vedette.space")}
    monkeypatch.setattr(written, "known", lambda: two | {"it": tmp_path / "it.py"})
    written._needs.cache_clear()
    assert {path.stem for path in closure(["it"])} - {"it", "__init__"} == reached
    written._needs.cache_clear()


@pytest.mark.parametrize("cls", [Nearest, MOfN, ConstantVelocity], ids=lambda cls: cls.__name__)
@pytest.mark.costly
def test_what_its_laws_execute_is_among_its_files(cls):
    """But for the hooks, which the registry looks up once, and the plugins' parts beside which far scenes try it."""
    beside = names(
        closure({type(part).__module__ for _, part in (*parts(trackers._usual(0.0)), *parts(trackers._usual(9.0)))})
    )
    executed = set()

    def seen(frame, event, argument):
        if event == "call":
            executed.add(frame.f_code.co_filename)

    quick, drawer = evolve(FAST, examples=1, trials=1, runs=20, shrink=False), components(cls)
    laws = [law for law in laws_of(cls) if law.effort not in ("long", "shown")]
    sys.setprofile(seen)
    try:
        for law in laws:
            examine(cls, law, drawer, quick)
    finally:
        sys.setprofile(None)
    sources = [f"{ROOT}{os.sep}{folder}{os.sep}" for folder in ("core", "plugins", "simulators")]
    files = {os.path.relpath(file, ROOT).replace(os.sep, "/") for file in executed if file.startswith(tuple(sources))}
    assert len(files) > 5
    others = {file for file in beside if file.startswith("plugins/")}
    missed = files - files_of(cls) - others
    assert {file for file in missed if not file.startswith(OF_ALL) and "/__init__" not in file} == set()


@pytest.mark.costly
def test_a_change_is_of_the_kinds_that_import_it():
    assert of("plugins/vedette_standard/associators/nearest.py") == {"Nearest"}
    assert of("README.md", "tests/conftest.py") == set()
    assert of("plugins/vedette_standard/motion/blocks.py") > {"ConstantVelocity", "Singer"}
    assert not of("plugins/vedette_standard/motion/blocks.py") & {"Nearest", "MOfN"}
    motions = {entry.cls.__name__ for entry in Registry.installed() if entry.role == "motion"}
    assert of("core/vedette/testing/laws/motion.py") == motions
    assert of("core/vedette/roles.py") == of("core/cpp/gauss.hpp") == {cls.__name__ for cls in KINDS}


def test_a_kind_of_somebody_else_is_always_tried():
    theirs = type("Theirs", (Nearest,), {"__module__": "elsewhere"})
    assert changed({Nearest, theirs}, frozenset()) == {theirs}


@pytest.mark.costly
def test_whoever_puts_a_mutant_s_fault_into_a_kind_has_its_laws_tried():
    """A fault is a change: which kinds are drawn loses no mutant, ours nor those of others."""
    ours = {base for _, base, *_ in OURS if base in KINDS}
    assert len(ours) > 30
    for base in ours:
        assert base in changed(KINDS, frozenset(names([known()[base.__module__]])))
    others = {type(mutant.make()) for mutant in FOREIGN}
    assert changed(others, frozenset()) == others


def test_a_commit_draws_the_same_part_and_another_commit_another():
    parts = [drawn(KINDS, f"{i:040x}") for i in range(400)]
    assert {len(part) for part in parts} == {-(-len(KINDS) // SHARE)}
    assert parts[3] == drawn(sorted(KINDS, key=repr), f"{3:040x}")
    assert len({frozenset(part) for part in parts}) == 400
    assert set().union(*parts) == KINDS


@pytest.mark.costly
def test_what_is_chosen_is_told():
    kinds, line = chosen(KINDS, Since("a" * 40, "b" * 40, frozenset({"plugins/vedette_standard/estimators/kalman.py"})))
    assert Kalman in kinds
    assert SHARE * (len(kinds) - 1) < 2 * len(KINDS)
    assert "a" * 10 in line
    assert "b" * 10 in line
    assert "--all" in line
    assert chosen(KINDS, None)[0] == KINDS


def test_a_change_of_all_tries_so_many_and_first_those_whose_own_file_it_is():
    theirs = type("Theirs", (Nearest,), {"__module__": "elsewhere"})
    of_all = frozenset({"core/cpp/gauss.hpp", "plugins/vedette_standard/estimators/kalman.py"})
    rounds = [chosen(KINDS | {theirs}, Since("a" * 40, f"{i:040x}", of_all)) for i in range(120)]
    assert {len(kinds) for kinds, _ in rounds} == {MOST_KINDS}
    assert all({Kalman, theirs} <= kinds for kinds, _ in rounds)
    assert set().union(*(kinds for kinds, _ in rounds)) == KINDS | {theirs}
    assert f"{MOST_KINDS} of {len(KINDS) + 1} of" in rounds[0][1]


def test_costly_tests_are_tried_where_what_they_test_has_changed():
    files = "tests/vts/test_reproduction.py", __file__
    tests = {f"{file}::{i}": ROOT / file for file in files for i in range(MOST_COSTLY // len(files))}
    ours = {name for name in tests if "vts" in name}

    def of(*files):
        return costly(tests, Since("a" * 40, "b" * 40, frozenset(files)))

    assert costly(tests, None) == set(tests)
    assert len(of()) == -(-len(tests) // SHARE)
    for file in (
        "tests/vts/test_reproduction.py",
        "plugins/vedette_vts/reproduction.py",
        "plugins/vedette_standard/motion/constant_velocity.py",
        "plugins/vedette_vts/data/of_any_kind.csv",
        "core/vedette/space.py",
        "core/cpp/gate.cpp",
    ):
        assert ours <= of(file), file
    assert of("docs/index.md", "tests/marine/test_chain.py") == of()
    page = {"slow blocks": ROOT / "README.md"}
    assert costly(page | tests, Since("a" * 40, "b" * 40, frozenset({"README.md"}))) >= set(page)
    many = {f"{name} {i}": path for name, path in tests.items() for i in range(6)}
    own = {name for name in many if "vts" in name}
    tried = costly(many, Since("a" * 40, "b" * 40, frozenset({"core/vedette/space.py", "tests/vts/test_reproduction.py"})))
    assert len(tried) == MOST_COSTLY
    assert tried < own


def test_of_cases_that_take_turns_one_is_tried_in_every_run_and_each_in_its_own():
    cases = [f"a.py::test_{test}[{i}]" for test in "xy" for i in range(5)]
    rounds = [by_turns(cases, Since("a" * 40, f"{i:040x}", frozenset())) for i in range(60)]
    assert {tuple(sorted(name[11] for name in tried)) for tried in rounds} == {("x", "y")}
    assert set().union(*rounds) == set(cases)
    assert len({frozenset(tried) for tried in rounds}) > 20  # not the same case of both


@pytest.fixture
def repository(tmp_path):
    """A folder with a commit on main, and a function that runs git there."""

    def git(*words):
        who = ["-c", "user.name=x", "-c", "user.email=x@y", "-c", "commit.gpgsign=false"]
        return subprocess.run(
            ["git", "-C", str(tmp_path), *who, *words], check=True, capture_output=True, text=True
        ).stdout.strip()

    git("init", "-q", "-b", "main")
    (tmp_path / "first").write_text("1")
    git("add", "-A")
    git("commit", "-q", "-m", "first")
    return tmp_path, git


def commit(repository, name):
    folder, git = repository
    (folder / name).write_text(name)
    git("add", "-A")
    git("commit", "-q", "-m", name)
    return git("rev-parse", "HEAD")


def test_a_branch_is_compared_with_where_it_left_main(repository):
    folder, git = repository
    base = commit(repository, "second")
    git("switch", "-q", "-c", "branch")
    commit(repository, "third")
    head = commit(repository, "fourth")
    git("switch", "-q", "main")
    commit(repository, "of another")
    git("switch", "-q", "branch")
    (folder / "first").write_text("uncommitted")
    (folder / "new").write_text("untracked")
    assert since(folder) == Since(base, head, frozenset({"first", "third", "fourth", "new"}))


def test_main_is_compared_with_its_last_commit_but_one(repository):
    folder, git = repository
    base, head = git("rev-parse", "HEAD"), commit(repository, "second")
    assert since(folder) == Since(base, head, frozenset({"second"}))
    git("switch", "-q", "-c", "branch")
    assert since(folder) == Since(base, head, frozenset({"second"}))


def test_without_history_all_are_tried(repository, tmp_path_factory):
    folder, _ = repository
    assert since(folder) is None  # there is one commit
    assert since(tmp_path_factory.mktemp("no repository")) is None
    (folder / "inner").mkdir()
    commit(repository, "second")
    assert since(folder / "inner") is None
