"""Patches of a frame on a grid that fits the target's box, and the search for a patch in a frame. One target each."""

from __future__ import annotations

import numpy as np

from vedette import Array, Indices
from vedette_flir.sources.images import one_thread

BRIGHTEST = 1.5
"""Contrast beyond this multiple of the target's own is clipped: a bright background matches no better than the target."""

NOISY = 0.75
"""Part of a target's amplitude that is taken for noise, at most, so that something is left. By hand."""

NEWLY = 6.0
"""How far a new thing stands out from what changes as well, in standard deviations of its mean, at least. By hand, on the
drawn targets of `python -m benchmarks.flir_departing 5 12 19 26`.
"""

HALO = 2
"""How many px beyond a thing are its own: cameras and codecs draw a halo."""


def sample(pixels: Array, centre: Array, step: float, cells: int | tuple[int, int]) -> Array:
    """Return means of `pixels` (h, w) over squares of `step` px around `centre` (2,), bilinear; as many as `cells`."""
    rows, columns = (cells, cells) if isinstance(cells, int) else cells
    down, across = (_along(float(centre[i]), step, n, pixels.shape[1 - i]) for i, n in ((1, rows), (0, columns)))
    block = pixels[down[0][0] : down[0][-1] + 2, across[0][0] : across[0][-1] + 2].astype(float)
    return _means(_means(block, *down, rows).T, *across, columns).T


def _along(centre: float, step: float, cells: int, size: int) -> tuple[Indices, Array]:
    """Return of each place along an axis of `size` pixels the one below (n,), and how far beyond it; the edge beyond it."""
    fine = int(np.ceil(step))
    at = centre + (np.arange(cells * fine) - 0.5 * (cells * fine - 1)) * (step / fine)
    at = np.minimum(np.maximum(at, 0.0), size - 1.0)
    below = np.minimum(at.astype(np.intp), size - 2)
    return below, at - below


def _means(block: Array, below: Indices, part: Array, cells: int) -> Array:
    """Return the means (cells, w) of rows of a `block` (h, w), between its row `below` less the first and the next one."""
    row, share = (below - below[0]).reshape(cells, -1).T, part.reshape(cells, -1).T[..., None]
    means = np.zeros((cells, block.shape[1]))
    for one, beyond in zip(row, share, strict=True):
        found, more = block.take(one, axis=0), block.take(one + 1, axis=0)
        more -= found
        more *= beyond
        means += found
        means += more
    return means / len(row)


def isolated(image: Array, width: float) -> Array:
    """Return `image` (n, n) less its grey opening: what is brighter than around it and narrower than `width` cells."""
    near, opened = int(np.ceil(0.5 * width)), image
    for extreme in (np.minimum, np.maximum):
        opened = _within(extreme, _within(extreme, opened, near).T, near).T
    return image - opened


def _within(extreme: np.ufunc, image: Array, near: int) -> Array:
    """Return the least, or largest, of each place of an image (n, m) and those `near` rows above and below, by halves."""
    edge = np.full((near, image.shape[1]), np.inf if extreme is np.minimum else -np.inf)
    found, rows = np.concatenate([edge, image, edge]), 1
    while 2 * rows <= 2 * near + 1:
        found, rows = extreme(found[:-rows], found[rows:]), 2 * rows
    beyond: Array = extreme(found[: len(image)], found[-len(image) :])
    return beyond


def without_large(image: Array, bright: float, longest: float, within: float) -> Array:
    """Return `image` (n, m) with 0 in each part that is brighter than `bright` and longer than `longest` cells.

    That is so in the `HALO` cells around such a part, too, but no more than `within` cells from the image's middle.
    """
    if image.max() <= bright:
        return image
    with one_thread() as cv2:
        _, labels, boxes, _ = cv2.connectedComponentsWithStats((image > bright).view(np.uint8), connectivity=4)
        long = boxes[:, 2:4].max(axis=1) > longest
        long[0] = False  # what is not bright
        if not long.any():
            return image
        large = cv2.dilate(long[labels].view(np.uint8), np.ones((2 * HALO + 1, 2 * HALO + 1), np.uint8)) > 0
    near = [np.abs(np.arange(side) - 0.5 * (side - 1)) <= within for side in image.shape]
    return np.where(large & near[0][:, None] & near[1], 0.0, image)


