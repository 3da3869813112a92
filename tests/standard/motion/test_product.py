"""Products of motion models."""

import re

import numpy as np
import pytest
from scipy.linalg import block_diag

from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.motion.product import Product
from vedette_standard.motion.random_walk import RandomWalk


# Products.
def test_a_product_moves_each_part_by_itself():
    parts = (CoordinatedTurn(0.5, 0.02), ConstantVelocity(0.1, axes=("z",)), RandomWalk(0.01, ("bias",), "rad"))
    model = Product(parts)
    assert model.state.names == ("x", "y", "vx", "vy", "turn_rate", "z", "vz", "bias")
    x = np.random.default_rng(2).normal(size=(2, 3, 8))
    own = [slice(0, 5), slice(5, 7), slice(7, 8)]
    np.testing.assert_array_equal(
        model.move(x, 2.0), np.concatenate([p.move(x[..., s], 2.0) for p, s in zip(parts, own, strict=True)], axis=-1)
    )
    for i in np.ndindex(2, 3):
        blocks = [p.jacobian(x[i][s], 2.0) for p, s in zip(parts, own, strict=True)]
        np.testing.assert_array_equal(model.jacobian(x, 2.0)[i], block_diag(*blocks))
    np.testing.assert_array_equal(
        model.noise(x, 2.0), block_diag(*(p.noise(x[..., s], 2.0) for p, s in zip(parts, own, strict=True)))
    )
    assert not model.linear
    assert not model.divisible
    linear = Product(parts[1:])
    assert linear.linear
    assert linear.divisible


def test_equal_parts_are_one_model():
    line = [ConstantVelocity(0.5, axes=(axis,)) for axis in "xyz"]
    product, space = Product(tuple(line)), ConstantVelocity(0.5, axes=("x", "y", "z"))
    where = product.state.locate(space.state)
    x = np.zeros(6)
    np.testing.assert_array_equal(product.noise(x, 2.0)[np.ix_(where, where)], space.noise(x, 2.0))
    np.testing.assert_array_equal(product.jacobian(x, 2.0)[np.ix_(where, where)], space.jacobian(x, 2.0))


@pytest.mark.parametrize(
    ("models", "message"),
    [
        ((), "models: must hold at least one model"),
        (
            (ConstantVelocity(0.5), RandomWalk(1.0, ("y",))),
            "models[1]: must have other axes than the models before it, got y",
        ),
    ],
)
def test_products_that_cannot_be(models, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        Product(models)
