"""The code behind a result: its packages, and a hash of their sources."""

from __future__ import annotations

from pathlib import Path

import pytest

from support.clusters import boat
from vedette_report import provenance

KINDS = {"simulation", "constant_velocity", "cartesian_position", "kalman", "pda", "given", "single_target"}


def test_the_kinds_of_a_config_say_whose_code_it_needs() -> None:
    config = boat(duration=20)
    assert set(provenance.kinds_in(config)) == KINDS
    packages = {"vedette", "vedette_files", "vedette_sim", "vedette_standard"}
    assert set(provenance.packages_of([config])) == packages
    assert set(provenance.packages_of([config], "vedette_study")) == packages | {"vedette_study"}


def test_what_must_be_equal_is_refused_and_the_rest_told() -> None:
    here = provenance.identity(("vedette",))
    assert provenance.differences(here, here, "there") == ([], [])
    refused, told = provenance.differences({**here, "numpy": "0", "machine": "abacus"}, here, "there")
    assert ([problem.place for problem in refused], len(told)) == (["there"], 1)
    assert (
        provenance.digest({**here, "machine": "abacus"})
        == provenance.digest(here)
        != provenance.digest({**here, "numpy": "0"})
    )


def test_sources_are_hashed_by_name_and_content(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    folder = tmp_path / "vedette_hashed"
    folder.mkdir()
    (folder / "__init__.py").write_text("x = 1\n")
    before = provenance.sources("vedette_hashed")
    (folder / "data.pyc").write_bytes(b"0")
    assert provenance.sources("vedette_hashed") == before
    (folder / "__init__.py").write_bytes(b"x = 1\r\n")
    assert provenance.sources("vedette_hashed") == before
    (folder / "__init__.py").write_text("x = 2\n")
    assert provenance.sources("vedette_hashed") != before
    assert provenance.sources("vedette_nowhere_at_all") == "none"
