"""Whether a class keeps its declarations: what others rely on without asking must not be overridden."""

from __future__ import annotations

from vedette.filters.gaussian import GaussianFilter
from vedette.roles import Component, Estimator, MotionModel


def contradiction(cls: type[Component]) -> str:
    """Return how the methods of a class contradict its declarations, or ""."""
    if issubclass(cls, Estimator) and cls.gaussian_belief is True:
        for name in ("start", "moments"):
            if getattr(cls, name) is not getattr(GaussianFilter, name):
                return f"{cls.__name__} defines `{name}`, which is final where `gaussian_belief` is True: declare it False"
    for role in (MotionModel, Estimator):
        if issubclass(cls, role) and cls.reframes is False and cls.reframe is not role.reframe:
            return f"{cls.__name__} defines `reframe`, which nobody calls unless it declares `reframes = True`"
    return ""
