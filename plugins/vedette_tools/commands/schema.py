"""`vedette schema`: the JSON Schema of configs."""

from __future__ import annotations

import json
from argparse import Namespace

from vedette_tools.json_schema import schema


def run(arguments: Namespace) -> int:
    """Print it."""
    print(json.dumps(schema(), indent=2))
    return 0
