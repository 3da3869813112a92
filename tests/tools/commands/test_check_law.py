"""`vedette check`: one law alone, a failure repeated, a closing count, an exit code of its own where nothing was tested."""

import sys

import attrs
import numpy as np
import pytest
from hypothesis import strategies as st

from vedette.cli import main
from vedette.testing import FAST, Misuse, examine
from vedette.testing.comparisons import Broken
from vedette.testing.law import Law
from vedette.testing.laws.motion_cases import Moves
from vedette.testing.strategies import components
from vedette_standard.motion.constant_velocity import ConstantVelocity


def test_one_law_is_tried_and_counted(capsys):
    assert main(["check", "constant_velocity", "--law", "two_steps_make_one"]) == 0
    assert capsys.readouterr().out.splitlines()[-1].strip() == "1 held"


def test_where_no_law_applies_nothing_was_tested(capsys):
    assert main(["check", "range_bearing", "--law", "linear_as_declared"]) == 4
    assert capsys.readouterr().out.splitlines()[-1].strip().startswith("1 skipped: ")


BLIND = """
import numpy as np
from attrs import frozen
from vedette import ImagingSensor, Space

@frozen
class Blind(ImagingSensor):
    kind = "test_blind_camera"
    observes = measurement = Space.of(azimuth="rad", elevation="rad")
    def measure(self, x): return x + 0.0
    def noise(self, x): return 1e-4 * np.eye(2)
    def detects(self, x): return np.array(0.9)
    def information(self, x, frame, at): return np.zeros((*x.shape, 2)), np.zeros(x.shape), np.zeros(x.shape[:-1])
"""


@pytest.mark.costly
def test_where_none_of_the_laws_of_cameras_applies_a_camera_was_not_tested(capsys, monkeypatch, tmp_path):
    (tmp_path / "vedette_test_blind.py").write_text(BLIND)
    monkeypatch.syspath_prepend(str(tmp_path))
    assert main(["check", "vedette_test_blind"]) == 4
    told = capsys.readouterr().out.splitlines()[-1]
    assert "held" in told
    assert "no law of pictures applied, since " in told


@pytest.mark.parametrize(("law", "named"), [("survives_its_lifetime", True), ("tracks_are_judged_alone", False)])
def test_a_parameter_that_its_name_would_have_tested_more_is_named(capsys, law, named):
    assert main(["check", "score", "--law", law]) == (4 if named else 0)
    assert any("lifetime" in line and "`" not in line for line in capsys.readouterr().out.splitlines()) is named


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # hypothesis times the collection of garbage
@pytest.mark.parametrize(("seconds", "code"), [("0.001", 1), ("60", 0)])
def test_a_law_has_so_many_seconds(capsys, seconds, code):
    assert main(["check", "constant_velocity", "--law", "pure", "--seconds", seconds]) == code


def test_a_law_that_there_is_not_is_wrong_use(capsys):
    assert main(["check", "constant_velocity", "--law", "two_step_make_one"]) == 2
    assert "two_steps_make_one" in capsys.readouterr().err


LEAPING = """
import numpy as np
from attrs import frozen
from vedette import MotionModel, Space, fields

@frozen
class Leaping(MotionModel):
    kind = "test_leaping_far_away"
    reach: float = fields.quantity("m", "beyond it moves at once", at_least=100, at_most=300)
    @property
    def state(self): return Space.of(x="m")
    def move(self, x, dt): return np.where(np.abs(x) > self.reach, x + JUMP, x)
    def noise(self, x, dt): return dt * 0.1 * np.ones((*x.shape[:-1], 1, 1))
"""


def failure(capsys, *options):
    """Return the exit code, and what is told of the law that fails, without how to repeat it; and how."""
    code = main(["check", "vedette_test_leaping", "--law", "zero_step_changes_nothing", *options])
    told = [line.strip() for line in capsys.readouterr().out.splitlines()]
    repeat = [line.split()[-1] for line in told if line.startswith("repeat it with")]
    return code, [line for line in told if not line.startswith("repeat it with")], repeat


def test_a_failure_is_repeated_by_its_code_from_any_seed_and_is_gone_once_it_is_mended(capsys, monkeypatch, tmp_path):
    path = tmp_path / "vedette_test_leaping.py"
    path.write_text(LEAPING.replace("JUMP", "1.0"))
    monkeypatch.syspath_prepend(str(tmp_path))
    code, told, (replay,) = failure(capsys)
    assert code == 1
    assert failure(capsys, "--replay", replay, "--seed", "3")[:2] == (1, told)
    module = sys.modules["vedette_test_leaping"]
    monkeypatch.setattr(module.Leaping, "move", lambda self, x, dt: x + 0.0)
    code, told, repeat = failure(capsys, "--replay", replay)
    assert (code, repeat, told[-1]) == (0, [], "1 held")
    assert failure(capsys, "--replay", "cut/short")[0] == 2


def unsure(component, drawn):
    """Wrong at first, then right."""
    calls.append(drawn)
    if len(calls) == 1:
        raise Broken("it moves")


def endless(component, drawn):
    """Never ends."""
    while True:
        pass


calls = []


@pytest.mark.parametrize("check", [unsure, endless])
def test_every_failure_says_which_component_it_is_and_on_what(check):
    calls.clear()
    profile = attrs.evolve(FAST, seconds=0.2)
    outcome = examine(ConstantVelocity, Law(check), components(ConstantVelocity), profile)
    assert (outcome.verdict, outcome.law.name) == ("failed", check.__name__)
    _, component, data = outcome.text.splitlines()
    assert component.strip().startswith("with ConstantVelocity(")
    assert data.strip().startswith("and Moves(x=")


def test_a_law_that_is_late_before_anything_was_drawn_says_so():
    drawn = components(ConstantVelocity).map(lambda component: endless(component, None))
    outcome = examine(ConstantVelocity, Law(unsure), drawn, attrs.evolve(FAST, seconds=0.2))
    assert (outcome.verdict, outcome.text) == ("failed", "takes longer than 0.2 s of CPU time")


def stepping(component, drawn):
    """Wrong for all steps but short ones."""
    calls.append((component, drawn))
    if drawn.dt > 1.0:
        raise Broken("too long")


@pytest.mark.costly
def test_a_counterexample_can_be_pasted():
    calls.clear()
    outcome = examine(ConstantVelocity, Law(stepping), components(ConstantVelocity), FAST)
    _, component, drawn = (line.strip() for line in outcome.text.splitlines())
    pasted = eval(component.removeprefix("with "), {"ConstantVelocity": ConstantVelocity})
    assert pasted == calls[-1][0]
    drawn = eval(drawn.removeprefix("and "), {"np": np, "Moves": Moves})
    assert attrs.asdict(drawn, filter=lambda field, _: field.repr).keys() == attrs.asdict(calls[-1][1]).keys()
    assert (drawn.dt, drawn.x.tolist()) == (calls[-1][1].dt, calls[-1][1].x.tolist())


def test_a_strategy_that_draws_nothing_is_named_by_its_place():
    drawn = components(ConstantVelocity, {"sigma_accel": st.floats(2.0, 1.0)})
    with pytest.raises(Misuse) as told:
        examine(ConstantVelocity, Law(unsure), drawn, FAST)
    assert str(told.value).startswith("ConstantVelocity.unsure: ")
