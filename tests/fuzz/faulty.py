"""A third party's methods: one of them wrong, in a tracker that runs. Whatever fails is told by the class at fault."""

from __future__ import annotations

import gc
import tomllib
from functools import cache
from itertools import count
from pathlib import Path

import numpy as np

from fuzz.cases import NASTY, pick
from support.faulty import CONFIG, methods, spoiled, with_plugin
from vedette import Registry, VedetteError, load

FAULTS = [
    "raise KeyError('gone')",
    "raise ValueError('no')",
    "raise NotImplementedError",
    "raise RecursionError('deep')",
    "return 1 / 0",
    "return None",
    "return given[0]",
    "return given[..., :1]",
    "return given[..., None]",
    "return given[None]",
    "return given.T",
    "return given.astype(str)",
    "return given.astype(object)",
    "return given * 1j",
    "return given * np.nan",
    "return given * np.inf",
    "return -given",
    "return given, given",
    "return [given]",
    "return lambda: given",
    "return np.zeros(0)",
    "return np.zeros((3, 7))",
    "return Gaussian(given.mean, given.cov[..., :1])",
    "return Gaussian(given.mean[..., :1], given.cov)",
    "return Gaussian(given.mean * np.nan, given.cov)",
    "return Gaussian(given.mean, -given.cov)",
    "return Innovation(given.loglik[..., :1], given.distance, given.log_volume, given.nis, given.detail)",
    "return Newborn(given.returns + 9, given.prior, given.existence)",
    "return Newborn(given.returns, given.prior, given.existence[:1])",
    "return Recording(given.scans[::-1])",
    "return Recording([3])",
    "return given.scans",
    "return given[::-1]",
    "return (*given[1:], given[0])",
    "return VALUE",
]
"""What a method does instead of returning what is `given`; some do not fit some methods, and fail in another way."""


CASES = count()


@cache
def installed() -> Registry:
    """Return everything that is installed, looked up once."""
    return Registry.installed()


def case(rng: np.random.Generator, folder: Path) -> str:
    """Run a tracker of a third party's components, one method of which is wrong."""
    if next(CASES) % 20 == 0:
        gc.collect()  # of earlier cases' classes: Python asks all of a base's, dead ones too, what is an instance of it
    cls, method = pick(rng, methods())
    fault = pick(rng, FAULTS)
    if "VALUE" in fault:
        value = repr(pick(rng, [each for each in NASTY if len(repr(each)) < 500]))
        fault = fault.replace("VALUE", value.replace("nan", "np.nan").replace("inf", "np.inf"))
    try:
        load(tomllib.loads(CONFIG), with_plugin(installed(), spoiled(cls, method, fault))).run()
    except VedetteError as error:
        text = str(error)
        if (
            method == "start" and f".{method} must" not in text
        ):  # what it began with fails later, in a method of it or its part
            assert text.startswith(("lifecycle: x_lifecycle", "estimator")), f"{cls}.{method}: {fault}: {text}"
        else:
            assert f"(vedette_x.{cls}).{method} " in text, f"{cls}.{method}: {fault}: {text}"
        assert "\n" not in text, f"{cls}.{method}: {fault}: more than a paragraph"
        return "told"
    return "unnoticed"
