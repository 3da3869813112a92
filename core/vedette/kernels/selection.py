"""Selection of the kernels: the compiled ones if they were built, unless VEDETTE_KERNELS=numpy selects the reference."""

from __future__ import annotations

import os
from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import Any, TypeVar

from attrs import frozen

from vedette.errors import ConfigError

F = TypeVar("F", bound=Callable[..., Any])


@frozen
class Selection:
    """The compiled kernels, if they are to run, and a line on what runs and why."""

    module: ModuleType | None
    why: str

    @classmethod
    def now(cls) -> Selection:
        """Select by what is built and what the environment asks for; ConfigError if that is impossible."""
        wanted = os.environ.get("VEDETTE_KERNELS", "")
        if wanted not in ("", "numpy", "compiled"):
            raise ConfigError.at("VEDETTE_KERNELS", f"must be 'numpy' or 'compiled', got {wanted!r}")
        if wanted == "numpy":
            return cls(None, "numpy, as the environment variable VEDETTE_KERNELS asks for")
        try:
            module = import_module("vedette.kernels._compiled")
        except ModuleNotFoundError:
            if wanted == "compiled":
                raise ConfigError.at("VEDETTE_KERNELS", "the compiled kernels were not built here") from None
            return cls(None, "numpy, as the compiled kernels were not built here")
        return cls(module, f"compiled, for the instruction set {module.instruction_set()}")

    @property
    def build(self) -> str:
        """A hash of the sources, the compiler and the flags of the compiled kernels; "" if none run."""
        return self.module.build() if hasattr(self.module, "build") else ""  # type: ignore[union-attr]

    def __call__(self, reference: F, *results: type) -> F:
        """Return the compiled twin of a kernel, which passes to `reference` what it does not take, or `reference`.

        `results`: the type of what it returns, if that is more than one array, and the type of a value within.
        """
        twin: F | None = getattr(self.module, reference.__name__, None)
        if self.module is None or twin is None:
            return reference
        self.module.bind(reference.__name__, reference, *results)
        return twin