def centroid(image: Array) -> Array:
    """Return x and y of the centroid of `image` (n, n) >= 0, in cells from its middle; 0 if it is 0 everywhere."""
    steps, total = np.arange(len(image)) - 0.5 * (len(image) - 1), image.sum()
    if total <= 0:
        return np.zeros(2)
    return np.array([float(image.sum(axis=0) @ steps), float(image.sum(axis=1) @ steps)]) / float(total)


def blurred(image: Array) -> Array:
    """Return `image` (n, m) smoothed by [1 2 1]/4 along both axes, which reduces the noise of single pixels."""
    smooth = np.array([0.25, 0.5, 0.25])
    with one_thread() as cv2:
        made: Array = cv2.sepFilter2D(image, -1, smooth, smooth, borderType=cv2.BORDER_REPLICATE)
    return made


def median(values: Array) -> float:
    """Return the median of some values, of any shape: numpy's own takes longer than all else that is done with them here."""
    low, high = (values.size - 1) // 2, values.size // 2
    ordered = np.partition(values, (low, high), axis=None)
    return 0.5 * (float(ordered[low]) + float(ordered[high]))


def bend(image: Array) -> float:
    """Return how strongly noise bends an image (h, w) along both axes, by the median: most of a scene bends less.

    That is 6 standard deviations of white noise, and one of noise smoothed by `blurred`.
    """
    down = image[:-2:4] - 2.0 * image[1:-1:4] + image[2::4]
    both = np.abs(down[:, :-2:2] - 2.0 * down[:, 1:-1:2] + down[:, 2::2])
    return median(both) / 0.6745 if both.size else 0.0


def kept(image: Array, amplitude: float) -> Array:
    """Return contrast of the target's sign as a fraction of its amplitude, both beyond the noise, from 0 to `BRIGHTEST`.

    What is no more than noise is none of the target (Donoho, De-noising by soft-thresholding, IEEE T-IT 41, 1995): a codec
    repeats it where it was.
    """
    sign, most = float(np.sign(amplitude)), abs(amplitude)
    noise = min(bend(image), NOISY * most)
    limited: Array = np.clip((sign * image - noise) / (most - noise), 0.0, BRIGHTEST)
    return limited


def mask_of(box: Array, cells: int) -> Array:
    """Return weights (cells, cells): near 1 inside a box of (width, height) cells, .37 at its sides, 0 outside."""
    steps = 2.0 * (np.arange(cells) - 0.5 * (cells - 1))
    weight: Array = np.exp(-((steps / box[0]) ** 4))[None, :] * np.exp(-((steps / box[1]) ** 4))[:, None]
    return weight


def contrast(image: Array, box: Array) -> float:
    """Return the largest value of `image` (n, n) near its centre: the amplitude of a hot target of `box` (2,) cells."""
    steps = np.arange(len(image)) - 0.5 * (len(image) - 1)
    near = np.exp(-0.5 * (steps / (0.25 * box[0])) ** 2)[None, :] * np.exp(-0.5 * (steps / (0.25 * box[1])) ** 2)[:, None]
    return float(image.ravel()[np.argmax(image * near)])


def alike(one: Array, other: Array, mask: Array) -> float:
    """Return 2 cov / (var + var) of two patches (p, p), weighted by a mask: 0 of two that show nothing.

    It is the correlation coefficient times 2 a b / (a^2 + b^2), a and b their contrasts.
    """
    weights, a, b = (each.ravel() for each in (mask, one, other))
    total = weights.sum()
    a, b = a - (weights @ a) / total, b - (weights @ b) / total
    weighed = weights * a
    return 2.0 * float(weighed @ b) / max(float(weighed @ a + (weights * b) @ b), 1e-12)


