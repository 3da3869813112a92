"""Show shapes in docstrings as they stand: without this, the stars of (*b, n) would be read as emphasis."""

import re
from typing import Any

import griffe


class Shapes(griffe.Extension):  # type: ignore[misc]
    """Escape stars in docstrings, outside of code."""

    def on_object(self, *, obj: Any, **_: Any) -> None:
        """Escape those of one object."""
        if obj.docstring:
            parts = re.split(r"(`[^`]*`)", obj.docstring.value)
            obj.docstring.value = "".join(p if i % 2 else p.replace("*", r"\*") for i, p in enumerate(parts))
