"""A folder of radar pictures."""

import math

import numpy as np
import pytest

from support.radar_pictures import FRAMES, GEOMETRY, SIZE, SPEED, START
from vedette_marine.geometry import write_geometry


@pytest.fixture
def folder(tmp_path):
    """Twelve pictures of one boat, the sixth of which was lost, with its truth and its AIS."""
    from pymap3d import enu2geodetic

    cv2 = pytest.importorskip("cv2")
    rows, columns = np.mgrid[:SIZE, :SIZE]
    frames, truth, ais = ["file,time_s,heading_rad"], ["object,time_s,east_m,north_m,east_mps,north_mps"], []
    for k in range(FRAMES):
        place = START + SPEED * k
        latitude, longitude, _ = enu2geodetic(*place, 0.0, 54.0, 12.0, 0.0)
        course, knots = math.degrees(math.atan2(*SPEED)) % 360, np.hypot(*SPEED) / 0.514444
        ais.append(f"{k},211000001,{latitude},{longitude},{course},{knots}")
        truth.append(f"boat,{k},{place[0]},{place[1]},{SPEED[0]},{SPEED[1]}")
        if k == 5:
            continue
        x, y = GEOMETRY.to_pixels(place)
        grey = 230 * np.exp(-0.5 * ((columns - x) ** 2 + (rows - y) ** 2) / 2.0**2)
        cv2.imwrite(str(tmp_path / f"{k:03}.png"), grey.astype(np.uint8))
        frames.append(f"{k:03}.png,{k},0.3")
    (tmp_path / "frames.csv").write_text("\n".join(frames) + "\n")
    (tmp_path / "truth.csv").write_text("\n".join(truth) + "\n")
    header = "Time,MMSI,Latitude_degrees,Longitude_degrees,COG_degrees,SOG_knots"
    (tmp_path / "ais.csv").write_text("\n".join([header, *ais]) + "\n")
    write_geometry(tmp_path, GEOMETRY)
    return tmp_path
