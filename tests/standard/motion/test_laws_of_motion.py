"""The laws of motion models, on every one of the standard plugin; and mutants that each law must catch."""

from collections.abc import Callable

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.laws_of_motion import (
    LAWS,
    MODELS,
    PROFILE,
    STEPS,
    a_batch_is_a_loop,
    a_zero_step_changes_nothing,
    applies,
    jacobian_is_the_derivative,
    moments_are_exact,
    noise_is_a_covariance,
    nothing_is_written_or_kept,
    states,
    two_steps_make_one,
)
from vedette import MotionModel
from vedette_standard.motion.constant_acceleration import ConstantAcceleration
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.motion.known_turn import KnownTurn
from vedette_standard.motion.singer import Singer


@pytest.mark.parametrize(("law", "model"), [(law, model) for law in LAWS for model in MODELS if applies(law, model)])
@PROFILE
@given(data=st.data())
@pytest.mark.by_turns
def test_law(law, model, data):
    one = data.draw(MODELS[model])
    law(one, data.draw(states(one)), data.draw(STEPS))


def test_which_models_are_divisible_and_linear():
    exact = {ConstantVelocity, ConstantAcceleration, Singer, KnownTurn}
    assert {model for model in MODELS if model.divisible is True} == exact
    assert {model for model in MODELS if model.linear is True} == exact


# Mutants.
def mutant(original: MotionModel, **changed: Callable[[MotionModel, np.ndarray, float], np.ndarray]) -> MotionModel:
    """A model of the same kind with some methods replaced by functions of the original, x and dt."""

    def method(name):
        change = changed.get(name)
        return lambda self, x, dt: change(original, x, dt) if change else getattr(original, name)(x, dt)

    body = {name: method(name) for name in ("move", "jacobian", "noise")}
    cls = type("Mutant", (MotionModel,), body | {"kind": original.kind, "state": original.state})
    model = cls()
    vars(model).update({name: getattr(original, name) for name in attrs.fields_dict(type(original))})
    return model


def write_in_place(model, x, dt):
    x[..., :2] += dt * x[..., 2:4]
    return x


def without(rows, columns):
    """The Jacobian with a block left out."""

    def change(model, x, dt):
        F = model.jacobian(x, dt).copy()
        F[..., rows, columns] = 0.0
        return F

    return change


def sign_of_turn_rate_column(model, x, dt):
    F = model.jacobian(x, dt).copy()
    F[..., :2, 4] *= -1
    return F


def scaled(row, column, factor):
    """The noise with one entry, and its mirror, scaled."""

    def change(model, x, dt):
        Q = model.noise(x, dt).copy()
        Q[row, column] *= factor
        if row != column:
            Q[column, row] *= factor
        return Q

    return change


def lopsided(model, x, dt):
    Q = model.noise(x, dt).copy()
    Q[0, 2] *= 1 + 1e-9
    return Q


def held_acceleration(model, x, dt):
    """Noise of an acceleration that is held within the step and drawn anew for the next."""
    gain = np.kron(np.array([[dt**2 / 2], [dt]]), np.eye(2))
    return model.sigma_accel**2 * gain @ gain.T


def remembering():
    calls = []

    def change(model, x, dt):
        calls.append(dt)
        return model.noise(x, dt) * len(calls)

    return change


CV, CA, SINGER, TURN, COORDINATED = (
    ConstantVelocity(0.5),
    ConstantAcceleration(0.1),
    Singer(20.0, 1.0),
    KnownTurn(0.2, 0.5),
    CoordinatedTurn(0.5, 0.02),
)
MUTANTS = [
    (a_zero_step_changes_nothing, CV, {"move": lambda m, x, dt: m.move(x, dt + 0.01)}),
    (a_zero_step_changes_nothing, CV, {"noise": lambda m, x, dt: m.noise(x, dt + 0.01)}),
    (noise_is_a_covariance, CV, {"noise": scaled(0, 0, 0.5)}),
    (noise_is_a_covariance, CA, {"noise": scaled(0, 4, 1.5)}),
    (noise_is_a_covariance, CV, {"noise": lopsided}),
    (jacobian_is_the_derivative, COORDINATED, {"jacobian": sign_of_turn_rate_column}),
    (jacobian_is_the_derivative, COORDINATED, {"jacobian": without([0, 1, 2, 3], 4)}),
    (jacobian_is_the_derivative, CA, {"jacobian": without([0, 1], [4, 5])}),
    (jacobian_is_the_derivative, SINGER, {"move": lambda m, x, dt: CA.move(x, dt)}),
    (a_batch_is_a_loop, COORDINATED, {"jacobian": lambda m, x, dt: m.jacobian(x[..., :1, :] if x.ndim > 1 else x, dt)}),
    (a_batch_is_a_loop, CV, {"move": lambda m, x, dt: m.move(x - x.mean(axis=0), dt) if x.ndim > 1 else m.move(x, dt)}),
    (nothing_is_written_or_kept, CV, {"move": write_in_place}),
    (nothing_is_written_or_kept, CV, {"noise": remembering()}),
    (two_steps_make_one, CV, {"noise": held_acceleration}),
    (two_steps_make_one, CV, {"noise": lambda m, x, dt: m.noise(x, dt) * dt}),
    (two_steps_make_one, TURN, {"noise": lambda m, x, dt: CV.noise(x, dt)}),
    (two_steps_make_one, SINGER, {"noise": lambda m, x, dt: CA.noise(x, dt)}),
    (two_steps_make_one, SINGER, {"jacobian": lambda m, x, dt: CA.jacobian(x, dt)}),
    (moments_are_exact, SINGER, {"noise": scaled(0, 0, 1 + 1e-9)}),
    (moments_are_exact, CA, {"noise": scaled(0, 2, -1)}),
    (moments_are_exact, TURN, {"noise": scaled(0, 3, -1)}),
    (moments_are_exact, TURN, {"jacobian": lambda m, x, dt: KnownTurn(-0.2, 0.5).jacobian(x, dt)}),
    (moments_are_exact, TURN, {"move": lambda m, x, dt: CV.move(x, dt)}),
]


@pytest.mark.parametrize(("law", "original", "changed"), MUTANTS, ids=lambda value: getattr(value, "__name__", None))
def test_law_bites(law, original, changed):
    x = np.arange(1.0, 1 + 3 * len(original.state)).reshape(3, -1)
    law(original, x.copy(), 2.5)
    with pytest.raises(AssertionError):
        law(mutant(original, **changed), x, 2.5)
