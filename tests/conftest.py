"""What several test files share lies in `support`; its assertions tell what they compared, like a test's own."""

from contextlib import ExitStack

import pytest
from hypothesis import settings

from vedette.testing.repeatable import constants_of_no_module

pytest.register_assert_rewrite("support")


def pytest_configure(config: pytest.Config) -> None:
    """Let Hypothesis draw the same examples in every run but the nightly ones, and wait for a busy machine."""
    settings.register_profile("fast", deadline=None, derandomize=True)
    settings.register_profile("nightly", deadline=None)
    settings.load_profile(config.option.vedette_profile)
    session = ExitStack()
    session.enter_context(constants_of_no_module())
    config.add_cleanup(session.close)
