"""A draft of targets that keep their courses: a filter must still be able to learn that one turns."""

import numpy as np

from vedette.drafting.config import draft_config


def file_of(path, turn_after, seed=3):
    """100 looks, 3 s apart, at a target that goes straight, or turns once after some looks; 11 m of noise."""
    rng = np.random.default_rng(seed)
    course = np.maximum(0, np.arange(100) - turn_after) * 0.03
    steps = 18 * np.stack([np.cos(course), np.sin(course)], axis=-1)
    places = np.cumsum(steps, axis=0) + rng.normal(0, 11, (100, 2))
    path.write_text("t,x,y\n" + "".join(f"{3 * k},{x:.2f},{y:.2f}\n" for k, (x, y) in enumerate(places)))
    return path


def sigma_accel(text):
    line = next(line for line in text.splitlines() if line.startswith("motion"))
    return float(line.split("sigma_accel = ")[1].split(" ")[0]), line


def test_straight_courses_are_drafted_with_noise_that_is_felt_within_a_hundred_scans(tmp_path):
    drafts = [sigma_accel(draft_config(file_of(tmp_path / "straight.csv", 100, seed))) for seed in range(6)]
    assert min(found for found, _ in drafts) * 300**1.5 / np.sqrt(3) > 0.7 * 11
    assert any("would hardly notice a turn" in line for _, line in drafts)


def test_what_turns_is_drafted_as_it_is(tmp_path):
    found, line = sigma_accel(draft_config(file_of(tmp_path / "turns.csv", 50)))
    assert found * 300**1.5 / np.sqrt(3) > 3 * 11
    assert "of greatest likelihood" in line
