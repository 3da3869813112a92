"""A third party's compiled twin, as docs/compiled.md shows it: by a C compiler, and by numba."""

import ctypes
import re
import shutil
import subprocess

import numpy as np
import pytest
from attrs import frozen
from scipy import LowLevelCallable

from support.paths import ROOT
from vedette import Detections, Gaussian, Sensor, Space, Twin, kernels
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.motion.constant_velocity import ConstantVelocity

PAGE = (ROOT / "docs" / "compiled.md").read_text()
COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


@frozen
class Depth(Sensor):
    """The slant range to a target at a known depth below the sensor."""

    kind = "test_depth"
    observes = Space.of(x="m", y="m")
    measurement = Space.of(range="m")
    depth: float = 30.0
    sigma: float = 2.0
    function: object = None

    @property
    def twin(self):
        return None if self.function is None else Twin(self.function, np.array([self.depth, self.sigma]))

    def measure(self, x):
        return np.sqrt(np.sum(x * x, axis=-1, keepdims=True) + self.depth**2)

    def jacobian(self, x):
        return (x / self.measure(x))[..., None, :]

    def noise(self, x):
        return np.array([[self.sigma**2]])

    def detects(self, x):
        return np.asarray(1.0)

    clutter = detects


def check(function):
    rng, ekf = np.random.default_rng(0), ExtendedKalman(ConstantVelocity(0.5))
    belief = Gaussian(100 * rng.normal(size=(19, 4)), np.broadcast_to(np.diag([90.0, 90.0, 9.0, 9.0]), (19, 4, 4)))
    scan = Detections.of(np.array([[80.0], [120.0]]))
    wanted, got = (ekf.evaluate(belief, Depth(function=one), scan, 0.99) for one in (None, function))
    np.testing.assert_allclose(got.loglik, wanted.loglik, rtol=1e-12)
    np.testing.assert_allclose(got.detail.post, wanted.detail.post, rtol=1e-11, atol=1e-12)
    if kernels.RUNNING.startswith("compiled"):
        x = belief.mean[:, :2]
        seen = kernels.measure_twin(x, function, np.array([30.0, 2.0]), 1)
        np.testing.assert_allclose(seen.z, Depth().measure(x), rtol=1e-14)


@pytest.mark.skipif(COMPILER is None, reason="no C compiler")
def test_a_function_in_c(tmp_path):
    (tmp_path / "depth.c").write_text(re.search(r"```c title=.depth.c.\n(.*?)```", PAGE, re.S)[1])
    flags = ["-O2", "-shared", "-fPIC", "-o", str(tmp_path / "depth.so"), str(tmp_path / "depth.c"), "-lm"]
    subprocess.run([COMPILER, *flags], check=True)
    D = ctypes.POINTER(ctypes.c_double)
    function = ctypes.CDLL(str(tmp_path / "depth.so")).depth
    function.argtypes, function.restype = [ctypes.c_int, *[D] * 6, ctypes.c_void_p], None
    check(LowLevelCallable(function))


def test_a_function_by_numba():
    pytest.importorskip("numba")
    scope = {}
    exec(re.search(r"```python\n(from numba.*?)```", PAGE, re.S)[1], scope)
    check(scope["FUNCTION"])
