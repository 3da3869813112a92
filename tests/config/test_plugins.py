"""A faulty plugin is set aside with its reason and harms nobody; asking for what it brings tells the reason in full."""

from __future__ import annotations

import importlib.metadata
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import vedette
from support.drift import drifting
from vedette import ConfigError, Registry
from vedette.cli import main
from vedette_report.page.metrics import metrics

Distribution = Callable[[str, str, str], Path]


def config(kind: str = "constant_velocity", estimator: str = "kalman") -> dict[str, Any]:
    return {
        "estimator": {"kind": estimator, "motion": {"kind": kind, "sigma_accel": 1.0}},
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
        "associator": {"kind": "nearest"},
        "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
        "lifecycle": {"kind": "m_of_n"},
    }


def changed(old: str, new: str) -> Callable[[str], str]:
    def change(source: str) -> str:
        assert old in source
        return source.replace(old, new)

    return change


CURRENT = 'fields.quantity("m/s", "speed of the water", at_least=0)'
UNTOLD = "__import__('attrs').field(converter=str, factory=object)"
FAULTS: dict[str, tuple[Callable[[str], str], str]] = {
    "another contract": (changed("CONTRACT = 2", "CONTRACT = 1"), "it is written for version 1 of the contract"),
    "no contract": (changed("VEDETTE_CONTRACT = 2", ""), "it does not state the version of the contract"),
    "no hook": (changed("@vedette.plugin", ""), "it has no function `vedette_components`"),
    "a wrong hook": (changed("vedette_components()", "vedette_components(config)"), "its hook does not fit"),
    "an unknown hook": (changed("vedette_components()", "vedette_component()"), "its hook does not fit"),
    "a failing hook": (changed("return [Drift]", "return [1 / 0]"), "it failed: ZeroDivisionError: division by zero"),
    "a silent hook": (changed("return [Drift]", "return"), "its function `vedette_components` returns nothing"),
    "not a class": (changed("return [Drift]", "return [Drift, 3]"), "3 is not a class"),
    "no role": (changed("return [Drift]", "return [Drift, dict]"), "dict plays none of the roles"),
    "incomplete": (changed("def move(", "def moves("), "Drift is incomplete; a motion must also define move"),
    "not attrs": (changed("@frozen\n", ""), "Drift is not an attrs class"),
    "not frozen": (changed("@frozen\n", "@__import__('attrs').define\n"), "Drift is not frozen"),
    "not frozen, no slots": (changed("@frozen\n", "@__import__('attrs').mutable(slots=False)\n"), "Drift is not frozen"),
    "an unchecked parameter": (changed(CURRENT, "3.0"), "current: nothing checks"),
    "an untold default": (changed(CURRENT, UNTOLD), "Drift: current: its default cannot be told: a config cannot hold"),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_a_faulty_plugin_is_set_aside_and_harms_no_other(fault: str, distribution: Distribution) -> None:
    change, reason = FAULTS[fault]
    distribution("bad-dist", "vedette_test_bad", change(drifting()))
    distribution("good-dist", "vedette_test_good", drifting("Tide", "tide"))
    registry = Registry.installed()
    assert registry.get("motion", "tide").distribution == "good-dist"
    assert registry.find("motion", "drift") is None
    vedette.build(config())
    with pytest.raises(ConfigError, match=rf"plugin 'main' of bad-dist 1\.0 is set aside: .*({reason})"):
        registry.get("motion", "drift")


def test_a_kind_whose_plugin_is_set_aside_is_told_where_a_config_asks_for_it(
    distribution: Distribution,
) -> None:
    distribution("bad-dist", "vedette_test_bad", drifting().replace("def move(", "def moves("))
    with pytest.raises(ConfigError) as caught:
        vedette.build(config("drift"))
    reason = "plugin 'main' of bad-dist 1.0 is set aside: Drift is incomplete; a motion must also define move"
    assert str(caught.value) == f"estimator.motion.kind: {reason}"
    with pytest.raises(ConfigError) as caught:
        vedette.build(config("constant_velocty"))
    assert "bad-dist" not in str(caught.value), "what it would bring is known, and it is not this"


def test_the_cause_of_a_plugin_that_cannot_be_imported_is_told_whole_and_before_any_list(distribution: Distribution) -> None:
    cause = "the library of tides needs " + "a very long explanation " * 30 + "and ends here"
    distribution("foo-dist", "vedette_test_broken", f"raise ImportError({cause!r})\n")
    distribution("quit-dist", "vedette_test_quits", "raise SystemExit(3)\n")
    with pytest.raises(ConfigError) as caught:
        vedette.build(config("tide"))
    told = str(caught.value)
    assert f"plugin 'main' of foo-dist 1.0 could not be imported: ImportError: {cause}" in told
    assert "plugin 'main' of quit-dist 1.0 could not be imported: SystemExit: 3" in told
    assert told.index("ends here") < told.index("installed: ")


def test_a_kind_that_two_third_parties_bring_is_of_neither(distribution: Distribution) -> None:
    distribution("one-dist", "vedette_test_one", drifting("One"))
    distribution("other-dist", "vedette_test_other", drifting("Other"))
    registry = Registry.installed()
    both = r"one-dist 1.0 \(vedette_test_one.One\) and by other-dist 1.0 \(vedette_test_other.Other\), so neither is used"
    with pytest.raises(ConfigError, match=both):
        registry.get("motion", "drift")
    with pytest.raises(ConfigError, match=f"^estimator.motion.kind: the motion kind 'drift' is brought by {both}"):
        vedette.build(config("drift"), registry)
    vedette.build(config(), registry)


def test_a_stranger_does_not_replace_a_kind_of_vedettes(distribution: Distribution) -> None:
    distribution("one-dist", "vedette_test_one", drifting(kind="constant_velocity"))
    with pytest.raises(ConfigError, match=r"'constant_velocity' is brought by one-dist 1\.0 "):
        vedette.build(config())
    assert Registry.installed().find("motion", "constant_acceleration") is not None


def test_one_class_that_two_plugins_name_is_one_kind(distribution: Distribution) -> None:
    distribution("one-dist", "vedette_test_one", drifting("One"))
    distribution("other-dist", "vedette_test_other", "from vedette_test_one import *\n")
    registry = Registry.installed()
    assert (registry.clashes, registry.broken) == ((), ())
    assert registry.get("motion", "drift").cls.__name__ == "One"


def test_what_is_installed_is_read_again_only_where_it_changed(
    distribution: Distribution, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []
    found = importlib.metadata.entry_points
    monkeypatch.setattr(importlib.metadata, "entry_points", lambda **given: asked.append(given) or found(**given))
    for _ in range(9):
        Registry.installed()
    assert len(asked) <= 1
    distribution("acme", "acme_tracking", drifting())
    assert Registry.installed().find("motion", "drift") is not None
    assert len(asked) <= 2


@pytest.fixture
def three(distribution: Distribution) -> None:
    """Install a plugin of another contract, one that cannot be imported, and one that takes a name of Vedette's own."""
    distribution("old-dist", "vedette_test_old", drifting(contract=1))
    distribution("foo-dist", "vedette_test_broken", "import not_there\n")
    distribution("one-dist", "vedette_test_one", drifting(kind="singer"))


REASONS = (
    "plugin 'main' of old-dist 1.0 is set aside: it is written for version 1 of the contract",
    "plugin 'main' of foo-dist 1.0 could not be imported: ModuleNotFoundError: No module named 'not_there'",
    "the motion kind 'singer' is brought by one-dist 1.0 (vedette_test_one.Drift) and by vedette ",
)


@pytest.mark.usefixtures("three")
@pytest.mark.parametrize("command", [["info"], ["components"], ["components", "associator"]])
def test_listings_tell_every_reason(command: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(command) == 0
    told = capsys.readouterr().out
    assert [reason for reason in REASONS if reason not in told] == []


@pytest.mark.usefixtures("three")
def test_listings_in_json_tell_every_reason(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["components", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert [plugin["distribution"] for plugin in listed["broken"]] == ["foo-dist 1.0", "old-dist 1.0"]
    assert [(clash["role"], clash["kind"], len(clash["bringers"])) for clash in listed["clashes"]] == [
        ("motion", "singer", 2)
    ]
    assert main(["info", "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["unused"]) == 3


@pytest.mark.usefixtures("three")
@pytest.mark.parametrize(("kind", "place"), [("drift", 0), ("tide", 1), ("singer", 2)])
def test_check_tells_the_reason(kind: str, place: int, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", kind]) == 2
    assert REASONS[place] in capsys.readouterr().err


@pytest.mark.usefixtures("three")
def test_a_run_without_them_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vedette_report.drawing.brought.can_draw", lambda: False)
    path = _scene(tmp_path)
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 0


def test_a_plugin_that_fails_to_write_its_files_does_not_take_the_others_with_it(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    distribution: Distribution,
) -> None:
    monkeypatch.setattr("vedette_report.drawing.brought.can_draw", lambda: False)
    hook = "\n@vedette.plugin\ndef vedette_files(folder):\n    {}\n"
    distribution("bad-dist", "vedette_test_bad", drifting() + hook.format("raise ValueError('no ink')"))
    distribution("fine-dist", "vedette_test_fine", drifting("Tide", "tide") + hook.format("return ['tides.txt']"))
    assert main(["run", str(_scene(tmp_path)), "--out", str(tmp_path / "out")]) == 0
    told = capsys.readouterr()
    assert "tides.txt" in told.out
    assert told.err == "vedette: plugin 'main' of bad-dist 1.0: its vedette_files failed: ValueError: no ink\n"


@pytest.mark.parametrize("hook", ["vedette_draft(path)", "vedette_page(folder)"])
@pytest.mark.parametrize(
    "error", ["ZeroDivisionError('no ink')", "ConnectionError('no ink')", "OSError(2, 'no ink', '/ink')"]
)
@pytest.mark.by_turns
def test_a_plugin_that_fails_at_a_file_or_folder_does_not_keep_it_from_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, distribution: Distribution, hook: str, error: str
) -> None:
    monkeypatch.setattr("vedette_report.drawing.brought.can_draw", lambda: False)
    failing = f"\n@vedette.plugin\ndef {hook}:\n    raise {error}\n"
    distribution("bad-dist", "vedette_test_bad", drifting() + failing)
    run, data = str(tmp_path / "out"), tmp_path / "data.csv"
    data.write_text("time,x,y\n" + "".join(f"{i},{10 * i},{i % 3}\n" for i in range(20)))
    asked = ["new", "config", str(data), "--out", str(tmp_path / "data.toml")] if "draft" in hook else ["report", run]
    assert main(["run", str(_scene(tmp_path)), "--out", run]) == 0
    named = hook.partition("(")[0]
    with pytest.warns(RuntimeWarning, match=f"'main' of bad-dist 1.0: its {named} failed: .*no ink"):
        assert main(asked) in (0, 3)


@pytest.mark.parametrize("raised", ["OSError(28, 'no room')", "PermissionError(13, 'no right', str(path))"])
def test_a_full_disk_and_a_file_that_cannot_be_read_are_no_plugins_fault(
    tmp_path: Path, distribution: Distribution, raised: str, capsys: pytest.CaptureFixture[str]
) -> None:
    hook = f"\n@vedette.plugin\ndef vedette_draft(path):\n    raise {raised}\n"
    distribution("bad-dist", "vedette_test_bad", drifting() + hook)
    data = tmp_path / "data.csv"
    data.write_text("time,x,y\n0,1,2\n")
    assert main(["new", "config", str(data), "--out", str(tmp_path / "data.toml")]) == 2
    assert "no r" in capsys.readouterr().err


FIGURE = """

class Largest:
    most = None

    def add(self, block):
        if block.pairs.square.size:
            self.most = max(self.most or 0.0, float(block.pairs.square.max() ** 0.5))

    def value(self):
        return self.most

@vedette.plugin
def vedette_figures():
    from vedette.metrics import Figure
    return [Figure("NAME", "m", "largest position error", study="STUDY", start=Largest)]
"""


def with_figure(name: str, study: str) -> str:
    return drifting() + FIGURE.replace("NAME", name).replace("STUDY", study)


def test_a_plugins_figure_is_told_of_every_run_and_study(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, distribution: Distribution
) -> None:
    monkeypatch.setattr("vedette_report.drawing.brought.can_draw", lambda: False)
    distribution("large-dist", "vedette_test_large", with_figure("largest_m", "largest"))
    scene, out = _scene(tmp_path), tmp_path / "out"
    assert main(["run", str(scene), "--out", str(out), "--report"]) == 0
    found = json.loads((out / "summary.json").read_text())
    assert found["largest_m"] > found["position_rmse_m"]
    assert f"{found['largest_m']:.3g} m: largest position error" in (out / "summary.txt").read_text()
    (row,) = (row for row in metrics([found], (), (), "m")["rows"] if row["name"] == "largest_m")
    assert (row["about"], row["unit"], row["values"]) == ("largest position error", "m", [found["largest_m"]])
    study = vedette.monte_carlo(scene, runs=2, seed=1)
    assert study.means(0)["largest"].value > 0
    assert study.data()["units"]["largest"] == "m"


FAULTY_FIGURES = {
    "an array": ("return self.most", "import numpy as np; return np.array([1.0, 2.0])", "TypeError"),
    "a text": ("return self.most", "return 'high'", "TypeError"),
    "raises at the end": ("return self.most", "return 1 / 0", "ZeroDivisionError"),
    "raises at a block": ("if block.pairs", "[][1]\n        if block.pairs", "IndexError"),
    "cannot start": ("most = None", "def __init__(self):\n        raise OverflowError", "OverflowError"),
    "no number": ("return self.most", "return float('nan')", ""),
}


@pytest.mark.parametrize("fault", FAULTY_FIGURES)
@pytest.mark.by_turns
def test_a_faulty_figure_is_left_out_and_the_run_is_kept(
    fault: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    distribution: Distribution,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """One of a plugin lost a run of hours."""
    monkeypatch.setattr("vedette_report.drawing.brought.can_draw", lambda: False)
    old, new, error = FAULTY_FIGURES[fault]
    distribution("large-dist", "vedette_test_large", changed(old, new)(with_figure("largest_m", "largest")))
    scene, out = _scene(tmp_path), tmp_path / "out"
    assert main(["run", str(scene), "--out", str(out)]) == 0
    told = [line for line in capsys.readouterr().err.splitlines() if "largest_m" in line]
    assert len(told) == bool(error)
    assert all(error in line for line in told)
    found = json.loads((out / "summary.json").read_text())
    assert found["position_rmse_m"] > 0
    assert "largest_m" not in found
    assert "nan" not in (out / "summary.txt").read_text()
    study = vedette.monte_carlo(scene, runs=2, seed=1)
    assert study.means(0)["position_rmse"].value > 0


@pytest.mark.parametrize(("name", "study"), [("gospa_m", "own"), ("own_m", "gospa"), ("two words", "own")])
def test_a_plugin_with_a_figure_that_there_is_already_is_set_aside(
    distribution: Distribution, name: str, study: str
) -> None:
    distribution("large-dist", "vedette_test_large", with_figure(name, study))
    (aside,) = Registry.installed().broken
    assert name in aside.error


def _scene(folder: Path) -> Path:
    ship = {"start": [0, 100], "speed": 8.0}
    source = {"kind": "simulation", "duration": 5, "looks": {"radar": {"interval": 1.0}}, "ships": {"one": ship}}
    path = folder / "scene.json"
    path.write_text(json.dumps({**config(), "source": source}))
    return path


USES_IT = """
import json, sys, vedette
tracker = vedette.build(json.loads(sys.argv[1]))
entry = vedette.Registry.installed().get("motion", "drift")
print(json.dumps([vedette.to_config(tracker), entry.describe()]))
"""


@pytest.mark.costly
def test_a_third_partys_motion_model_works_in_a_config_of_another_process(
    distribution: Distribution,
) -> None:
    folder = distribution("drift-dist", "vedette_test_drift", drifting())
    distribution("foo-dist", "vedette_test_broken", "raise RuntimeError('half installed')\n")
    config = {
        "estimator": {"kind": "ekf", "motion": {"kind": "drift", "current": "2 kn"}},
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
        "associator": {"kind": "nearest"},
        "birth": {"kind": "from_returns"},
        "lifecycle": {"kind": "m_of_n"},
    }
    paths = os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])
    run = subprocess.run(
        [sys.executable, "-c", USES_IT, json.dumps(config)],
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    built, entry = json.loads(run.stdout)
    assert built["estimator"]["motion"] == {"kind": "drift", "current": pytest.approx(2 * 1852 / 3600)}
    assert (entry["distribution"], entry["version"], entry["summary"]) == ("drift-dist", "1.0", "Drifts with the current.")
    assert entry["parameters"][0]["unit"] == "m/s"
