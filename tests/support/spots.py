"""Grey pictures of round spots."""

import numpy as np

SIZE = 400


def picture(spots, colours=None, size=SIZE, noise=15.0):
    """Grey (h, w), or in colours (h, w, 3), with a bright spot of 15 x 10 m at each place in px, over dim speckle."""
    rows, columns = np.mgrid[:size, :size]
    grey = np.random.default_rng(0).exponential(noise, (size, size)).clip(0, 80)
    for x, y in spots:
        grey += 220 * np.exp(-0.5 * ((columns - x) / 3.0) ** 2 - 0.5 * ((rows - y) / 2.0) ** 2)
    grey = grey.clip(0, 255).astype(np.uint8)
    if colours is None:
        return grey
    line = np.stack([np.interp(np.linspace(0, 2, 256), range(3), c) for c in colours.T], axis=-1)[:, ::-1]
    return line.astype(np.uint8)[grey]
