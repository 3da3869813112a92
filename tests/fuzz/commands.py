"""Texts that users give to commands: `--set`, tables for `new`, ranges for `tune`; each ends with a code and a line."""

from __future__ import annotations

import json
import tempfile
from functools import cache
from pathlib import Path

import numpy as np

from fuzz.cases import NUMBERS, WORDS, pick
from fuzz.folders import at, quiet
from fuzz.results import changed
from support.results import config
from vedette.commands.exit_codes import DONE, UNFIT, WRONG

PATHS = [
    *("seed", "title", "gate", "gate.probability", "judge.cover_radius", "source.ships.near.speed"),
    *("sensors.radar.sigma_range", "estimator.modes[0].motion.sigma_accel", "estimator.transition", "lifecycle.kind"),
    *("associator", "birth.spread.vx", "estimator.modes[9].kind", "a.b[0]", "[0]", "", ".", "estimator..kind", "[-1].x"),
]
VALUES = [
    "1",
    "'x'",
    "{ kind = 'pda' }",
    "[1, 2]",
    "{",
    "[[",
    "1e400",
    "nan",
    "2020-01-01",
    '"""',
    "{ a = { b = 1 } }",
    "off",
]
TABLE = b"t,x,y\n" + b"".join(b"%d,%.1f,%.1f\n" % (k, 5.0 * k + k % 3, 100.0 - 2.0 * k) for k in range(40))


@cache
def _config() -> str:
    experiment = config()
    experiment["source"]["duration"] = 40.0
    return json.dumps(experiment)


def _set(rng: np.random.Generator) -> list[str]:
    parts = []
    for _ in range(int(rng.integers(1, 3))):
        value = pick(rng, VALUES) if rng.random() < 0.5 else str(pick(rng, [*NUMBERS, *WORDS]))
        text = f"{pick(rng, PATHS)}{pick(rng, ['=', ' = ', '==', ''])}{value}"
        if rng.random() < 0.3:
            text = changed(rng, text.encode("utf-8", "replace")).decode("utf-8", "replace")
        parts.append(f"--set={text}".replace("\0", ""))  # by itself a text that begins with - would be an option
    return ["run", "config.json", "--out", "out", "--stream", *parts]


def _new(rng: np.random.Generator) -> list[str]:
    Path("table.csv").write_bytes(changed(rng, TABLE) if rng.random() < 0.8 else changed(rng, TABLE[:60]))
    return ["new", "config", "table.csv", "--out", "new.toml"]


def _tune(rng: np.random.Generator) -> list[str]:
    low, high = (str(pick(rng, [*NUMBERS, "0.1", "1", "10", "x", ""])) for _ in range(2))
    free = f"{pick(rng, PATHS)}={low}{pick(rng, ['..', '...', '.', '-'])}{high}"
    return ["tune", "config.json", "--free", free, "--starts", pick(rng, ["1", "0", "-1", "x"]), "--out", "tuned"]


def case(rng: np.random.Generator, folder: Path) -> str:
    """Run one command with such a text."""
    made = pick(rng, [_set] * 12 + [_new, _tune])
    with tempfile.TemporaryDirectory(dir=folder) as place, at(Path(place)):
        Path("config.json").write_text(_config())
        line = made(rng)
        code, told = quiet(line)
        assert code in (DONE, WRONG, UNFIT), f"{line}: exit code {code}: {told[:300]}"
        assert code in (DONE, UNFIT) or "vedette: " in told, f"{line} says nothing"
        assert len(told) < 100_000, f"{line}: {len(told)} characters"
        assert Path("config.json").read_text() == _config()
    return f"{line[0]} {code}"
