"""Spots: one alone, and grey pictures of them."""

import numpy as np

SIZE = 400


def gaussian(x, y, at, spread):
    """Return a spot of peak 1 at a place, of a spread along x and y; over axes of a grid it is drawn ten times as fast."""
    return np.exp(-0.5 * ((x - at[0]) / spread[0]) ** 2) * np.exp(-0.5 * ((y - at[1]) / spread[1]) ** 2)


def picture(spots, colours=None, size=SIZE, noise=15.0):
    """Grey (h, w), or in colours (h, w, 3), with a bright spot of 15 x 10 m at each place in px, over dim speckle."""
    rows, columns = np.ogrid[:size, :size]
    grey = np.random.default_rng(0).exponential(noise, (size, size)).clip(0, 80)
    for at in spots:
        grey += 220 * gaussian(columns, rows, at, (3.0, 2.0))
    grey = grey.clip(0, 255).astype(np.uint8)
    if colours is None:
        return grey
    line = np.stack([np.interp(np.linspace(0, 2, 256), range(3), c) for c in colours.T], axis=-1)[:, ::-1]
    return line.astype(np.uint8)[grey]
