"""The picture chain of vedette_marine: detection and false alarms against contrast, and its time stage by stage.

    python benchmarks/marine_chain.py [PICTURES]      PICTURES: of each contrast, 100 by default

Beside it scikit-image's blob_doh on the same echoes and with the same grouping, where it is installed. Pictures are
simulated, 6 m a pixel: one boat of 29 x 7 m at 1.6 km that turns slowly, so that all aspects are seen, in K-distributed sea
clutter; of 680 x 680 px for the detection probability, of 1,024 x 1,024 px for the times. CPU time of one thread.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib.util import find_spec
from time import process_time
from typing import Any

import numpy as np

import vedette
from vedette_marine import configs, scenes
from vedette_marine.opencv import opencv
from vedette_marine.picture.artefacts import rain, spokes
from vedette_marine.picture.blobs import find_blobs
from vedette_marine.picture.chain import Chain, blind, right_ahead
from vedette_marine.picture.colours import palette
from vedette_marine.preprocessors.radar_picture import RadarPicture
from vedette_marine.screen import RadarScreen
from vedette_sim import PpiRadar
from vedette_standard import grouped

CROSS_SECTIONS = (3.0, 10.0, 30.0, 100.0, 300.0)
"""m^2, broadside."""

HIT, AWAY = 40.0, 120.0
"""In m: a return nearer than the first is the boat's, one farther than the second is a false alarm."""

SMALL = 680
"""Side in px of the pictures in which detections are counted."""

NEAREST = 400.0
"""Distance in m around the radar that is left out."""


def pictures(cross_section: float, count: int, seed: int, size: int = 1024) -> Any:
    """Return a recording of one boat at 1.6 km that turns once; pictures are 7 s apart, in which the sea decorrelates."""
    scene = scenes.manoeuvres()
    scene["radar"] |= {"size": size, "range": min(2778.0, 3.0 * size - 40.0)}
    turn = {"do": "turn", "seconds": 7.0 * count, "rate": f"{360.0 / (7.0 * count)} deg/s"}
    boat = {
        "path": {"start": [300.0, 1550.0], "course": "5 deg", "speed": 0.5, "legs": [turn]},
        "length": 29.0,
        "width": 7.0,
        "cross_section": cross_section,
    }
    preprocessor = {"kind": "radar_picture", "sensors": {"screen": {"kind": "radar_screen"}}}
    source = scene | {"vessels": {"boat": boat}, "frames": count, "lost": 0, "interval": 7.0, "buoys": []}
    config = configs.tracker(configs.TABLE_6["CV-PDAF"], 6.0) | {"source": source, "preprocessors": {"radar": preprocessor}}
    opened: Any = vedette.load(config).source
    return opened.open({"screen": RadarScreen()}, np.random.default_rng(seed))


def doh(image: Any) -> np.ndarray:
    """Return columns and rows (k, 2) of scikit-image's blobs."""
    from skimage.feature import blob_doh

    found = blob_doh(image, min_sigma=1.5, max_sigma=6.0, num_sigma=5, threshold=0.005)
    return np.asarray(found)[:, 1::-1]


def middles(at: np.ndarray, scale: float, chain: Chain) -> np.ndarray:
    """Return the centres of groups of blobs, all of the same weight."""
    labels = grouped(at * scale, np.ones(len(at)), chain.link, chain.longest)
    k = int(labels.max(initial=-1)) + 1
    mass = np.bincount(labels, minlength=k)
    return np.stack([np.bincount(labels, axis, k) / mass for axis in at.T], axis=-1) if k else np.zeros((0, 2))


