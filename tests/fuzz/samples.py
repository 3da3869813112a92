"""Small good inputs, as the bytes of their files."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Callable
from functools import cache

import numpy as np

Files = dict[str, bytes]

TRACK = (
    '{"track": 1, "time": 2.5, "mean": [10, 20], "cov": [[4, 0], [0, 4]], "confirmed": true, '
    '"existence": 0.98, "hit": 0.9, "nis": null, "weights": [0.1, 0.9], "mode_prob": [0.5, 0.5]}'
)
SENTENCES = """1 !AIVDM,1,1,,A,33P;Tw0tjBQO22:E7dm66DrB20UP,0*2E
# a comment
2.5 !AIVDM,1,1,,A,33P;Tw0tjBQO22:E7dm66DrB20UP,0*2E
3 !AIVDM,1,1,,A,33P;Tw0tjBQO22:E7dm66DrB20UP,0*2E
"""


def png(pixels: np.ndarray) -> bytes:  # type: ignore[type-arg]
    """Return a grey picture as a PNG."""

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    rows = b"".join(b"\0" + row.tobytes() for row in pixels.astype(np.uint8))
    head = struct.pack(">IIBBBBB", pixels.shape[1], pixels.shape[0], 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def csv_files() -> Files:
    """Return returns, truth and own ship's places."""
    rows = [f"{i // 2},{i},{2 * i},radar,{i // 2}" for i in range(8)] + ["4,,,radar,4", "4,1,1,sonar,4"]
    truth = [f"{i},{i},{i},{'ab'[i % 2]}" for i in range(6)]
    own = [f"{i},0,{i},0.1" for i in range(6)]
    tables = {"d.csv": ["t,x,y,s,n", *rows], "truth.csv": ["t,x,y,o", *truth], "own.csv": ["t,x,y,h", *own]}
    return {name: ("\n".join(lines) + "\n").encode() for name, lines in tables.items()}


def autoferry() -> Files:
    """Return a scenario of the benchmark."""
    looks = [[], [1.0, 2.0], [[1.0, 2.0], [3.0, 4.0]], [[5.0], [6.0]]]
    entries = [
        {"sensorID": 2 - (i == 3), "time": float(i), "ownshipPosition": [0.0, float(i)], "measurement": looks[i % 4]}
        for i in range(6)
    ]
    boats = [[{"targetID": j, "time": float(i), "position": [i, j, 0.0]} for j in (10, 20)] for i in range(4)]
    return {
        "scenario1_detections.json": json.dumps(entries).encode(),
        "scenario1_groundTruth.json": json.dumps(boats).encode(),
    }


def jsonl() -> Files:
    """Return a recording in Vedette's own lines."""
    xy = {"x": "m", "y": "m"}
    lines: list[object] = [
        {"format": "vedette", "version": 1, "sensors": {"radar": xy, "sonar": xy}, "truth": {"a": xy}, "notes": {"b": "c"}}
    ]
    lines += [{"truth": "a", "time": float(i), "state": [1.0, i]} for i in range(3)]
    pose = {"position": [0.0, 0.0], "velocity": [1.0, 0.0], "heading": 0.1}
    for i in range(4):
        lines.append({"time": float(i), "sensor": "radar", "z": [[1.0, i]] * i, "noise": [[[1.0, 0.0], [0.0, 1.0]]] * i})
        lines.append({"time": float(i), "sensor": "sonar", "z": [[1.0, 2.0]], "evidence": [0.5], "pose": pose})
    return {"r.jsonl": "\n".join(map(json.dumps, lines)).encode() + b"\n"}


def tracks() -> Files:
    """Return tracks in lines."""
    header = '{"format": "vedette tracks", "version": 1, "axes": {"x": "m", "y": "m"}}'
    return {"t.jsonl": "\n".join([header, TRACK, TRACK.replace("2.5", "3.5"), TRACK.replace("1,", "2,", 1)]).encode()}


def ais_csv() -> Files:
    """Return AIS reports in a table."""
    rows = [f"{i},{235070716 + i % 2},50.8,-1.3,{90 + i},10,{i},{5 * i}" for i in range(5)]
    rows.append("2016-01-12 13:02:11.218,235070716,50.8,-1.3,,,,")
    header = "Time,MMSI,Latitude_degrees,Longitude_degrees,COG_degrees,SOG_knots,Heading_degrees,ROT"
    return {"ais.csv": ("\n".join([header, *rows]) + "\n").encode()}


def nmea() -> Files:
    """Return AIS sentences."""
    return {"ais.txt": b"\n" + SENTENCES.encode()}


@cache
def _pictures() -> list[bytes]:
    rows, columns = np.mgrid[:12, :16]
    return [png(200.0 * np.exp(-0.5 * ((columns - 4 - i) ** 2 + (rows - 6) ** 2))) for i in range(4)]


def radar_pictures() -> Files:
    """Return a folder of radar pictures with its tables."""
    geometry = {
        "metres_per_pixel": 6.0,
        "centre": [8, 6],
        "width": 16,
        "height": 12,
        "range": 50.0,
        "latitude": 50.8,
        "longitude": -1.3,
        "overlays": [[0, 0, 2, 1]],
        "colours": [[0, 0, 0], [0, 255, 0]],
        "land": "land.png",
    }
    frames = [f"{i}.png,{i},0.1,0,0,1,0" for i in range(4)]
    truth = [f"boat,{i},{i},0,1,0" for i in range(4)]
    return {
        "geometry.json": json.dumps(geometry).encode(),
        "frames.csv": "\n".join(["file,time_s,heading_rad,east_m,north_m,east_mps,north_mps", *frames]).encode(),
        "truth.csv": "\n".join(["object,time_s,east_m,north_m,east_mps,north_mps", *truth]).encode(),
        **ais_csv(),
        "land.png": png(np.zeros((12, 16))),
        **{f"{i}.png": picture for i, picture in enumerate(_pictures())},
    }


def clip() -> Files:
    """Return a folder of images with its boxes and segments."""
    boxes = "frame,x,y,w,h\n0,4,5,3,3\n1,5,5,3,3\n2,,,,\n3,7,5,3,3\n"
    return {
        "clip_truth.csv": boxes.encode(),
        "segments.csv": b"clip,label_offset,start,end_excl\nclip,0,0,4\n",
        **{f"clip/{i}.png": picture for i, picture in enumerate(_pictures())},
    }


def quiet() -> Files:
    """Return a recording of a sea with two returns."""
    return {"d.csv": b"t,x,y\n0,,\n1,5,5\n2,,\n3,6,6\n4,,\n"}


FILES: dict[str, Callable[[], Files]] = {
    "csv": csv_files,
    "autoferry": autoferry,
    "jsonl": jsonl,
    "tracks": tracks,
    "ais_csv": ais_csv,
    "nmea": nmea,
    "radar_pictures": radar_pictures,
    "video": clip,
    "run": quiet,
}
