"""The filters that know their target by its look: where it is in its box, drift, fading, and the correlation baseline."""

import numpy as np
import pytest

import vedette
from vedette import Frame, Scan
from vedette_flir import evidence, patches
from vedette_flir.estimators import matches, template_search
from vedette_flir.estimators.earlier import Elsewhere
from vedette_flir.estimators.matches import match_ratio
from vedette_flir.estimators.template_search import Matcher
from vedette_flir.initial_box import target_in
from vedette_flir.patches import alike, blurred, contrast, isolated, kept, sample, similarity

TRACKER = {
    "estimator": {
        "kind": "template_filter",
        "motion": {"kind": "carrying", "motion": {"kind": "image_velocity"}, "carries": {"width": "px", "height": "px"}},
    },
    "sensors": {"camera": {"kind": "box_centroid", "detection_probability": 0.95}},
    "gate": {"probability": 0.9999},
    "associator": {"kind": "pda"},
    "birth": {"kind": "given"},
    "lifecycle": {"kind": "single_target"},
}


def tracker(**estimator):
    return vedette.load(TRACKER | {"estimator": TRACKER["estimator"] | estimator}).tracker


def bird(k, step=0.3, bright=60.0, trees=True, size=(60, 80)):
    """A small bird at [30 + step k, 20.2], above trees that reach within 6 px; and where it is."""
    y, x = np.mgrid[: size[0], : size[1]]
    at = np.array([30 + step * k, 20.2])
    noise = np.random.default_rng([3, k]).normal(0, 1.0, size)
    ground = np.where(y > 26 + 2 * np.sin(0.3 * x), 200.0, 40.0) if trees else np.full(size, 40.0)
    return ground + bright * np.exp(-0.5 * ((x - at[0]) ** 2 + (y - at[1]) ** 2) / 1.3**2) + noise, at


def follow(chosen, frames, box=(0.0, 0.0, 10.0, 9.0), told="hit"):
    """Estimates (s, 2) and hits (s,), or what else of a state is `told`, from a box off by the first two numbers, in px."""
    prior = vedette.Gaussian(
        np.array([[frames[0][1][0] + box[0], frames[0][1][1] + box[1], 0.0, 0.0, *box[2:]]]),
        np.diag([1.0, 1.0, 1e4, 1e4, 0.0, 0.0])[None],
    )
    state, found, hits = chosen.start(prior, 0.0), [], []
    for k, (pixels, _) in enumerate(frames):
        state = chosen.step(state, Scan.image(k / 30, "camera", Frame(pixels)))
        found.append(chosen.estimate(state).mean[0, :2])
        hits.append(getattr(state, told)[0])
    return np.array(found), np.array(hits)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_target_is_found_whatever_the_box_does(sign):
    """Boxes off by 12 % and 20 % too large or small, one of which holds more trees than bird, show the same target."""
    pixels, at = bird(0)
    for off, scale in (((0, 0), 1.0), ((0.12, 0.12), 1.0), ((-0.12, -0.12), 1.0), ((0, 0.12), 1.2), ((0.12, 0), 0.8)):
        box = scale * np.array([10.0, 12.0])
        centre = at + np.array(off) * [10.0, 12.0]
        found = target_in(sign * pixels, centre, box)
        assert found.sign == sign
        np.testing.assert_allclose(centre + found.offset, at, atol=0.35)
        assert np.all((found.size >= 3) & (found.size <= 8))


def test_a_box_without_a_target_is_taken_as_it_is():
    found = target_in(np.full((40, 40), 9.0), np.array([20.0, 20.0]), np.array([10.0, 8.0]))
    np.testing.assert_array_equal(found.offset, [0.0, 0.0])
    np.testing.assert_allclose(found.size, [7.0, 5.6])


@pytest.mark.parametrize("box", [(0, 0, 10, 9), (1.2, 1.0, 10, 9), (-1.0, 1.2, 12, 11), (0, 0, 8, 7.2)])
@pytest.mark.by_turns
def test_a_start_that_is_off_stays_as_it_was_and_loses_nothing(box):
    """The point that the box marks is followed, whatever it marks."""
    frames = [bird(k) for k in range(40)]
    found, _ = follow(tracker(), frames, box)
    off = found - np.array([at for _, at in frames]) - box[:2]
    assert np.abs(off).max() < 1.5


