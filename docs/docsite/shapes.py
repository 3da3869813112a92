"""Show shapes in docstrings as they stand: without this, the stars of (*b, n) would be read as emphasis."""

import re
from typing import Any

import griffe

LITERAL = re.compile(r"(?m)(`[^`]*`|^\*\*?\w+$)")
"""Code, and the name of a parameter that takes all others, in a line of its own: who reads docstrings knows its stars."""


def escaped(docstring: str) -> str:
    """Return a docstring whose stars are none of Markdown's."""
    parts = LITERAL.split(docstring)
    return "".join(part if i % 2 else part.replace("*", r"\*") for i, part in enumerate(parts))


class Shapes(griffe.Extension):  # type: ignore[misc]
    """Escape stars in docstrings, outside of code."""

    def on_object(self, *, obj: Any, **_: Any) -> None:
        """Escape those of one object."""
        if obj.docstring:
            obj.docstring.value = escaped(obj.docstring.value)
