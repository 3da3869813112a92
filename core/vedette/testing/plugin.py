"""The pytest plugin: options, fixtures, the marker for statistical tests, and the false-alarm budget of a session.

It is loaded in every pytest session of an environment that has Vedette, so it imports nothing until a test asks.
"""

from __future__ import annotations

import secrets
from typing import TYPE_CHECKING, Any

import pytest
from attrs import frozen

if TYPE_CHECKING:
    from vedette.testing.kit import Outcome
    from vedette.testing.law import Profile

_ALPHA, _LAW = "vedette_alpha", "vedette_law"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options for how thorough to be, and for the seed of everything random."""
    group = parser.getgroup("vedette", "conformance of Vedette's components")
    group.addoption("--vedette-profile", default="fast", choices=["fast", "nightly"], help="how thoroughly the kit tests")
    group.addoption(
        "--vedette-seed", type=int, default=None, help="seed of the kit's draws; default: 0 if fast, a fresh one if nightly"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Fix the seed before any worker starts, and register the marker."""
    config.addinivalue_line(
        "markers", "statistical(alpha): fails a right subject with probability `alpha`, which the session's budget adds up"
    )
    if config.option.vedette_seed is None:
        config.option.vedette_seed = 0 if config.option.vedette_profile == "fast" else secrets.randbelow(2**31)


@frozen
class Kit:
    """What a law's test is given: the profile, and where to record the alpha that it spent."""

    profile: Profile
    _notes: list[tuple[str, Any]]

    def take(self, outcome: Outcome) -> Outcome:
        """Record an outcome for the session's summary."""
        self._notes.append((_LAW, outcome.verdict))
        if outcome.alpha:
            self.spend(outcome.alpha)
        return outcome

    def spend(self, alpha: float) -> None:
        """Record the probability with which this test fails a correct subject."""
        self._notes.append((_ALPHA, alpha))


@pytest.fixture(scope="session")
def vedette_profile(pytestconfig: pytest.Config) -> Profile:
    """Return the session's profile, with its seed."""
    from vedette.testing.law import Profile

    return Profile.named(pytestconfig.option.vedette_profile, pytestconfig.option.vedette_seed)


@pytest.fixture
def vedette_kit(request: pytest.FixtureRequest, vedette_profile: Profile) -> Kit:
    """Return the session's profile and budget, with which `conformance` runs its laws."""
    return Kit(vedette_profile, request.node.user_properties)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Count a test that states its own alpha, `@pytest.mark.statistical(alpha=1e-6)`, in the budget."""
    marker = item.get_closest_marker("statistical")
    if marker is not None and "alpha" in marker.kwargs:
        item.user_properties.append((_ALPHA, float(marker.kwargs["alpha"])))


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Print what the kit tried, the budget that it spent, and the seed that repeats it."""
    reports = [report for kind in ("passed", "failed", "skipped", "xfailed", "xpassed") for report in
               terminalreporter.stats.get(kind, []) if getattr(report, "when", "") == "call"]  # fmt: skip
    notes = [(*note, " as expected" * hasattr(each, "wasxfail")) for each in reports for note in each.user_properties]
    alphas = [value for name, value, _ in notes if name == _ALPHA]
    verdicts = [value + known for name, value, known in notes if name == _LAW]
    if not alphas and not verdicts:
        return
    counts = ", ".join(f"{verdicts.count(each)} {each}" for each in dict.fromkeys(("held", "failed", "skipped", *verdicts)))
    option = config.option
    terminalreporter.write_sep("-", "vedette")
    terminalreporter.write_line(f"profile {option.vedette_profile}: laws {counts}")
    terminalreporter.write_line(
        f"{len(alphas)} statistical tests; a session of right subjects fails with probability {sum(alphas):.2g} at most"
    )
    terminalreporter.write_line(
        f"repeat with --vedette-profile {option.vedette_profile} --vedette-seed {option.vedette_seed}"
    )