@pytest.mark.costly
def test_a_target_that_fades_is_missed_and_found_again():
    """For eight frames a smear stands where the target was, a tenth as strong: of its shape, but not the target."""
    frames = [bird(k, step=1.2, trees=False) for k in range(30)]
    gone = bird(12, step=1.2, trees=False, bright=6.0)
    shown = [(gone[0], at) if 12 <= k < 20 else (pixels, at) for k, (pixels, at) in enumerate(frames)]
    found, hits = follow(tracker(), shown)
    assert hits[13:20].max() < 0.5
    assert hits[21:].min() > 0.9
    assert np.abs(found - np.array([at for _, at in frames]))[21:].max() < 1.0
    _, fooled = follow(tracker(limit=0.05, brighten=0.5, smoothing=0.5), shown)  # the mutant: anything of this shape will do
    assert fooled[13:20].max() > 0.9


def test_a_few_faint_frames_are_not_worth_another_target(monkeypatch):
    """For three frames the bird has .4 of its contrast, just below the limit, and 16 px beside it is another one."""
    frames = [bird(k, step=1.2, trees=False, bright=25.0 if 10 <= k < 13 else 60.0) for k in range(30)]
    y, x = np.mgrid[:60, :80]
    other = 42.0 * np.exp(-0.5 * ((x - 43.2) ** 2 + (y - 36.2) ** 2) / 1.3**2)
    shown = [(pixels + other * (k >= 8), at) for k, (pixels, at) in enumerate(frames)]
    true = np.array([at for _, at in frames])
    found, _ = follow(tracker(limit=0.72), shown)
    assert np.abs(found - true).max() < 0.5
    monkeypatch.setattr(matches, "WEAK", 150.0)  # the mutant: a weak match is a sure miss, and the search widens
    fooled, _ = follow(tracker(limit=0.72), shown)
    assert np.abs(fooled - true)[-1].max() > 10.0


@pytest.mark.costly
def test_a_drifting_template_is_held_by_its_centroid():
    """A template renewed in each frame, on whole cells, walks off its target by the rounding; its centroid tells."""
    errors = []
    for step in (0.3, 0.37, 0.45):  # how far it walks by each differs
        frames = [bird(k, step=step, trees=False, bright=60.0) for k in range(120)]
        true = np.array([at for _, at in frames])
        free, _ = follow(tracker(smoothing=1.0, anchor=0.0), frames)
        held, _ = follow(tracker(smoothing=1.0, anchor=0.0, recentre=0.3), frames)
        errors.append([np.abs(each - true)[60:].mean() for each in (free, held)])
    free_error, held_error = np.mean(errors, axis=0)
    assert free_error > 2.5 * held_error
    assert held_error < 0.3


@pytest.mark.parametrize("wrong", [None, "as opened", "noise and all"])
def test_noise_that_stands_around_a_target_holds_no_template(monkeypatch, wrong):
    """As a codec repeats it. In noise a grey opening leaves contrast everywhere, by which where it was is more like it."""
    if wrong == "as opened":
        monkeypatch.setattr(Matcher, "apart", opened)
    elif wrong:
        monkeypatch.setattr(patches, "NOISY", 0.0)
    by, size, (y, x) = Matcher(36, 0.3, 1.3, 2.5, 40.0), np.array([30.0, 24.0]), np.mgrid[:120, :160]
    (step, inner), mask = by.grid(size), by.mask(size)
    at, held = np.array([80.0, 60.0]), 0
    for seed in range(6):
        noise = np.random.default_rng(seed).normal(60.0, 28.0, x.shape)
        before, now = (
            by.apart(
                noise + 60.0 * np.exp(-0.5 * ((x - 80.0 - off) ** 2 + (y - 60.0) ** 2) / 1.8**2), at, size, step, 72, np.inf
            )
            for off in (0.0, 4.0 * step)
        )
        amplitude = contrast(before, inner)
        there = similarity(kept(now, amplitude), kept(before, amplitude)[None, 18:54, 18:54], mask)[0]
        held += there[18, 22] < there[18, 18]
    assert held == 0 if wrong is None else held > 0


def opened(by, pixels, centre, size, step, cells, amplitude):
    """The mutant: contrast above the opening, not above what the opening of noise leaves."""
    image, sign = blurred(sample(pixels, centre, step, cells)), np.sign(amplitude)
    return sign * isolated(sign * image, by.opening * float(np.max(size)) / step)


