"""`vedette explain`: what is printed, in words and as JSON, with and without a recording."""

import json

import pytest

from support.paths import EXAMPLES
from vedette.cli import main


def test_parts_figures_and_verdict_are_told_with_units(capsys):
    assert main(["explain", str(EXAMPLES / "harbour.toml")]) == 0
    said = capsys.readouterr().out
    assert "estimator.modes[0].motion: constant_velocity: " in said
    assert "sigma_accel = 0.05 m/s^1.5: standard deviation of the velocity" in said
    assert "radar: a scan every 2.5 s" in said
    assert "as far as 3000 m" in said
    assert said.endswith("nothing is out of proportion\n")


def test_a_finding_ends_the_text_with_its_place_and_the_json_holds_it(capsys):
    change = ["--set", "gate.largest_distance=1.5"]
    assert main(["explain", str(EXAMPLES / "harbour.toml"), *change, "--json"]) == 0
    *text, last = capsys.readouterr().out.splitlines()
    assert "1 thing is out of proportion" in text
    told = json.loads(last)
    assert [each["place"] for each in told["findings"]] == ["gate.largest_distance"]
    assert told["unopened"] == ""
    radar = told["sensors"][0]
    assert radar["interval_s"] == 2.5
    noise, gate = radar["axes"][0]["noise"], radar["axes"][0]["settled_gate"]
    assert noise == 6.0
    assert 1.5**0.5 * noise < gate < 1.5 * 1.5**0.5 * noise  # the square root of the largest distance, of S > R
    assert {"place": "gate", "kind": ""}.items() <= told["parts"][-1].items()


def test_without_a_recording_it_says_why_and_takes_the_interval_given(capsys):
    joyride = str(EXAMPLES / "joyride.toml")
    assert main(["explain", joyride]) == 0
    said = capsys.readouterr().out
    assert "radar: its scan interval is not known" in said
    assert "The source was not opened: source.path: is not given" in said
    assert main(["explain", joyride, "--interval", "2.5 s"]) == 0
    assert "radar: a scan every 2.5 s" in capsys.readouterr().out


@pytest.mark.parametrize(("given", "told"), [("0", "must be > 0, got 0 s"), ("2 m", "must be in s or ms")])
def test_a_wrong_interval_is_named(given, told, capsys):
    assert main(["explain", str(EXAMPLES / "harbour.toml"), "--interval", given]) == 2
    assert f"--interval: {told}" in capsys.readouterr().err


def test_a_source_that_cannot_be_opened_limits_what_is_said(tmp_path, capsys):
    main(["explain", str(EXAMPLES / "harbour.toml"), "--set", f'source={{kind="jsonl", path="{tmp_path}/none.jsonl"}}'])
    said = capsys.readouterr().out
    assert "The source was not opened: " in said
    assert "out of proportion in the config alone" in said