def contrast(count: int) -> None:
    """Print detection probability, false alarms and error against the boat's cross-section, each with a standard error."""
    chains = {
        "threshold 90": Chain(nearest=NEAREST, longest=60.0),
        "threshold 130": Chain(nearest=NEAREST, longest=60.0, threshold=130.0),
        "exact": Chain(nearest=NEAREST, longest=60.0, derivatives="exact"),
    }
    print(f"{'m^2':>6} {'SNR dB':>7}  {'method':14} {'P_D':>13} {'false/km^2':>15} {'error m':>8}")
    for cross_section in CROSS_SECTIONS:
        recording = pictures(cross_section, count, 1, SMALL)
        tally: dict[str, list[tuple[bool, int, float]]] = {}
        for scan in recording.scans:
            truth = recording.truth[0].at(scan.time)[:2]
            for name, chain in chains.items():
                preprocessor = RadarPicture({"screen": RadarScreen()}, chain=chain)
                geometry, stages = preprocessor.geometry_of(scan.frame), preprocessor.stages(scan.frame, scan.pose)
                found = {name: geometry.from_antenna(stages.groups.at)}
                if name == "threshold 90" and find_spec("skimage"):
                    spots = middles(doh(stages.left / 255.0), geometry.metres_per_pixel, chain)
                    found["blob_doh"] = geometry.from_antenna(spots)
                for method, z in found.items():
                    off = np.linalg.norm(z - truth, axis=-1)
                    near = float(off.min()) if len(off) else np.inf
                    tally.setdefault(method, []).append((near < HIT, int(np.sum(off > AWAY)), near))
        area = np.pi * (geometry.range**2 - NEAREST**2) / 1e6
        snr = 10 * np.log10(PpiRadar(6.0, 2000.0).strength(np.array(1600.0)) * cross_section)
        for method, rows in tally.items():
            seen = [row[2] for row in rows if row[0]]
            rate, error = np.mean([row[0] for row in rows]), np.sqrt(np.mean(np.square(seen))) if seen else np.nan
            binomial = np.sqrt(rate * (1 - rate) / count)
            false = np.array([row[1] for row in rows]) / area
            figures = f"{rate:6.3f} +- {binomial:.3f} {false.mean():7.4f} +- {np.std(false) / np.sqrt(count - 1):.4f}"
            print(f"{cross_section:6g} {snr:7.1f}  {method:14} {figures} {error:8.1f}", flush=True)


def milliseconds(call: Callable[[], Any]) -> float:
    """Return the median of a call's CPU time."""
    took = []
    for _ in range(20):
        before = process_time()
        call()
        took.append(process_time() - before)
    return 1e3 * float(np.median(took))


def stages() -> None:
    """Print the milliseconds of each stage, and of the whole preprocessor."""
    scan = pictures(100.0, 2, 2).scans[1]
    preprocessor, chain = RadarPicture({"screen": RadarScreen()}), Chain()
    geometry, seen = preprocessor.geometry_of(scan.frame), preprocessor.stages(scan.frame, scan.pose)
    picture = np.ascontiguousarray(np.moveaxis(scan.frame.pixels, 0, -1))
    colours = palette(tuple(map(tuple, geometry.colours.tolist())), chain.tolerance)
    above, image = seen.echoes > 0, seen.left.astype(np.float32) / 255
    scales = chain.scales.tolist()
    rows: dict[str, Callable[[], Any]] = {
        "colours to grey, interface removed": lambda: colours.grey(picture),
        "what is hidden, threshold": lambda: np.where(blind(geometry, 100.0) | (seen.grey < 90), 0, seen.grey),
        "spokes": lambda: spokes(above, right_ahead(geometry), chain.spoke_width, chain.spoke_length, 300.0),
        "rain": lambda: rain(above.astype(np.uint8), 100, chain.rain_share),
        "blobs, masks": lambda: find_blobs(image, scales, chain.strength),
        "blobs, exact": lambda: find_blobs(image, scales, chain.strength, exact=True),
        "groups": lambda: grouped(seen.blobs.at * 6.0, seen.blobs.strength, chain.link, chain.longest),
        "whole preprocessor": lambda: preprocessor.process({"screen": scan}),
    }
    if find_spec("skimage"):
        rows["scikit-image blob_doh"] = lambda: doh(image)
    print(f"\n{'stage':36} ms a picture of 1,024 x 1,024")
    for name, call in rows.items():
        print(f"{name:36} {milliseconds(call):6.1f}")


if __name__ == "__main__":
    opencv().setNumThreads(1)
    contrast(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
    stages()
