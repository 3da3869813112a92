"""What is out of proportion: one finding."""

from __future__ import annotations

from typing import Any

from attrs import asdict, frozen


@frozen
class Finding:
    """What is out of proportion: its place in the config, the figures, and what is usual."""

    place: str
    text: str
    usual: str

    def data(self) -> dict[str, Any]:
        """Return it as plain data."""
        return asdict(self)

    def __str__(self) -> str:
        return f"{self.place}: {self.text}. Usual: {self.usual}"
