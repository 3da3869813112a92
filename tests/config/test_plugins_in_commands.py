"""Faulty plugins in every command: each is named with its reason, and none ends a process in silence."""

import pytest

from support.drift import drifting
from vedette.cli import main
from vedette.config.registry import Registry

CONFIG = """
[source]
kind = "simulation"
duration = "20 s"
ships.one = {{ start = [0, 100], speed = 8.0 }}
looks.radar = {{ interval = 2.0 }}
[sensors.radar]
kind = "cartesian_position"
sigma = 5.0
[estimator]
kind = "ekf"
motion = {{ kind = "{kind}", current = 1.0 }}
[associator]
kind = "gnn"
[birth]
kind = "from_returns"
spread = {{}}
[lifecycle]
kind = "m_of_n"
"""


@pytest.mark.parametrize(
    ("move", "told"),
    [
        ("raise SystemExit(7)", "move raised SystemExit: 7"),
        ("return None", "move must return (*b, 2) or (2,), *b being (1,) here, an array of numbers; got nothing"),
        ("return 'abc'", "move must return (*b, 2) or (2,), *b being (1,) here, an array of numbers; got a str"),
        ("return np.zeros((3, 3, 7))", "move must return (*b, 2) or (2,), *b being (1,) here; got (3, 3, 7)"),
        ("return x * np.nan", "move must return finite numbers; got nan in 2 of 2"),
    ],
)
@pytest.mark.by_turns
def test_a_method_at_fault_is_named_by_explain_as_by_run(tmp_path, capsys, distribution, move, told):
    distribution("odd-dist", "vedette_test_odd", drifting().replace("return x + self.current * dt", move))
    path = tmp_path / "odd.toml"
    path.write_text(CONFIG.format(kind="drift"))
    for command in (["explain", str(path)], ["run", str(path), "--stream", "--out", str(tmp_path / "out")]):
        code, said = main(command), capsys.readouterr().err
        assert code == 2, said
        assert told in said.splitlines()[-1]
        assert "(vedette_test_odd.Drift)" in said


def test_a_kind_that_two_bring_is_told_with_both_by_every_command_that_names_it(capsys, distribution):
    for name in ("one", "two"):
        distribution(f"{name}-dist", f"vedette_test_{name}", drifting())
    for command in ("components", "check"):
        assert main([command, "drift"]) == 2
        (told,) = capsys.readouterr().err.splitlines()
        assert "drift: the motion kind 'drift' is brought by one-dist 1.0" in told
        assert "two-dist 1.0" in told


def test_a_kind_whose_plugin_is_set_aside_is_told_with_the_reason(capsys, distribution):
    distribution("old-dist", "vedette_test_old", drifting(contract=1))
    distribution("gone-dist", "vedette_test_gone", "import nowhere_to_be_found")
    assert main(["components", "drift"]) == 2
    assert "drift: plugin 'main' of old-dist 1.0 is set aside: it is written for version 1" in capsys.readouterr().err
    assert main(["components", "shift"]) == 2
    told = capsys.readouterr().err
    assert told.index("No module named 'nowhere_to_be_found'") < told.index("the roles are")


@pytest.mark.parametrize("kind", ["a b", "a\\n", "\\x1b[31m", ".drift", "a,b", "a=b", "a/b"])
def test_a_kind_that_no_config_could_write_sets_its_plugin_aside(distribution, kind):
    distribution("odd-dist", "vedette_test_odd", drifting(kind=kind))
    (told,) = Registry.installed().reasons()
    assert "Drift: its kind must be one word" in told
    assert told.isprintable()


@pytest.mark.parametrize("kind", ["drift-2", "drift_2.1", "dérive", "2d"])
def test_other_words_are_kinds(distribution, kind):
    distribution("odd-dist", "vedette_test_odd", drifting(kind=kind))
    assert kind in [entry.kind for entry in Registry.installed().of_role("motion")]
