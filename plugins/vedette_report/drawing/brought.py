"""Draw the pictures that plugins bring: all of a run, or the one of a report."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any, final, get_args

from attrs import evolve, frozen

from vedette import Registry, Result
from vedette_report.drawing.canvas import Format, Look, Width, read_style, save, styled
from vedette_report.output import can_draw


@final
@frozen
class Drawing:
    """Pictures in one look."""

    look: Look

    def possible(self) -> bool:
        """Return whether pictures can be drawn; otherwise say on standard error what is missing."""
        return can_draw()

    def names(self) -> list[str]:
        """Return the names of the files that pictures of a run may have, in whatever format."""
        looks = [evolve(self.look, form=form) for form in get_args(Format)]
        return [look.file(entry.kind) for entry in Registry.installed().of_role("picture") for look in looks]

    def of_run(self, result: Result, folder: Path) -> list[str]:
        """Write every picture of a run into its folder; return the files' names."""
        written = []
        with styled(self.look):
            for entry in Registry.installed().of_role("picture"):
                picture: Any = entry.cls()
                try:
                    made = picture.draw(result) if picture.of == "run" else None
                except Exception as error:
                    if entry.distribution == "vedette":
                        raise
                    told = f"the picture {entry.kind!r} of {entry.bringer} failed: {type(error).__name__}: {error}"
                    print(f"vedette: {told}", file=sys.stderr)  # a third party's: the run has its results all the same
                    continue
                if made is not None:
                    written.append(self.look.file(entry.kind))
                    save(made, folder / written[-1])
        return written

    def save(self, kind: str, subject: Any, path: Path) -> None:
        """Write the picture of this kind, drawn of a subject."""
        picture: Any = Registry.installed().get("picture", kind).cls()
        with styled(self.look):
            save(picture.draw(subject), path)


def drawing(form: Format = "png", columns: Width = "screen", style: str | Path | None = None) -> Drawing:
    """Return what draws pictures in a format, a size and the user's own style; ConfigError at once if that is no style."""
    look = Look(form, columns, None if style is None else Path(style))
    if look.style is not None and find_spec("matplotlib"):
        read_style(look.style)
    return Drawing(look)
