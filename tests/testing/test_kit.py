"""The kit itself: what it tells its users, what it skips, what it counts, and what `vedette check` prints."""

import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from attrs import frozen
from hypothesis import strategies as st

from support.mutants.table import MUTANTS
from support.paths import DOCS
from vedette import MotionModel, Space, fields
from vedette.cli import main
from vedette.config.parameters import role_of
from vedette.testing import FAST, Misuse, conformance, examine, kit, laws_of
from vedette.testing.laws import imaging_cases
from vedette.testing.strategies import components
from vedette_standard.associators.pda import Pda
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.motion.constant_velocity import ConstantVelocity


@frozen
class NeedsText(MotionModel):
    """A model that is drawn only if somebody says what its text is."""

    kind = "test_needs_text"
    text: str = fields.text("a file")

    @property
    def state(self):
        return Space.of(x="m")

    def move(self, x, dt):
        return x

    def noise(self, x, dt):
        return dt * x[..., None] ** 2


@frozen
class Leaping(NeedsText):
    """Wrong: it moves in no time."""

    kind = "test_leaping"
    text: str = fields.text("a file", default="")

    def move(self, x, dt):
        return x + 1.0


@frozen
class Incomplete(MotionModel):
    """No move, no noise."""

    @property
    def state(self):
        return Space.of(x="m")


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda: conformance(ConstantVelocity, known_failures={"two_step_make_one": ""}), "mean 'two_steps_make_one'"),
        (lambda: conformance(ConstantVelocity, sigma_acel=st.just(1.0)), "did you mean 'sigma_accel'"),
        (lambda: conformance(ConstantVelocity, sigma_accel=1.0), r"must be a Hypothesis strategy.*1.0"),
        (lambda: conformance(Incomplete), "is abstract: define move, noise"),
        (lambda: conformance(MotionModel), "is abstract: define"),
        (lambda: conformance(Space), "is not a component class"),
        (lambda: conformance(NeedsText), r"NeedsText.text: no strategy can be inferred"),
    ],
)
def test_misuse_is_told_in_one_line_that_names_the_cure(ask, words):
    with pytest.raises(Misuse, match=words) as error:
        ask()
    assert "\n" not in str(error.value)


def test_a_class_that_refuses_all_that_is_drawn_is_told():
    law = laws_of(ConstantVelocity)[0]
    with pytest.raises(Misuse, match=r"ConstantVelocity.*sigma_accel.*-1"):
        examine(ConstantVelocity, law, components(ConstantVelocity, {"sigma_accel": st.just(-1.0)}), FAST)


def test_without_hypothesis_the_import_names_the_cure():
    code = "import sys; sys.modules['hypothesis'] = None\nfrom vedette.testing import conformance"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr.splitlines()[-1].endswith("vedette.testing needs hypothesis: pip install 'vedette[testing]'")


def test_a_law_that_has_nothing_to_judge_is_skipped_with_its_reason():
    law = next(law for law in laws_of(Pda) if law.name == "each_return_is_claimed_once")
    outcome = examine(Pda, law, components(Pda), FAST)
    assert (outcome.verdict, outcome.text) == ("skipped", "it does not declare `exclusive`")


def test_a_counterexample_is_small_and_says_what_was_wrong():
    law = next(law for law in laws_of(Leaping) if law.name == "zero_step_changes_nothing")
    outcome = examine(Leaping, law, components(Leaping), FAST)
    assert outcome.verdict == "failed"
    assert "move(x, 0)[0, 0]: must be 0, got 1" in outcome.text  # the smallest state is 0


USER = """
from attrs import frozen
from vedette import MotionModel, Space, fields
from vedette.testing import conformance
from vedette_standard.estimators.kalman import Kalman

@frozen
class Creeping(MotionModel):
    kind = "test_creeping"
    divisible = True
    linear = True
    speed: float = fields.quantity("m/s", "speed", above=0)
    @property
    def state(self): return Space.of(x="m")
    def move(self, x, dt): return x + dt * self.speed
    def noise(self, x, dt): return dt * 0.1 * (0 * x[..., None] + 1) ** 2

TestCreeping = conformance(Creeping, known_failures={"linear_as_declared": "it drifts"})
TestFine = conformance(Creeping, known_failures={"pure": "it is said"})
TestKalman, TestAgain = conformance(Kalman), conformance(Kalman)
"""


