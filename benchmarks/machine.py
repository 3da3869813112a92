"""The machine on which it was measured."""

from __future__ import annotations

import os
import platform
from datetime import UTC, datetime
from pathlib import Path

import numpy as np


def described() -> str:
    """Describe processor, its vector units, Python, numpy, its BLAS, and the load of the machine."""
    info = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else ""
    fields = dict(line.split(":", 1) for line in info.partition("\n\n")[0].splitlines() if ":" in line)
    facts = {key.strip(): value.strip() for key, value in fields.items()}
    model = facts.get("model name") or platform.processor() or platform.machine()
    if family := facts.get("cpu family"):
        model += f" (family {family}, model {facts.get('model', '?')})"
    units = [unit for unit in ("avx2", "avx512f", "asimd") if unit in facts.get("flags", facts.get("Features", "")).split()]
    blas = np.show_config(mode="dicts")["Build Dependencies"]["blas"]["name"]
    load = os.getloadavg()[0]
    return (
        f"{model}, {os.cpu_count()} cores, {' '.join(units) or 'no vector units known'}; one thread; load {load:.1f} at the"
        f" start. Python {platform.python_version()}, numpy {np.__version__} ({blas}), {platform.system()}."
        f" {datetime.now(UTC):%Y-%m-%d}."
    )