def similarity(image: Array, patches: Array, mask: Array) -> Array:
    """Return how `alike` patches (k, p, p) and each place of `image` (n, m) are, weighted by a mask (p, p).

    Its shape is (k, n - p + 1, m - p + 1).
    """
    count, (rows, columns) = mask.sum(), (side - len(mask) + 1 for side in image.shape)
    kernels = mask * (patches - (mask * patches).sum(axis=(-1, -2), keepdims=True) / count)
    with one_thread() as cv2:
        size = tuple(cv2.getOptimalDFTSize(side) for side in image.shape)

        def spectrum(part: Array) -> Array:
            padded = np.zeros(size)
            padded[: part.shape[0], : part.shape[1]] = part
            return np.asarray(cv2.dft(padded, padded, nonzeroRows=len(part)))

        def sums(of: Array, weights: Array) -> Array:
            both = cv2.mulSpectrums(of, weights, 0, conjB=True)
            inverse = cv2.DFT_INVERSE | cv2.DFT_SCALE | cv2.DFT_REAL_OUTPUT
            return np.asarray(cv2.dft(both, both, flags=inverse, nonzeroRows=rows)[:rows, :columns])

        seen, weights = spectrum(image), spectrum(mask)
        total = sums(seen, weights)
        energy = np.maximum(sums(spectrum(image * image), weights) - total * total / count, 0.0)
        product = np.stack([sums(seen, spectrum(kernel)) for kernel in kernels])
    energy_of_patch = (kernels * patches).sum(axis=(-1, -2), keepdims=True)
    found: Array = 2.0 * product / np.maximum(energy + energy_of_patch, 1e-12)
    return found.clip(-1.0, 1.0)


def peak(score: Array) -> tuple[int, int, Array]:
    """Return row and column of the largest of `score` (h, w), and the offset, x and y, of a parabola's vertex from there."""
    j, i = (int(k) for k in np.unravel_index(np.argmax(score), score.shape))
    off = np.zeros(2)
    if 0 < i < score.shape[1] - 1 and 0 < j < score.shape[0] - 1:
        for k, (a, b, c) in enumerate(
            ((score[j, i - 1], score[j, i], score[j, i + 1]), (score[j - 1, i], score[j, i], score[j + 1, i]))
        ):
            bend = a - 2.0 * b + c
            off[k] = 0.0 if bend > -1e-9 else np.clip(0.5 * (a - c) / bend, -0.5, 0.5)
    return j, i, off


def clearest(change: Array, errs: Array, size: float, polarity: float = 0.0) -> Array:
    """Return the places (k, 2) of what is new in a change (h, w) of an image, the clearest first, as column and row.

    It is compared with how much all around changed, and with what an error of a place makes of it at each cell: `errs`. A
    thing has so many cells in `size`; `polarity` 1: one that became brighter, -1: darker, 0: either.
    """
    seen = np.isfinite(change)
    if not seen.any():
        return np.zeros((0, 2))
    change = np.where(seen, change - np.median(change[seen]), 0.0)
    spread = np.median(np.abs(change[seen])) / 0.6745 + 1.0
    weight = seen / (spread**2 + errs**2)
    wide = max(0.2 * size, 0.7)
    with one_thread() as cv2:
        mean, sure = (cv2.GaussianBlur(each, (0, 0), wide) for each in (change * weight, weight))
        clear = (polarity * mean if polarity else np.abs(mean)) / np.sqrt(sure + 1e-12) * np.sqrt(4.0 * np.pi) * wide
        most = cv2.dilate(clear, np.ones((2 * int(np.ceil(wide)) + 1,) * 2, np.uint8))
    at = np.argwhere((clear == most) & (clear > NEWLY))
    return at[np.argsort(-clear[tuple(at.T)], kind="stable"), ::-1].astype(float)