@pytest.mark.costly
def test_a_session_counts_its_budget_and_prints_its_seed(tmp_path):
    (tmp_path / "test_user.py").write_text(USER)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--vedette-seed", "7", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert "2 statistical tests; a session of right subjects fails with probability 4e-07 at most" in done.stdout
    assert "repeat with --vedette-profile fast --vedette-seed 7" in done.stdout
    assert "1 xfailed" in done.stdout
    assert ", 1 failed as expected" in done.stdout
    assert "[XPASS(strict)] it is said" in done.stdout
    assert "linear_as_declared" in done.stdout  # unexcused in the second class, with the seed that repeats it
    assert "seed 7" in done.stdout


@pytest.mark.costly
def test_check_prints_a_table_and_fails_with_the_component(capsys):
    assert main(["check", "pda"]) == 0
    table = capsys.readouterr().out
    assert all(law.name in table for law in laws_of(Pda))
    assert "skipped it does not declare `exclusive`" in table
    assert main(["check", "vedette_standard.motion.constant_velocity:ConstantVelocity"]) == 0


@pytest.mark.costly
def test_check_shows_the_counterexample_of_a_broken_law(capsys, monkeypatch, tmp_path):
    (tmp_path / "creeping_plugin.py").write_text(USER)
    monkeypatch.syspath_prepend(str(tmp_path))
    assert main(["check", "creeping_plugin:Creeping"]) == 1
    out = capsys.readouterr().out
    assert "linear_as_declared" in out
    assert "with Creeping(speed=" in out


@pytest.mark.parametrize(
    ("subject", "words"),
    [("pdaa", "did you mean 'pda'"), ("json", "has no component"), ("no_such.module", "neither an installed kind nor")],
)
def test_check_of_nothing_is_wrong_use(capsys, subject, words):
    assert main(["check", subject]) == 2
    assert words in capsys.readouterr().err


def test_every_law_has_a_mutant_and_the_page_counts_them():
    page = (DOCS / "measured" / "laws.md").read_text()
    for role, (laws, _) in kit._ROLES.items():
        named = [law for _, cls, law, *_ in MUTANTS if role_of(cls) == role and law != "worked_examples_hold"]
        assert set(named) == {law.name for law in laws}
        assert f"| {role} | {len(laws)} | {len(named)} |" in page


def test_a_costly_law_is_tried_on_a_share_of_the_examples():
    (law,) = (law for law in laws_of(Kalman) if law.name == "frames_show_the_target")
    assert examine(Kalman, law, components(Kalman), FAST).examples == FAST.examples // law.share < FAST.examples


def test_what_raises_as_examples_are_drawn_is_a_failure_that_says_where():
    @frozen
    class Belt(MotionModel):
        """Along a belt, whose space is none."""

        kind = "belt"

        @property
        def state(self) -> Space:
            return Space.of(s="m mod 10000")

        def move(self, x, dt):
            return x

        def jacobian(self, x, dt):
            return np.eye(1)

        def noise(self, x, dt):
            return np.zeros((1, 1))

    outcome = examine(Belt, laws_of(Belt)[0], components(Belt), FAST)
    assert outcome.verdict == "failed"
    assert "belt.state raised SpaceError: s: the period must be '2pi'" in outcome.text


def test_a_camera_is_lit_whatever_its_brightness_is_called():
    axes = {"x": "px", "y": "px", "glow": "count", "radius": "px"}
    camera = SimpleNamespace(
        observes=Space.of(**axes), measurement=Space.of(x="px", y="px"), measure=lambda x: x[..., :2],
        jacobian=lambda x: np.eye(2, 4),
    )  # fmt: skip
    assert imaging_cases.state_at(camera, 21.0, 12.0).tolist() == [[21.0, 12.0, imaging_cases.LIT, 2.0]]
