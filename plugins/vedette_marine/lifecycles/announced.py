"""Tracks of announced targets, kept to the end."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, final

from attrs import frozen

from vedette_standard import PermanentTracks


@final
@frozen
class AnnouncedTracks(PermanentTracks):
    """Confirms every track at once and ends none; goes with the birth `announced`.

    >>> import numpy as np
    >>> from vedette import Review
    >>> life, existence = AnnouncedTracks(), np.array([1.0, 1e-9])
    >>> memory, confirmed, alive = life.review(life.start(existence), Review(900.0, existence, np.zeros(2), np.ones(2)))
    >>> confirmed.tolist(), alive.tolist(), life.predict(existence, 900.0).tolist() == existence.tolist()
    ([True, True], [True, True], True)
    >>> life.certain, life.permanent, life.usual_birth["kind"]
    (True, True, 'announced')
    """

    kind: ClassVar[str] = "announced"
    usual_birth: ClassVar[Mapping[str, Any]] = {"kind": "announced"}
