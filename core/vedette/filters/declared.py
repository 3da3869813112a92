"""Whether a component keeps what it declares, and forwards what the components that it holds need."""

from __future__ import annotations

from typing import Any

from vedette.roles import TRAITS, Component, Estimator, MotionModel, components_in

_METHODS = {"reframes": "reframe", "bounded": "extent"}
"""The methods by which an estimator keeps what a trait promises."""

_IN_ONE = ("scan_step", "predict", "evaluate", "update")
"""What an estimator does in one call, and the calls that this replaces."""


def contradiction(cls: type[Component]) -> str:
    """Return how a class contradicts its declarations, or ""."""
    name = cls.__name__
    if issubclass(cls, MotionModel):
        undeclared = getattr(cls, "reframes", None) in (False, MotionModel.reframes)
        if undeclared and cls.reframe is not MotionModel.reframe:
            return f"{name} defines `reframe`, which nobody calls unless it declares `reframes = True`"
    if issubclass(cls, Estimator):
        if cls.traits is not Estimator.traits:
            return f"{name} defines `traits`, which is final: state those that it has in `declares`"
        if unknown := [trait for trait in cls.drops if trait not in TRAITS]:
            return f"{name}: `drops` must be a tuple of traits, among {', '.join(TRAITS)}; got {unknown[0]!r}"
        if stray := [trait for trait in TRAITS if isinstance(getattr(cls, trait, None), bool | property)]:
            return f"{name} defines `{stray[0]}`, which nobody reads: write `declares = Traits({stray[0]}=True)`"
    return ""


def unforwarded(component: Component) -> str:
    """Return what an estimator or a motion does not forward to the components that it holds, with the cure; or ""."""
    kind = component.kind
    if isinstance(component, MotionModel):
        turning = [part.kind for part in components_in(component) if isinstance(part, MotionModel) and part.reframes]
        if turning and not component.reframes:
            return (
                f"{kind!r} holds {turning[0]!r}, which turns its frame, and does not declare `reframes`: forward `reframes` "
                "and `reframe`, as `WrappedMotion` does, or refuse such a motion"
            )
        if component.reframes and type(component).reframe is MotionModel.reframe:
            return f"{kind!r} declares `reframes` and has no `reframe`: define it, or forward that of the motion it holds"
    if isinstance(component, Estimator):
        for trait, method in _METHODS.items():
            if getattr(component.traits, trait) and getattr(type(component), method) is getattr(Estimator, method):
                refuse = "raise ValueError in `__attrs_post_init__` if its `motion.reframes`"
                cannot = refuse if trait == "reframes" else f"write `drops = ({trait!r},)`"
                told = f"{kind!r} has the trait `{trait}`, of its own or of what it holds, and no `{method}`"
                return f"{told}: define it, or forward it; if it cannot, {cannot}"
    return ""


def has_current_scan_step(cls: type[Estimator[Any]]) -> bool:
    """Return whether a class has a `scan_step` that knows of its other methods: none of them is defined below that."""
    depth = {name: next(i for i, base in enumerate(cls.__mro__) if name in vars(base)) for name in _IN_ONE}
    return Estimator.scan_step is not cls.scan_step and min(depth.values()) == depth["scan_step"]
