"""`vedette new plugin NAME --role ROLE`: each package holds a component that works and keeps its laws."""

import importlib
import importlib.util
import subprocess
import sys
import tomllib

import numpy as np
import pytest

import vedette
from vedette.cli import main
from vedette.config.contract import described
from vedette_tools.drafting.package import ROLES, USES

RIGHT = {
    "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
    "sensors": {"radar": {"kind": "range_bearing", "sigma_range": 5, "sigma_bearing": 0.01, "max_range": 5000}},
    "associator": {"kind": "nearest"},
    "birth": {"kind": "from_returns", "spread": {"vx": 10, "vy": 10}},
    "lifecycle": {"kind": "m_of_n"},
}
INSTALLED = vedette.Registry.installed()


def drafted(role, folder, monkeypatch):
    """Write a package, and return the one component that it brings and what its README says of its use."""
    out = folder / f"vedette-try-{role}"
    assert main(["new", "plugin", f"try-{role}", "--role", role, "--out", str(out)]) == 0
    monkeypatch.syspath_prepend(out / "src")
    module = importlib.import_module(f"vedette_try_{role}")
    assert tomllib.loads((out / "pyproject.toml").read_text())["project"]["entry-points"]["vedette"] == {
        f"try_{role}": module.__name__
    }
    (cls,) = module.vedette_components()
    use = next(line for line in (out / "README.md").read_text().splitlines() if "may then say" in line)
    return cls, tomllib.loads(use.split("`")[1])


def tracks_of(config, registry):
    """Return the confirmed tracks of two targets after twelve scans by a radar."""
    rng, tracker = np.random.default_rng(0), vedette.build(config, registry)
    state = tracker.start(seed=1)
    for i in range(12):
        spots = np.array([[1000.0 + 10 * i, 300.0], [-400.0, 800.0 - 8 * i]])
        z = np.stack([np.hypot(*spots.T), np.arctan2(spots[:, 1], spots[:, 0])], axis=-1)
        state = tracker.step(
            state, vedette.Scan(float(i), "radar", vedette.Detections.of(z + rng.normal(size=(2, 2)) * [5, 0.01]))
        )
    assert state.confirmed.all()
    return tracker.estimate(state).mean


def placed(role, use):
    """Return the config with the drafted component in its place."""
    if role == "motion":
        return RIGHT | {"estimator": {"kind": "ekf", **use}}
    return RIGHT | use


@pytest.mark.parametrize("role", ROLES)
def test_each_package_holds_a_component_that_tracks(role, tmp_path, monkeypatch, capsys):
    cls, use = drafted(role, tmp_path, monkeypatch)
    entry = described(cls, "given here", "")
    assert (entry.role, entry.kind) == (role, f"try_{role}_{role}")
    found = tracks_of(placed(role, use), vedette.Registry((*INSTALLED.entries, entry)))
    wanted = np.array([[1110.0, 300.0, 10.0, 0.0], [-400.0, 712.0, 0.0, -8.0]])
    assert found.shape == (2, 4)
    assert np.all(np.abs(found - wanted) < [25, 25, 6, 6])
    assert "python -m pytest" in capsys.readouterr().out


def test_all_of_them_work_together(tmp_path, monkeypatch):
    config, entries = dict(RIGHT), list(INSTALLED.entries)
    for role in ROLES:
        cls, use = drafted(role, tmp_path, monkeypatch)
        entries.append(described(cls, "given here", ""))
        if role == "motion":
            motion = use["motion"]
        else:
            config |= use
    config["estimator"] = {"kind": "try_estimator_estimator", "motion": motion}
    assert tracks_of(config, vedette.Registry(tuple(entries))).shape == (2, 4)


def test_a_further_role_is_added_to_the_package_and_nothing_else_of_it_changes(tmp_path, monkeypatch, capsys):
    out = tmp_path / "both"
    assert [main(["new", "plugin", "both", "--role", role, "--out", str(out)]) for role in ROLES] == [0] * len(ROLES)
    monkeypatch.syspath_prepend(out / "src")
    found = importlib.import_module("vedette_both").vedette_components()
    assert [cls.kind for cls in found] == [f"both_{role}" for role in ROLES]
    before = {path: path.read_text() for path in out.rglob("*.*") if path.suffix != ".pyc" and path.is_file()}
    assert main(["new", "plugin", "both", "--role", "motion", "--out", str(out)]) == 2
    assert "motion.py' exists already" in capsys.readouterr().err
    assert before == {path: path.read_text() for path in before}


@pytest.mark.parametrize("text", ["", "import vedette\n", "import vedette\n\ndef vedette_components():\n    return []\n"])
def test_a_package_whose_components_cannot_be_found_is_left_as_it_is(text, tmp_path, capsys):
    init = tmp_path / "odd" / "src" / "vedette_odd" / "__init__.py"
    init.parent.mkdir(parents=True)
    init.write_text(text)
    assert main(["new", "plugin", "odd", "--role", "sensor", "--out", str(tmp_path / "odd")]) == 2
    assert "to add OddSensor to them" in capsys.readouterr().err
    assert [path.name for path in (tmp_path / "odd").rglob("*.*")] == ["__init__.py"]
    assert init.read_text() == text


@pytest.mark.nightly("its laws take seconds, and a wheel is built")
def test_a_package_of_all_roles_keeps_its_laws_and_becomes_a_wheel(tmp_path):
    out = tmp_path / "package"
    for role in ROLES:
        assert main(["new", "plugin", "wheel", "--role", role, "--out", str(out)]) == 0
    run = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-o", "pythonpath=src"]
    done = subprocess.run(run, cwd=out, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stdout
    wheel = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", str(tmp_path), str(out)]
    done = subprocess.run(wheel, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert list(tmp_path.glob("vedette_wheel-0.1.0-py3-none-any.whl"))


def test_a_role_that_is_none_is_refused(tmp_path, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["new", "plugin", "x", "--role", "filter", "--out", str(tmp_path / "x")])
    assert ended.value.code == 2
    assert "invalid choice: 'filter'" in capsys.readouterr().err


def test_the_command_offers_every_role_that_has_a_template(capsys):
    with pytest.raises(SystemExit):
        main(["new", "plugin", "--help"])
    assert "{" + ",".join(USES) + "}" in capsys.readouterr().out
