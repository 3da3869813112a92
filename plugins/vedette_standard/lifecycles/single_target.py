"""One target that is known to exist."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import frozen

from vedette.tracking import PermanentTracks


@final
@frozen
class SingleTarget(PermanentTracks):
    """Confirms the tracks given before the first scan at once and never ends them; goes with the birth `given`."""

    kind: ClassVar[str] = "single_target"
