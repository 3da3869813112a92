"""One target that is known to be there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, final

from attrs import frozen

from vedette.tracking import PermanentTracks


@final
@frozen
class SingleTarget(PermanentTracks):
    """The tracks that are given before the first scan are never doubted and never end; goes with the birth `given`."""

    kind: ClassVar[str] = "single_target"
    usual_birth: ClassVar[Mapping[str, Any]] = {"kind": "given"}
