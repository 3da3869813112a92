"""Laws applied to components: one law for a command, all of them as a pytest class."""

from __future__ import annotations

import inspect
import re
import zlib
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any, Literal
from unittest import SkipTest

import hypothesis
import pytest
from attrs import define, field, frozen
from hypothesis import strategies as st
from hypothesis.errors import DidNotReproduce, Flaky, HypothesisException, InvalidArgument, Unsatisfiable

from vedette.config.parameters import ROLES, role_of
from vedette.config.suggestions import did_you_mean
from vedette.filters import contradiction
from vedette.hypotheses import HypothesisAssociator
from vedette.roles import Component
from vedette.supporting import ImagingSensor
from vedette.testing.comparisons import Closed, Lacking, Misuse, Unlike, closed_if
from vedette.testing.counterexamples import counterexample, way_of
from vedette.testing.hypothesis_constants import constants_of_no_module, examples_of_their_own
from vedette.testing.law import Law, Profile
from vedette.testing.laws import (
    associator,
    associator_cases,
    birth,
    birth_cases,
    estimator,
    estimator_cases,
    formats,
    hypotheses,
    imaging,
    lifecycle,
    lifecycle_cases,
    motion,
    motion_cases,
    preprocessor,
    preprocessor_cases,
    sensor,
    sensor_cases,
    source,
    source_pictures,
    source_returns,
    source_stated,
    worked_examples,
)
from vedette.testing.limits import TooLong, at_most
from vedette.testing.strategies import components
from vedette.tracking.faults import broken_promise

Drawer = Callable[[st.DrawFn, Any, Profile], Any]

_ROLES: dict[str, tuple[tuple[Law, ...], Drawer]] = {
    "motion": (motion.LAWS, motion_cases.drawn),
    "sensor": (sensor.LAWS, sensor_cases.drawn),
    "associator": (associator.LAWS, associator_cases.drawn),
    "estimator": (estimator.LAWS, estimator_cases.drawn),
    "birth": (birth.LAWS, birth_cases.drawn),
    "lifecycle": (lifecycle.LAWS, lifecycle_cases.drawn),
    "preprocessor": (preprocessor.LAWS, preprocessor_cases.drawn),
    "source": (source.LAWS + source_pictures.LAWS + source_returns.LAWS + source_stated.LAWS, source.drawn),
    "format": (formats.LAWS, formats.drawn),
}


_BLOB = re.compile(r"reproduce_failure\('([^']+)', b'([^']+)'\)")
"""How Hypothesis notes what repeats an example: its version, and what it drew."""

KINDRED = ((ImagingSensor, " of pictures", imaging.LAWS), (HypothesisAssociator, " of hypotheses", hypotheses.LAWS))
"""Whose laws others of their role need not keep."""

MOST_CLOSED = 12
"""A law that did not apply to so many components, nor to half of what is drawn, is skipped."""
FEW_CLOSED = 3
"""So is one that did not apply to so many, the last of them for what it is."""


@frozen
class Outcome:
    """The result of one law: `text` is the smallest counterexample, or why there was nothing to judge.

    `alpha` is the probability that a correct component would have failed here; `replay` is what repeats a failure;
    `lacks` is the parameter without which the law judges nothing.
    """

    law: Law
    verdict: Literal["held", "failed", "skipped"]
    text: str
    examples: int
    alpha: float
    replay: str = ""
    lacks: str = ""


def laws_of(cls: type[Component]) -> tuple[Law, ...]:
    """Return the laws of a component's role; Misuse if it is not a component, or an incomplete one."""
    if not (isinstance(cls, type) and issubclass(cls, Component)):
        raise Misuse(f"{cls!r}: is not a component class; derive it from one of vedette's roles: {', '.join(ROLES)}")
    role = role_of(cls)
    if role is None or role not in _ROLES:
        none = f"plays no role that has laws; derive it from one of {', '.join(_ROLES)}"
        raise Misuse(f"{cls.__name__}: {none if role is None else f'is a {role}, of which there are no laws: run it'}")
    if missing := sorted(getattr(cls, "__abstractmethods__", ())):
        raise Misuse(f"{cls.__name__}: is abstract: define {', '.join(missing)}, or give the kit a class that does")
    if reason := contradiction(cls):
        raise Misuse(reason)
    if "__attrs_attrs__" not in vars(cls):
        raise Misuse(f"{cls.__name__}: is not an attrs class: decorate it with @attrs.frozen")
    return _ROLES[role][0] + worked_examples.OF_ALL


