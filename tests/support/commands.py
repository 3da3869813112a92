"""Commands run in this process and in others, and the files that they leave."""

import json
import subprocess
import sys

from vedette.cli import main

FILES = ["config.json", "recording.jsonl", "series.npz", "summary.json", "summary.txt", "tracks.csv", "tracks.jsonl"]


def files(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def command(*arguments, **options):
    """`vedette` in a process of its own."""
    line = [sys.executable, "-m", "vedette", *map(str, arguments)]
    return subprocess.run(line, capture_output=True, text=True, timeout=300, **options)


def in_json(capsys, *arguments):
    code = main([*map(str, arguments), "--json"])
    return code, json.loads(capsys.readouterr().out.splitlines()[-1])
