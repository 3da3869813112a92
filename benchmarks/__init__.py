"""Benchmarks: `python -m benchmarks` compares speed; the other files say what they measure when run."""
