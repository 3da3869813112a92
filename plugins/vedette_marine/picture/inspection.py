"""What the chain found: the stages of one picture on a sheet, and a run's pictures with returns and tracks as a video."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vedette import Array, Frame, Scan, Track
from vedette_marine.geometry import PictureGeometry, nautical
from vedette_marine.opencv import opencv
from vedette_marine.picture.chain import Stages
from vedette_marine.picture.colours import Bytes

if TYPE_CHECKING:
    from vedette import Result
    from vedette_marine.preprocessors.radar_picture import RadarPicture

SIDE, MOST = 768, 600
"""Side of a video in px, and its greatest number of pictures: a longer run shows every second or third."""

RETURN, TENTATIVE, TRUTH = (255, 255, 255), (160, 160, 160), (0, 200, 0)
COLOURS = ((80, 160, 255), (255, 160, 80), (200, 100, 255), (100, 255, 255), (255, 100, 200), (120, 255, 120))
"""Blue, green, red."""

TAIL = 60.0
"""Length in s of the track history that is drawn."""


def stage_pictures(stages: Stages) -> dict[str, Bytes]:
    """Return a picture (h, w, 3) of each stage, by its name, in their order."""
    cv2 = opencv()

    def grey(image: Any) -> Any:
        return cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)

    flagged = grey(stages.echoes)
    flagged[stages.beacon] = (0, 0, 255)
    flagged[stages.wet] = (255, 128, 0)
    blobs, grouped = grey(stages.left), grey(stages.left)
    for at, scale, label in zip(stages.blobs.at, stages.blobs.scale, stages.labels, strict=True):
        centre = _fixed(at)
        cv2.circle(blobs, centre, round(1.5 * scale * 16), (0, 255, 255), 1, cv2.LINE_AA, 4)
        cv2.circle(grouped, centre, round(1.5 * scale * 16), COLOURS[int(label) % len(COLOURS)], 1, cv2.LINE_AA, 4)
    for at in stages.groups.at:
        cv2.drawMarker(grouped, tuple(np.rint(at).astype(int).tolist()), RETURN, cv2.MARKER_CROSS, 15, 1)
    return {
        "1 grey": grey(stages.grey),
        "2 echoes": grey(stages.echoes),
        "3 beacons and rain": flagged,
        "4 blobs": blobs,
        "5 groups": grouped,
    }


def illustrate(detector: RadarPicture, folder: Path, result: Result) -> list[str]:
    """Write `tracks.mp4`, and `stages.png` of the picture in the middle of the run; return the names of the files."""
    cv2 = opencv()
    (name,) = detector.sensors
    scans = result.recording.scans
    done = result.scans[-1].time if result.scans else -np.inf
    chosen = range(0, len(scans), -(-len(scans) // MOST)) if len(scans) else range(0)
    rate = float(np.clip(len(chosen) / 40.0, 5.0, 25.0))
    made = {scan.time: scan for scan in result.scans}
    video: Any = None
    written: list[str] = []
    try:
        for i in chosen:
            scan = scans[i]
            if scan.time > done or scan.sensor != name or scan.frame is None or scan.time not in made:
                continue
            picture = annotated(detector.geometry_of(scan.frame), scan, made[scan.time], result)
            if video is None:
                video = cv2.VideoWriter(
                    str(folder / "tracks.mp4"), cv2.VideoWriter_fourcc(*"mp4v"), rate, picture.shape[1::-1]
                )
            video.write(picture)
            if not written and i >= len(scans) // 2:
                stages = detector.stages(scan.frame, scan.pose)
                longest = stages.groups.at[np.argmax(stages.groups.length)] if len(stages.groups.at) else None
                pictures = {"0 screen": coloured(scan.frame)} | stage_pictures(stages)
                cv2.imwrite(str(folder / "stages.png"), sheet(pictures, longest))
                written = ["stages.png"]
    finally:
        if video is not None:
            video.release()
    return [*(["tracks.mp4"] if video is not None else []), *written]


def sheet(pictures: dict[str, Bytes], focus: Array | None) -> Bytes:
    """Arrange six pictures (h, w, 3), three in a row, each under its name; magnify what is around `focus`, (2,) in px."""
    cv2 = opencv()
    named = []
    for name, picture in pictures.items():
        shown = picture.copy()
        if focus is not None:
            _magnify(shown, focus)
        scale = shown.shape[0] / 1024
        at, thick = (round(12 * scale), round(1012 * scale)), max(1, round(3 * scale))
        cv2.putText(shown, name, at, cv2.FONT_HERSHEY_SIMPLEX, 1.4 * scale, RETURN, thick, cv2.LINE_AA)
        shown[:2], shown[:, :2] = TENTATIVE, TENTATIVE
        named.append(shown)
    return np.concatenate([np.concatenate(named[:3], axis=1), np.concatenate(named[3:], axis=1)])


def _magnify(picture: Bytes, focus: Array) -> None:
    """Draw what is around `focus`, eight times as large, into the lower right corner."""
    cv2 = opencv()
    side = min(picture.shape[:2]) // 48
    if side < 4:
        return
    limits = np.array(picture.shape[1::-1]) - 2 * side
    x, y = np.clip(np.rint(focus).astype(int) - side, 0, limits).tolist()
    large = cv2.resize(picture[y : y + 2 * side, x : x + 2 * side], None, fx=8, fy=8, interpolation=cv2.INTER_NEAREST)
    cv2.rectangle(picture, (x, y), (x + 2 * side, y + 2 * side), TENTATIVE, 1)
    large[:2], large[:, :2] = TENTATIVE, TENTATIVE
    picture[-16 * side :, -16 * side :] = large


def annotated(geometry: PictureGeometry, scan: Scan, made: Scan, result: Result) -> Bytes:
    """Return one picture with its returns (circles), tracks (coloured, last minute) and true positions (green squares)."""
    cv2 = opencv()
    assert scan.frame is not None
    picture = coloured(scan.frame)
    heading = nautical(scan.pose)
    antenna = np.zeros(2) if scan.pose is None else scan.pose.position[:2]

    def spot(place: Array) -> Array:
        return geometry.to_pixels(place - antenna, heading)

    for at in spot(made.detections.z):
        cv2.circle(picture, _fixed(at), 8 * 16, RETURN, 1, cv2.LINE_AA, 4)
    for path in result.recording.truth:
        state = path.at(scan.time)
        if state is not None and {"x", "y"} <= set(path.space.names):
            at = np.rint(spot(state[[path.space.names.index(axis) for axis in "xy"]])).astype(int)
            cv2.rectangle(picture, tuple((at - 9).tolist()), tuple((at + 9).tolist()), TRUTH, 1)
    for track in result.tracks:
        _draw(picture, track, scan.time, spot)
    cv2.putText(
        picture, f"{scan.time:.1f} s", (10, picture.shape[0] - 12), cv2.FONT_HERSHEY_SIMPLEX, 0.7, RETURN, 1, cv2.LINE_AA
    )
    scale = SIDE / max(picture.shape[:2])
    return cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) if scale < 1 else picture


def coloured(frame: Frame) -> Bytes:
    """Convert (3, h, w) or (h, w) to a new picture (h, w, 3)."""
    pixels: Any = frame.pixels
    picture: Bytes = np.ascontiguousarray(
        np.moveaxis(pixels, 0, -1) if pixels.ndim == 3 else np.stack([pixels] * 3, axis=-1)
    )
    return picture.copy()


def _draw(picture: Bytes, track: Track, time: float, spot: Any) -> None:
    cv2 = opencv()
    lived = np.flatnonzero((track.times <= time) & (track.times > time - TAIL))
    if not len(lived) or time > track.times[-1] or not track.confirmed[lived[-1]]:
        return
    axes = [track.space.names.index(axis) for axis in "xy"]
    line = spot(track.mean[lived][:, axes])
    colour = COLOURS[track.id % len(COLOURS)]
    cv2.polylines(picture, [np.rint(line * 16).astype(np.int32)], False, colour, 2, cv2.LINE_AA, 4)
    at = np.rint(line[-1]).astype(int) + [12, -12]
    cv2.putText(picture, f"{track.id}", tuple(at.tolist()), cv2.FONT_HERSHEY_SIMPLEX, 0.6, colour, 2, cv2.LINE_AA)


def _fixed(at: Array) -> Sequence[int]:
    """Return column and row in sixteenths of a pixel."""
    return tuple(np.rint(np.asarray(at) * 16).astype(int).tolist())
