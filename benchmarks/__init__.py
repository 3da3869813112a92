"""Benchmarks: `python -m benchmarks` measures speed side by side; the other files say what they do when run."""
