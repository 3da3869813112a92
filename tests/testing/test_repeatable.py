"""The same seed draws the same components, whatever modules are loaded beside."""

import subprocess
import sys

import pytest

DRAW = """
import sys, types
{load}
from vedette.testing.kit import examine
from vedette.testing.law import Law, Profile
from vedette.testing.laws import motion
from vedette.testing.strategies import components
from vedette_standard.motion.constant_velocity import ConstantVelocity

seen = []
law = Law(lambda component, data: seen.append(repr(component)))
for seed in range(4):
    examine(ConstantVelocity, law, components(ConstantVelocity), Profile.named("fast", seed))
print(seen)
"""


def drawn(tmp_path, load: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", DRAW.format(load=load)], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    return done.stdout


@pytest.mark.costly
def test_draws_do_not_depend_on_what_modules_are_loaded(tmp_path):
    numbers = ", ".join(str(0.05 + 0.007 * i) for i in range(600))
    (tmp_path / "somebodys_numbers.py").write_text(f"X = [{numbers}]\n")
    alone = drawn(tmp_path, "")
    assert alone.count("ConstantVelocity") > 40
    assert drawn(tmp_path, "sys.path.insert(0, '.'); import somebodys_numbers") == alone
