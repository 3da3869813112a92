"""Patches of a frame on a grid that fits the target's box, and the search for a patch in a frame. One target each."""

from __future__ import annotations

import numpy as np

from vedette import Array


def sample(pixels: Array, centre: Array, step: float, cells: int) -> Array:
    """Return (cells, cells) means of `pixels` (h, w) over squares of `step` px around `centre` (2,), bilinear."""
    fine = int(np.ceil(step))
    offsets = (np.arange(cells * fine) - 0.5 * (cells * fine - 1)) * (step / fine)
    rows, columns = (_weights(centre[i] + offsets, pixels.shape[1 - i]) for i in (1, 0))
    (i, a), (j, b) = rows, columns
    block = pixels[i.min() : i.max() + 2, j.min() : j.max() + 2].astype(float)
    i, j = i - i.min(), j - j.min()
    a, b = a[:, None], b[None, :]
    across = block[:, j] * (1.0 - b) + block[:, j + 1] * b
    found = across[i] * (1.0 - a) + across[i + 1] * a
    means: Array = found.reshape(cells, fine, cells, fine).mean(axis=(1, 3))
    return means


def _weights(at: Array, size: int) -> tuple[np.ndarray[tuple[int], np.dtype[np.intp]], Array]:
    """Return the pixel below each coordinate, at most the last but one, and the fraction towards the next."""
    inside = np.clip(at, 0.0, size - 1.0)
    below = np.minimum(np.floor(inside).astype(np.intp), size - 2)
    return below, inside - below


def isolated(image: Array, width: float) -> Array:
    """Return `image` (n, n) less its grey opening: what is brighter than around it and narrower than `width` cells."""
    from scipy.ndimage import grey_opening

    size = 2 * int(np.ceil(0.5 * width)) + 1
    found: Array = image - grey_opening(image, (size, size))
    return found


def centroid(image: Array) -> Array:
    """Return x and y of the centroid of `image` (n, n) >= 0, in cells from its middle; 0 if it is 0 everywhere."""
    steps, total = np.arange(len(image)) - 0.5 * (len(image) - 1), image.sum()
    if total <= 0:
        return np.zeros(2)
    return np.array([float(image.sum(axis=0) @ steps), float(image.sum(axis=1) @ steps)]) / float(total)


def blurred(image: Array) -> Array:
    """Return `image` (n, n) smoothed by [1 2 1]/4 along both axes, which reduces the noise of single pixels."""
    for axis in (0, 1):
        near = np.pad(image, [(1, 1) if i == axis else (0, 0) for i in (0, 1)], mode="edge")
        image = 0.5 * image + 0.25 * (np.delete(near, [-1, -2], axis) + np.delete(near, [0, 1], axis))
    return image


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


def similarity(image: Array, patch: Array, mask: Array) -> Array:
    """Return 2 cov / (var + var) of `patch` (p, p) and each place of `image` (n, n), weighted by `mask`: (n-p+1, n-p+1).

    It is the correlation coefficient times 2 a b / (a^2 + b^2), a and b the contrasts of patch and place.
    """
    n, p = len(image), len(patch)
    count = mask.sum()
    kernel = mask * (patch - (mask * patch).sum() / count)
    spectrum = np.fft.rfft2(np.stack([kernel, mask]), (n, n)).conj()
    seen = np.fft.rfft2(np.stack([image, image * image]))
    product, total, square = np.fft.irfft2(
        np.stack([spectrum[0] * seen[0], spectrum[1] * seen[0], spectrum[1] * seen[1]]), (n, n)
    )
    part = slice(0, n - p + 1)
    product, total, square = product[part, part], total[part, part], square[part, part]
    energy = np.maximum(square - total * total / count, 0.0)
    found: Array = 2.0 * product / np.maximum(energy + float((kernel * patch).sum()), 1e-12)
    return found.clip(-1.0, 1.0)


def peak(score: Array) -> tuple[int, int, Array]:
    """Return row and column of the largest of `score` (q, q), and the offset, x and y, of a parabola's vertex from there."""
    j, i = (int(k) for k in np.unravel_index(np.argmax(score), score.shape))
    off = np.zeros(2)
    last = len(score) - 1
    if 0 < i < last and 0 < j < last:
        for k, (a, b, c) in enumerate(
            ((score[j, i - 1], score[j, i], score[j, i + 1]), (score[j - 1, i], score[j, i], score[j + 1, i]))
        ):
            bend = a - 2.0 * b + c
            off[k] = 0.0 if bend > -1e-9 else np.clip(0.5 * (a - c) / bend, -0.5, 0.5)
    return j, i, off
