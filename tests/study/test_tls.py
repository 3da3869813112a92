"""What docs/trust.md says of TLS: Dask's own configuration is all that it takes."""

import os
import shutil
import subprocess
import sys

import pytest

import vedette
from support.clusters import boat, cluster

distributed = pytest.importorskip("distributed")

if shutil.which("openssl") is None:
    pytest.skip("openssl makes the certificates", allow_module_level=True)

CONFIG = boat(duration=5)
CLUSTER = cluster("tls://")


def dotted(name):
    """Return what Dask calls the setting of an environment variable."""
    return name.removeprefix("DASK_").lower().replace("__", ".").replace("_", "-")


@pytest.mark.filterwarnings("ignore")
@pytest.mark.costly
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
