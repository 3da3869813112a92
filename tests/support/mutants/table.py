"""All mutants. `PYTHONPATH=tests python -m support.mutants.table` prints them with what the law said."""

import attrs
from hypothesis import strategies as st

from support.mutants import apart
from support.mutants.associators import ASSOCIATORS
from support.mutants.births import BIRTHS
from support.mutants.declared import DECLARED
from support.mutants.declared_supporting import DECLARED_SUPPORTING
from support.mutants.estimators import ESTIMATORS
from support.mutants.formats import FORMATS
from support.mutants.hypotheses import HYPOTHESES
from support.mutants.lifecycles import LIFECYCLES
from support.mutants.mixtures import MIXTURES
from support.mutants.motion import MOTION
from support.mutants.preprocessors import DETECTORS
from support.mutants.promises import PROMISES
from support.mutants.promises_supporting import PROMISES_SUPPORTING
from support.mutants.sensors import SENSORS
from support.mutants.sources import SOURCES
from support.mutants.stated import STATED
from support.mutants.untold import UNTOLD
from vedette import MotionModel
from vedette.config.parameters import role_of
from vedette.testing import FAST, examine, laws_of
from vedette.testing.strategies import components

SPREAD = {"spread": st.just({"vx": 5.0, "vy": 5.0})}
MUTANTS = [
    *((*row, {}) for row in (*MOTION, *SENSORS, *ASSOCIATORS, *apart.ASSOCIATORS, *HYPOTHESES, *DETECTORS, *FORMATS)),
    *((*row, {}) for row in (*LIFECYCLES, *apart.LIFECYCLES)),
    *((*row, SPREAD) for row in (*BIRTHS, *apart.BIRTHS)),
    *ESTIMATORS, *MIXTURES, *SOURCES, *PROMISES, *PROMISES_SUPPORTING, *DECLARED, *DECLARED_SUPPORTING, *STATED, *UNTOLD,
]  # fmt: skip


def mutant(base, methods):
    """A subclass of a component, which is final for everybody but this test, with something wrong."""
    declared = {"reframes": True} if "reframe" in methods and issubclass(base, MotionModel) else {}
    methods = declared | methods
    return attrs.frozen(type(f"{base.__name__}Mutant", (base,), dict(methods)))


QUICK = attrs.evolve(FAST, shrink=False)
"""The fast profile, for who asks whether a law fails and not on what."""


def tried(base, law_name, strategies, profile=QUICK):
    law = next(law for law in laws_of(base) if law.name == law_name)
    return examine(base, law, components(base, strategies), profile)


if __name__ == "__main__":
    caught = 0
    for what, base, law, methods, strategies in MUTANTS:
        outcome = tried(mutant(base, methods), law, strategies, FAST)
        caught += outcome.verdict == "failed"
        print(f"{role_of(base):10} {base.__name__:18} {what:50} {law:40} {outcome.verdict}: {outcome.text.splitlines()[:1]}")
    print(f"{caught} of {len(MUTANTS)} mutants caught by the law named for them")
