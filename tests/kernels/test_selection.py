"""Which kernels run is decided by what was built and by VEDETTE_KERNELS; a run gives the same with either."""

import importlib.util
import json
import os
import subprocess
import sys

import numpy as np
import pytest

BUILT = importlib.util.find_spec("vedette.kernels._compiled") is not None

RUN = """
import json, numpy as np, vedette
from vedette import kernels
tracker = vedette.build({
    "estimator": {"kind": "imm", "transition": [[0.9, 0.1], [0.1, 0.9]], "modes": [
        {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
        {"kind": "ekf", "motion": {"kind": "coordinated_turn", "sigma_accel": 0.3, "sigma_turn_rate": 0.01}}]},
    "sensors": {"radar": {"kind": "range_bearing", "sigma_range": 10.0, "sigma_bearing": 0.01, "detection_probability": 0.9,
                          "max_range": 5000.0, "clutter_per_scan": 5.0}},
    "associator": {"kind": "pda"},
    "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0, "turn_rate": 0.05}},
    "lifecycle": {"kind": "m_of_n"}})
rng, state = np.random.default_rng(1), tracker.start(seed=1)
for k in range(30):
    z = np.concatenate([rng.normal([1000 + 8 * k, 0.5], [10, 0.01], (1, 2)), rng.uniform([0, -3], [5000, 3], (4, 2))])
    state = tracker.step(state, vedette.Scan(2.0 * k, "radar", vedette.Detections.of(z)))
estimate = tracker.estimate(state)
print(json.dumps([kernels.RUNNING, state.ids.tolist(), estimate.mean.tolist(), estimate.cov.tolist()]))
"""


def ran(kernels, code=RUN):
    environment = os.environ | {"VEDETTE_KERNELS": kernels}
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=False)


@pytest.mark.costly
def test_numpy_runs_where_it_is_asked_for():
    why, *_ = json.loads(ran("numpy").stdout)
    assert why == "numpy, as the environment variable VEDETTE_KERNELS asks for"


@pytest.mark.costly
@pytest.mark.skipif(not BUILT, reason="the compiled kernels were not built here")
def test_the_twins_track_alike():
    one, other = (json.loads(ran(kernels).stdout) for kernels in ("numpy", "compiled"))
    assert other[0].startswith("compiled, for the instruction set ")
    assert one[1] == other[1]
    assert len(one[1]) > 1, "there is something to compare"
    np.testing.assert_allclose(one[2], other[2], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(one[3], other[3], rtol=1e-9, atol=1e-9)


def test_an_unknown_wish_is_refused():
    refused = ran("fortran")
    assert refused.returncode != 0
    assert "VEDETTE_KERNELS: must be 'numpy' or 'compiled', got 'fortran'" in refused.stderr


def test_the_command_line_refuses_it_in_a_line():
    environment = os.environ | {"VEDETTE_KERNELS": "fortran"}
    told = subprocess.run(
        [sys.executable, "-m", "vedette", "info"], capture_output=True, text=True, env=environment, check=False
    )
    assert told.returncode == 2
    assert told.stderr == "vedette: error: VEDETTE_KERNELS: must be 'numpy' or 'compiled', got 'fortran'\n"


HIDE = "import sys; sys.modules['vedette.kernels._compiled'] = None; sys.modules['vedette._values'] = None\n"


@pytest.mark.costly
def test_without_the_extension_numpy_runs_and_says_so():
    why, ids, *_ = json.loads(ran("", HIDE + RUN).stdout)
    assert why == "numpy, as the compiled kernels were not built here"
    assert ids


@pytest.mark.costly
def test_info_says_what_runs():
    found = subprocess.run([sys.executable, "-m", "vedette", "info", "--json"], capture_output=True, text=True, check=True)
    facts = json.loads(found.stdout)
    assert facts["kernels"].startswith(("compiled", "numpy"))
    assert facts["libraries"]["numpy"] == np.__version__
    assert "components" in facts["plugins"]["vedette"]
    told = subprocess.run([sys.executable, "-m", "vedette", "info"], capture_output=True, text=True, check=True).stdout
    assert f"kernels:   {facts['kernels']}" in told
