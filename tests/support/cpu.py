"""CPU time of one call, for tests of how it grows."""

import gc
from collections.abc import Callable
from time import process_time


def seconds(call: Callable[[], object], times: int = 3) -> float:
    """Return the least CPU time of some calls (s), without collections of garbage: they pass all that other tests keep."""
    taken = []
    gc.disable()
    try:
        for _ in range(times):
            began = process_time()
            call()
            taken.append(process_time() - began)
    finally:
        gc.enable()
    return min(taken)
