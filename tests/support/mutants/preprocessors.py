"""Preprocessors with one thing wrong."""

import numpy as np
from attrs import evolve

from vedette import Detections
from vedette_standard.preprocessors.unbiased_conversion import UnbiasedConversion

UC = UnbiasedConversion


def all_valid(scans):
    return {name: evolve(scan, detections=Detections.of(scan.detections.z)) for name, scan in scans.items()}


def turned_over(scans):
    """Each return's own noise with its correlations of the other sign."""
    signs = 2.0 * np.eye(2) - 1.0
    own = {name: scan.detections.noise for name, scan in scans.items()}
    return {
        name: evolve(scan, detections=evolve(scan.detections, noise=None if own[name] is None else own[name] * signs))
        for name, scan in scans.items()
    }


def overwrites(self, scans):
    for scan in scans.values():
        scan.detections.z[...] = 0.0
    return UC.process(self, scans)


def remade(change):
    return {"process": lambda s, scans: change(UC.process(s, scans))}


DETECTORS = [
    ("noise not definite", UC, "noise_is_positive_definite",
     remade(lambda d: Detections(d.z, d.valid, d.evidence, d.noise * np.array([[1.0, 0.0], [0.0, 0.0]])))),
    ("correlations of the other sign", UC, "sharper_returns_make_sharper_ones",
     {"process": lambda s, scans: UC.process(s, turned_over(scans))}),
    ("padding read", UC, "padding_changes_nothing", {"process": lambda s, scans: UC.process(s, all_valid(scans))}),
    ("returns that are no numbers", UC, "makes_finite_returns",
     remade(lambda d: Detections(d.z / np.where(d.valid, 1.0, 1.0)[..., None] * np.nan, d.valid, d.evidence, d.noise))),
    ("writes into the scan", UC, "pure", {"process": overwrites}),
    ("a return out of nothing", UC, "nothing_comes_of_nothing",
     {"process": lambda s, scans: UC.process(s, scans) if any(len(x.detections.z) for x in scans.values())
      else Detections.of([[1.0, 2.0]])}),
]  # fmt: skip