@pytest.mark.costly
def test_a_bright_bank_beside_a_target_is_none_of_it(monkeypatch):
    """It comes within 7 px of a bank five times as bright, below which there are spots like it."""
    (y, x), frames = np.mgrid[:120, :160], []
    for k in range(90):
        at = np.array([40.0 + 0.5 * k, min(40.0 + 0.3 * k, 60.0)])
        scene = 30.0 + 200.0 / (1.0 + np.exp(66.0 - y)) / (1.0 + np.exp(y - 78.0))
        for left in (60.0, 74.0, 95.0):
            scene += 40.0 * np.exp(-0.5 * ((x - left) ** 2 + (y - 88.0) ** 2) / 1.6**2)
        scene += 40.0 * np.exp(-0.5 * (((x - at[0]) / 3.0) ** 2 + ((y - at[1]) / 1.6) ** 2))
        frames.append((scene + np.random.default_rng([7, k]).normal(0.0, 1.0, x.shape), at))
    found, existence = existences(frames, (14.0, 10.0))
    assert existence.min() > 0.99
    assert np.abs(found - np.array([at for _, at in frames])).max() < 0.4
    monkeypatch.setattr(template_search, "without_large", lambda image, *_: image)  # the mutant leaves it
    found, existence = existences(frames, (14.0, 10.0))
    assert np.abs(found - np.array([at for _, at in frames])).max() > 4.0


@pytest.mark.costly
def test_the_amplitude_follows_a_target_that_brightens():
    frames = [bird(k, trees=False, bright=20.0 + 4.0 * k) for k in range(60)]
    found, hits = follow(tracker(brighten=0.2), frames)
    assert hits.min() > 0.9
    assert np.abs(found - np.array([at for _, at in frames])).max() < 0.8
    follows_neither = tracker(brighten=0.0, smoothing=0.0)  # the mutant
    assert follow(follows_neither, frames[::-1])[1][-1] < 0.5


@pytest.mark.costly
def test_a_target_that_turns_is_held(monkeypatch):
    """It looks as it did a frame before, however far it has turned since its template was learned."""
    (y, x), frames = np.mgrid[:60, :100], []
    for k in range(60):
        at, turned = np.array([30 + 0.5 * k, 30.0]), np.radians(8.0 * k)
        along = (x - at[0]) * np.cos(turned) + (y - at[1]) * np.sin(turned)
        across = (y - at[1]) * np.cos(turned) - (x - at[0]) * np.sin(turned)
        shown = 60.0 * np.exp(-0.5 * ((along / 7.0) ** 2 + (across / 1.2) ** 2))
        frames.append((40.0 + shown + np.random.default_rng([5, k]).normal(0.0, 1.0, x.shape), at))
    found, existence = existences(frames, (22.0, 22.0))
    assert existence.min() > 0.9
    assert np.abs(found - np.array([at for _, at in frames])).max() < 1.5
    monkeypatch.setattr(Matcher, "of_late", lambda by, look: 0.0)  # the mutant
    assert existences(frames, (22.0, 22.0))[1].min() < 0.5


@pytest.mark.costly
def test_a_hidden_target_is_not_taken_for_a_smaller_thing_of_its_scene(monkeypatch):
    """A spot of its shape is .3 of its size. It is told as lost while it is hidden, and found where it comes out."""
    (y, x), frames = np.mgrid[:120, :200], []
    for k in range(60):
        at = np.array([40 + 0.8 * k, 40.0])
        shown = 40.0 * np.exp(-0.5 * ((x - 150) ** 2 + (y - 90) ** 2) / 1.0**2)
        if not 20 <= k < 32:
            shown += 60.0 * np.exp(-0.5 * ((x - at[0]) ** 2 + (y - at[1]) ** 2) / 3.5**2)
        frames.append((40.0 + shown + np.random.default_rng([9, k]).normal(0.0, 1.0, x.shape), at))
    true = np.array([at for _, at in frames])
    found, existence = existences(frames, (16.0, 16.0))
    assert existence[22:32].max() < 0.5
    assert np.abs(found - true).max() < 2.0
    monkeypatch.setattr(evidence, "RESIZED", 0.0)  # the mutant
    monkeypatch.setattr(Elsewhere, "new", lambda *_: (np.nan, np.inf))  # which would tell, too
    assert np.abs(existences(frames, (16.0, 16.0))[0] - true)[-1].max() > 50.0


