"""Products of motion models."""

import re

import numpy as np
import pytest
from scipy.linalg import block_diag

from vedette import kernels
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.motion.product import Product, block_diagonal
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


def test_the_twin_of_a_product_says_what_its_parts_say_at_each_time_step():
    parts = (RandomWalk(0.01, ("bias",), "rad"), CoordinatedTurn(0.5, 0.02), ConstantVelocity(0.1, axes=("z",)))
    if not kernels.RUNNING.startswith("compiled"):
        pytest.skip("the kernels that run call no twin")
    for model in (Product(parts), Product((parts[0], Product(parts[1:])))):
        twin, x = model.twin, np.random.default_rng(2).normal(size=(19, 8))
        for dt in (2.0, 0.5, 2.0):
            moved = kernels.move_twin(x, dt, twin.function, twin.numbers(x, dt), ())
            np.testing.assert_allclose(moved.mean, model.move(x, dt), rtol=1e-12, atol=1e-12)
            np.testing.assert_allclose(moved.slope, model.jacobian(x, dt), rtol=1e-12, atol=1e-12)
            np.testing.assert_allclose(moved.noise, np.broadcast_to(model.noise(x, dt), (19, 8, 8)), rtol=1e-12, atol=1e-12)


def test_a_product_has_a_twin_where_all_its_nonlinear_parts_have_one():
    class Drifts(RandomWalk):
        linear = False

    up = ConstantVelocity(0.1, axes=("z",))
    assert Product((up,)).twin is None
    assert Product((CoordinatedTurn(0.5, 0.02), Drifts(0.01, ("bias",), "rad"))).twin is None


def test_blocks_stand_along_a_diagonal():
    a, b = np.arange(4.0).reshape(2, 2), np.arange(9.0).reshape(3, 3)
    whole = block_diag(a, b)
    np.testing.assert_array_equal(block_diagonal(a, b), whole)
    np.testing.assert_array_equal(
        block_diagonal.__wrapped__(a, b) if hasattr(block_diagonal, "__wrapped__") else whole, whole
    )
    np.testing.assert_array_equal(block_diagonal(np.stack([a, a]), b), np.stack([whole, whole]))
    np.testing.assert_array_equal(block_diagonal(a.T, b), block_diag(a.T, b))


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
