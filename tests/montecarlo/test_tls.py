"""What docs/trust.md says of TLS: Dask's own configuration is all that it takes."""

import os
import shutil
import subprocess
import sys

import pytest

import vedette

distributed = pytest.importorskip("distributed")

if shutil.which("openssl") is None:
    pytest.skip("openssl makes the certificates", allow_module_level=True)

START = {"x": [0, 10], "y": [0, 10], "vx": [5, 2], "vy": [3, 2]}
CV = {"kind": "constant_velocity", "sigma_accel": 0.5}
CONFIG = {
    "source": {
        "kind": "simulation",
        "duration": 5,
        "looks": {"radar": {"interval": 1}},
        "drawn": {"boat": {"models": [CV], "start": START}},
    },
    "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9}},
    "estimator": {"kind": "kalman", "motion": CV},
    "associator": {"kind": "pda"},
    "lifecycle": {"kind": "single_target", "start": START},
}
CLUSTER = """
import sys
from distributed import LocalCluster
if __name__ == "__main__":
    made = LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None, silence_logs=50,
                        protocol="tls://", host="127.0.0.1")
    print(made.scheduler_address, flush=True)
    sys.stdin.read()
"""


def dotted(name):
    """Return what Dask calls the setting of an environment variable."""
    return name.removeprefix("DASK_").lower().replace("__", ".").replace("_", "-")


@pytest.mark.filterwarnings("ignore")
def test_a_study_over_tls_and_none_without_the_certificates(tmp_path, monkeypatch):
    import dask

    key, cert = tmp_path / "own-key.pem", tmp_path / "own.pem"
    made = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=own"]
    subprocess.run([*made, "-keyout", str(key), "-out", str(cert)], check=True, capture_output=True)
    own = {f"DASK_DISTRIBUTED__COMM__TLS__{who}__{what}": str(path) for who in ("SCHEDULER", "WORKER", "CLIENT")
           for what, path in (("CERT", cert), ("KEY", key))}  # fmt: skip
    own |= {"DASK_DISTRIBUTED__COMM__TLS__CA_FILE": str(cert), "DASK_DISTRIBUTED__COMM__REQUIRE_ENCRYPTION": "True"}
    options = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True, "env": os.environ | own}
    with subprocess.Popen([sys.executable, "-c", CLUSTER], **options) as there:
        try:
            address = there.stdout.readline().strip()
            assert address.startswith("tls://")
            with pytest.raises(vedette.ConfigError, match="no Dask scheduler answers"):
                vedette.monte_carlo(CONFIG, 4, 1, scheduler=address)
            with dask.config.set({dotted(name): True if text == "True" else text for name, text in own.items()}):
                assert len(vedette.monte_carlo(CONFIG, 4, 1, scheduler=address).figures) > 0
                with pytest.raises(vedette.ConfigError, match="no Dask scheduler answers"):
                    vedette.monte_carlo(CONFIG, 4, 1, scheduler=address.replace("tls://", "tcp://"))
        finally:
            there.kill()
