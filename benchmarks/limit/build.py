"""Compile the limit for this processor: `python -m benchmarks.limit.build` prints the path of the library."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
FLAGS = [
    "-std=c++17",
    "-O3",
    "-march=native",
    "-mprefer-vector-width=512",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-Wno-psabi",
]


def library() -> Path:
    """Return the compiled library, rebuilt where the sources changed; OSError without a compiler."""
    compiler = os.environ.get("CXX") or shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        raise OSError("no C++ compiler (g++ or clang++) on the path")
    sources = sorted(HERE.glob("*.[ch]pp"))
    digest = hashlib.sha256(b"".join(source.read_bytes() for source in sources) + " ".join(FLAGS).encode())
    digest.update(Path("/proc/cpuinfo").read_bytes().partition(b"\n\n")[0] if Path("/proc/cpuinfo").exists() else b"")
    folder = Path(tempfile.gettempdir()) / f"vedette-limit-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    made = folder / f"limit-{digest.hexdigest()[:16]}.so"
    if not made.exists():
        units = [str(source) for source in sources if source.suffix == ".cpp"]
        half = made.with_suffix(f".{os.getpid()}")
        done = subprocess.run(
            [compiler, *FLAGS, "-shared", "-fPIC", "-o", str(half), *units], capture_output=True, text=True
        )
        if done.returncode:
            raise OSError(f"{compiler} failed: {done.stderr[:2000]}")
        half.replace(made)
    return made


if __name__ == "__main__":
    print(library())