def existences(frames, box):
    """Estimates (s, 2) and existence (s,) from the first true place, in px, where existence says whether it is lost."""
    chosen = vedette.load(TRACKER | {"lifecycle": {"kind": "reappearing_target"}}).tracker
    return follow(chosen, frames, (0.0, 0.0, *box), "existence")


def test_the_first_template_counts_less_once_the_target_looks_otherwise():
    """What looks as the target does now is it, and what looks as it did at first is not."""
    y, x = np.mgrid[:20, :20] - 9.5
    now, first = (np.exp(-0.5 * ((x / a) ** 2 + (y / b) ** 2)) for a, b in ((4.0, 1.2), (1.2, 4.0)))
    by, patches, mask = Matcher(20, 1.0, 1.6, 2.5, 40.0), np.stack([now, first]), np.ones((20, 20))
    as_now, as_first = (float(by.likeness(image, patches, mask)[0][0, 0]) for image in (now, first))
    both = alike(now, first, mask)
    assert as_now == pytest.approx((1.0 + both**2) / (1.0 + both))
    assert as_now > 0.5 * (1.0 + both) + 0.05  # which it is if the first counts as much as ever
    assert as_first < as_now - 0.15
    assert by.likeness(now, np.stack([now, now]), mask)[0][0, 0] == pytest.approx(1.0)


def test_the_ratio_of_a_match():
    assert match_ratio(0.5, 0.5, 20.0) == 0.0
    assert match_ratio(0.9, 0.5, 20.0) == pytest.approx(10 * np.log(0.75 / 0.19))
    assert match_ratio(0.25, 0.5, 20.0) == pytest.approx(-20.0)
    assert match_ratio(1.0, 0.5, 100.0) == 60.0


def test_the_correlation_baseline_is_opencv_s():
    """Its place is that of matchTemplate over the whole image, to a pixel; a flat box and a flat image are misses."""
    import cv2

    frames = [bird(k, step=1.3) for k in range(12)]
    chosen = tracker(kind="correlation_filter", sigma=0.05)
    found, hits = follow(chosen, frames, (0.0, 0.0, 11.0, 9.0))
    assert hits.min() > 0.9
    at = np.rint(frames[0][1]).astype(int)
    template = frames[0][0][at[1] - 4 : at[1] + 5, at[0] - 5 : at[0] + 6].astype(np.float32)
    for (pixels, _), place in zip(frames[1:], found[1:], strict=True):
        rho = cv2.matchTemplate(pixels.astype(np.float32), template, cv2.TM_CCOEFF_NORMED)
        j, i = np.unravel_index(np.argmax(rho), rho.shape)
        assert np.abs(place - [i + 5, j + 4]).max() < 1.2
    flat = (np.full((60, 80), 7.0), frames[0][1])
    _, none = follow(chosen, [flat, *frames[1:]])
    assert none[1:].max() < 0.2
    _, lost = follow(chosen, [*frames[:6], flat])
    assert lost[-1] < 0.2
    with pytest.raises(vedette.ConfigError, match="must carry the axis 'width'"):
        tracker(kind="correlation_filter", motion={"kind": "image_velocity"})


@pytest.mark.parametrize("kind", ["template_filter", "correlation_filter"])
def test_runs_together_are_runs_alone(kind):
    """Two runs of two targets in one batch, images apart, as each alone."""
    chosen = tracker(kind=kind)
    images = np.stack([bird(0)[0], bird(40)[0]])
    after = np.stack([bird(1)[0], bird(41)[0]])
    mean = np.array([[[30.0, 20.2, 0, 0, 10, 9]], [[42.0, 20.2, 0, 0, 10, 9]]])
    cov = np.broadcast_to(np.diag([1.0, 1.0, 1e4, 1e4, 0.0, 0.0]), (2, 1, 6, 6))

    def last(x, P, *pixels):
        state = chosen.start(vedette.Gaussian(x, P), 0.0)
        for k, image in enumerate(pixels):
            state = chosen.step(state, Scan.image(k / 30, "camera", Frame(image)))
        return chosen.estimate(state).mean

    together = last(mean, cov, images, after)
    for run in range(2):
        np.testing.assert_allclose(last(mean[run], cov[run], images[run], after[run]), together[run], atol=1e-9)
