"""Several models side by side."""

from __future__ import annotations

from functools import reduce
from typing import ClassVar, final

import numpy as np
from attrs import Factory, field, frozen

from vedette import Array, MotionModel, Space, Twin, fields, filters
from vedette_standard import compiled


def _state(self: Product) -> Space:
    if not self.models:
        raise ValueError("models: must hold at least one model, got none")
    space = Space()
    for i, model in enumerate(self.models):
        if shared := [name for name in model.state.names if name in space]:
            raise ValueError(f"models[{i}]: must have other axes than the models before it, got {', '.join(shared)} again")
        if model.reframes:
            raise ValueError(f"models[{i}]: {model.kind!r} turns its frame with its target, so it can only stand alone")
        space = space.union(model.state)
    return space


def _zero_variance(self: Product) -> Space:
    return reduce(Space.union, (model.zero_variance for model in self.models), Space())


def _side_by_side(self: Product) -> list[tuple[MotionModel, slice]]:
    stops = np.cumsum([len(model.state) for model in self.models]).tolist()
    return [(model, slice(stop - len(model.state), stop)) for model, stop in zip(self.models, stops, strict=True)]


@final
@frozen
class Product(MotionModel):
    """Independent models over disjoint axes: f = (f_1, f_2, ..), F and Q block diagonal.

    A planar model times one of `axes = ["z"]` moves in space; one times biases carries these along. It is linear
    where all of them are, and divisible where all are.
    Li, Jilkov, Survey of Maneuvering Target Tracking, Part I: Dynamic Models, IEEE T-AES 39, 2003.

    >>> import numpy as np
    >>> from vedette_standard import ConstantVelocity, CoordinatedTurn, GaussMarkov
    >>> height, bias = ConstantVelocity(0.3, axes=("z",)), GaussMarkov(("bias",), 0.2, 8.0, "rad")
    >>> model, x = Product((height, bias)), np.array([100.0, 5.0, 0.1])
    >>> model.state.names, np.allclose(model.move(x, 2.0), [110.0, 5.0, 0.1 * np.exp(-0.25)])
    (('z', 'vz', 'bias'), True)
    >>> Q, F = model.noise(x, 2.0), model.jacobian(x, 2.0)
    >>> np.allclose(Q[:2, :2], height.noise(x[:2], 2.0)), np.allclose(Q[2], [0.0, 0.0, bias.noise(x[2:], 2.0)[0, 0]])
    (True, True)
    >>> np.allclose(F, [[1.0, 2.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, np.exp(-0.25)]])
    True
    >>> model.linear, model.divisible, Product((bias, CoordinatedTurn(0.5, 0.02))).linear
    (True, True, False)
    """

    kind: ClassVar[str] = "product"

    models: tuple[MotionModel, ...] = fields.part("the models, over disjoint axes")
    state: Space = field(init=False, repr=False, eq=False, default=Factory(_state, takes_self=True))
    zero_variance: Space = field(init=False, repr=False, eq=False, default=Factory(_zero_variance, takes_self=True))
    _parts: list[tuple[MotionModel, slice]] = field(
        init=False, repr=False, eq=False, default=Factory(_side_by_side, takes_self=True)
    )

    @property
    def linear(self) -> bool:
        """Whether all models are linear."""
        return all(model.linear for model in self.models)

    @property
    def divisible(self) -> bool:
        """Whether all models are divisible."""
        return all(model.divisible for model in self.models)

    @property
    def twin(self) -> Twin | None:
        """Its compiled twin, if it is not linear and each of its models is linear or has one."""
        parts = [(model, filters.own_twin(model)) for model in self.models]
        return None if self.linear or not all(own or model.linear for model, own in parts) else compiled.product(parts)

    def move(self, x: Array, dt: float) -> Array:
        return np.concatenate([model.move(x[..., axes], dt) for model, axes in self._parts], axis=-1)

    def jacobian(self, x: Array, dt: float) -> Array:
        """Return F: (*b, n) -> (*b, n, n), or (n, n) if no model's depends on the state."""
        return block_diagonal(*[model.jacobian(x[..., axes], dt) for model, axes in self._parts])

    def noise(self, x: Array, dt: float) -> Array:
        """Return Q: (*b, n) -> (*b, n, n), or (n, n) if no model's depends on the state."""
        return block_diagonal(*[model.noise(x[..., axes], dt) for model, axes in self._parts])

    def mean_noise(self, x: Array, cov: Array, dt: float) -> Array:
        return block_diagonal(*[model.mean_noise(x[..., axes], cov[..., axes, axes], dt) for model, axes in self._parts])


@compiled.fastest
def block_diagonal(*blocks: Array) -> Array:
    """Return square blocks (*b, p, p) along the diagonal of a matrix (*b, n, n)."""
    n = sum(block.shape[-1] for block in blocks)
    whole, first = np.zeros((*np.broadcast_shapes(*(block.shape[:-2] for block in blocks)), n, n)), 0
    for block in blocks:
        last = first + block.shape[-1]
        whole[..., first:last, first:last] = block
        first = last
    return whole
