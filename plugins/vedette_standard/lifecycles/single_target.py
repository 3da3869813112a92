"""One target that is known to exist."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, final

from attrs import frozen

from vedette_standard.permanent import PermanentTracks


@final
@frozen
class SingleTarget(PermanentTracks):
    """Confirms the tracks given before the first scan at once and never ends them; goes with the birth `given`.

    >>> import numpy as np
    >>> from vedette import Review
    >>> life, existence = SingleTarget(), np.array([1.0, 1e-9])
    >>> memory, confirmed, alive = life.review(life.start(existence), Review(900.0, existence, np.zeros(2), np.ones(2)))
    >>> confirmed.tolist(), alive.tolist(), life.predict(existence, 900.0).tolist() == existence.tolist()
    ([True, True], [True, True], True)
    >>> life.certain, life.permanent, life.usual_birth["kind"]
    (True, True, 'given')
    """

    kind: ClassVar[str] = "single_target"
    usual_birth: ClassVar[Mapping[str, Any]] = {"kind": "given"}