def own_laws(cls: type[Component]) -> tuple[str, frozenset[str]]:
    """Return which laws say what others of its role need not keep: " of pictures" and their names; none for most."""
    for base, what, laws in KINDRED:
        if issubclass(cls, base):
            return what, frozenset(law.name for law in laws)
    return "", frozenset()


@st.composite
def _pairs(
    draw: st.DrawFn, drawn: st.SearchStrategy[Any], drawer: Drawer, profile: Profile, refused: list[str]
) -> tuple[Any, Any]:
    """Return a component, and what a law of its role is given with it; `refused` gets what its class said last."""
    try:
        component = draw(drawn)
    except hypothesis.errors.UnsatisfiedAssumption as nothing:
        refused[:] = [f": {nothing.__context__}"]
        raise
    return component, drawer(draw, component, profile)


def examine(cls: type[Component], law: Law, drawn: st.SearchStrategy[Any], profile: Profile, replay: str = "") -> Outcome:
    """Test one law on components drawn from a strategy.

    Parameters
    ----------
    cls
        The component's class.
    law
        One of `laws_of(cls)`.
    drawn
        The strategy of Hypothesis that draws components; `vedette.testing.strategies.components(cls)` infers one.
    profile
        How thoroughly to test, and the seed: equal ones give the same outcome.
    replay
        What an outcome said: the one example that failed is tried again, if `drawn` is the same.

    Returns
    -------
    Outcome
        Held, failed with the smallest counterexample, or skipped with why the law does not apply.

    Raises
    ------
    Misuse
        If no component could be built from what was drawn.
    """
    role = role_of(cls) or ""
    own, usual = (getattr(one, law.needs, True) for one in (cls, ROLES[role]))
    unlike = next((f"it is none{what}" for base, what, laws in KINDRED if law in laws and not issubclass(cls, base)), "")
    if unlike or own is False or own is usual is not True:
        return Outcome(law, "skipped", unlike or law.lacks, 0, 0.0)
    tried, refused = _Tried(), [""]

    def attempt(pair: Any) -> None:
        tried.take(law, pair, max(MOST_CLOSED, law.examples(profile) // 2))

    attempt.__name__ = attempt.__qualname__ = law.name
    name = f"{cls.__qualname__}.{law.name}".encode()
    given = hypothesis.given(_pairs(drawn, _ROLES[role][1], profile, refused))(attempt)
    run = hypothesis.seed(profile.seed * 2**32 + zlib.crc32(name))(_settings(law, profile)(given))
    if replay:
        version, _, blob = replay.partition("/")
        run = hypothesis.reproduce_failure(version, blob.encode())(run)
    alpha = profile.alpha * law.examples(profile) if law.effort == "statistical" else 0.0
    try:
        with constants_of_no_module(), examples_of_their_own(), at_most(profile.seconds):
            run()
    except (TooLong, Flaky) as unsure:
        too_long = f"takes longer than {profile.seconds:g} s of CPU time"
        what = too_long if isinstance(unsure, TooLong) else "it fails once and holds when tried again with the same"
        told = counterexample(what, tried.pair, None) if tried.pair else what  # nothing, where it is late as it is drawn
        return Outcome(law, "failed", told, tried.held + 1, alpha)
    except Unsatisfiable:
        text = f"{cls.__name__}: none could be built from what was drawn{refused[0]}; pass strategies for its parameters"
        raise Misuse(text) from None
    except SkipTest:
        tried.held = 0
    except DidNotReproduce:
        return Outcome(law, "held", "", 1, alpha)
    except InvalidArgument as other:
        raise Misuse(f"{'replay' if replay else f'{cls.__name__}.{law.name}'}: {other}") from None
    except HypothesisException:
        raise
    except Exception as error:
        note = _BLOB.search("".join(getattr(error, "__notes__", ())))
        told, repeats = _why(law, tried.pair, error), "/".join(note.groups()) if note else ""
        return Outcome(law, "failed", told, tried.held + 1, alpha, repeats)
    if not tried.held:
        return Outcome(law, "skipped", tried.closed[0][0], 0, 0.0, lacks=tried.closed[0][1])
    return Outcome(law, "held", "", tried.held, alpha)


@define
class _Tried:
    """What a law was tried on: the last component and data, on how many it held, and why it did not apply to others."""

    pair: tuple[Any, ...] = ()
    held: int = 0
    closed: list[tuple[str, str]] = field(factory=list)
    _failed: bool = False

    def take(self, law: Law, pair: tuple[Any, Any], most: int) -> None:
        """Try the law; SkipTest, at which Hypothesis ends, once it did not apply to so many, or to few for what they are."""
        self.pair = component, data = pair
        try:
            closed_if(not law.applies(component), law.lacks)
            law.check(component, data)
            self.held += 1
        except Closed as reason:
            lacking = isinstance(reason, Lacking)
            self.closed.append((str(reason), reason.name if isinstance(reason, Lacking) else ""))
            unlike = isinstance(reason, Unlike) or (lacking and not hasattr(component, self.closed[-1][1]))
            # the smaller ones that Hypothesis tries after a failure may all be closed
            if not (self.held or self._failed) and len(self.closed) >= (FEW_CLOSED if unlike else most):
                raise SkipTest(str(reason)) from None
        except Exception:
            self._failed = True
            raise


def _settings(law: Law, profile: Profile) -> hypothesis.settings:
    return hypothesis.settings(
        max_examples=law.examples(profile),
        database=None,
        deadline=None,
        report_multiple_bugs=False,
        print_blob=True,
        phases=[hypothesis.Phase.generate] + ([hypothesis.Phase.shrink] if law.effort == "exact" and profile.shrink else []),
        suppress_health_check=list(hypothesis.HealthCheck),
        verbosity=hypothesis.Verbosity.quiet,
    )


def _why(law: Law, pair: tuple[Any, ...], error: Exception) -> str:
    """Return why a law failed, with the counterexample unless what is shown, or drawn, is at fault."""
    what = _promise(law, *pair) if pair else ""
    if not what:
        method, line = way_of(error)
        raised = f"{method}raised {type(error).__name__}: {error}{line}"
        what = str(error) if isinstance(error, AssertionError) else raised
    shown = law.effort == "shown" or not pair
    return what if shown else counterexample(what, pair, lambda: law.check(*pair))


def _promise(law: Law, component: Component, data: Any) -> str:
    """Return which method gives what it must not, where that is why a law failed; "" if none does."""

    def again() -> None:
        with suppress(Exception):
            law.check(component, data)

    return (broken_promise(component, again) or "").partition("; `vedette check")[0]


def conformance(cls: type[Component], *, known_failures: Mapping[str, str] | None = None, **strategies: Any) -> type:
    """Return a pytest class with one test for each law of the component's role.

    A law that does not apply is skipped with its reason.

    Parameters
    ----------
    cls
        The component's class.
    known_failures
        Law to the reason why the component is known to break it: a strict expected failure; default: those that the class
        declares.
    **strategies
        Parameter to the strategy that draws it, as in `hypothesis.strategies.builds`; where none is given, one is inferred
        from the field's type, limits and unit.

    Returns
    -------
    type
        To be bound to a name that pytest collects: `TestMyMotion = conformance(MyMotion)`.

    Raises
    ------
    Misuse
        If the class plays no role or is incomplete, or if a law or a parameter is unknown; it says how to put it right.
    """
    laws = laws_of(cls)
    known = dict(cls.known_failures if known_failures is None else known_failures)
    names = [law.name for law in laws]
    for name in known:
        if name not in names:
            told = f"no law {name!r};{did_you_mean(name, names)} its laws are {', '.join(names)}"
            raise Misuse(f"known_failures: a {role_of(cls)} has {told}")
    drawn = components(cls, strategies)
    tests = {f"test_{law.name}": _test(cls, law, drawn, known.get(law.name)) for law in laws}
    frame = inspect.currentframe()
    module = frame.f_back.f_globals.get("__name__", __name__) if frame and frame.f_back else __name__
    return type(f"Test{cls.__name__}", (), {"__doc__": f"The laws of {cls.__name__}.", "__module__": module, **tests})


def _test(cls: type[Component], law: Law, drawn: st.SearchStrategy[Any], known: str | None) -> Callable[..., None]:
    def test(self: object, vedette_kit: Any) -> None:
        outcome = vedette_kit.take(examine(cls, law, drawn, vedette_kit.profile))
        if outcome.verdict == "skipped":
            pytest.skip(outcome.text)
        if outcome.verdict == "failed":
            pytest.fail(f"{law.sentence}\n{outcome.text}\n  seed {vedette_kit.profile.seed}", pytrace=False)

    test.__name__, test.__doc__ = f"test_{law.name}", law.sentence
    if known is not None:
        test = pytest.mark.xfail(reason=known, strict=True)(test)
    if law.effort not in ("exact", "shown"):
        test = pytest.mark.statistical(test)
    return test
