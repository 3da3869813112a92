"""Tables as recorders and spreadsheets write them: each is read as the plain one is, or refused with what would be right."""

import json
import math
import tomllib
from datetime import datetime, timedelta
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from jsonschema import Draft202012Validator

import vedette
from vedette.errors import ConfigError, InputError
from vedette_tools.drafting.config import draft_config
from vedette_tools.drafting.config import drafted as whole_draft
from vedette_tools.drafting.recognising import read_table
from vedette_tools.drafting.wishes import Wishes
from vedette_tools.json_schema import schema

RNG = np.random.default_rng(3)
LOOKS = [(2.0 * k, 3000.0 + 8.0 * k + RNG.normal(0, 5), 1000.0 - 3.0 * k + RNG.normal(0, 5)) for k in range(40)]


def table(titles, row, between=",", end="\n", looks=LOOKS):
    return end.join([titles, *(between.join(map(str, row(*look))) for look in looks)]) + end


def plain(time, x, y):
    return time, round(x, 2), round(y, 2)


def polar(of_range, of_bearing):
    return lambda time, x, y: (time, round(math.hypot(x, y) * of_range, 5), round(math.atan2(y, x) * of_bearing, 5))


def clock(time, x, y):
    return (
        f"2026-05-12,{(86_380 + time) // 3600 % 24:02.0f}:{(86_380 + time) // 60 % 60:02.0f}:{(86_380 + time) % 60:02.0f}",
        x,
        y,
    )


def asterix(time, x, y):
    time, rho, theta = polar(1, 180 / math.pi)(time, x, y)
    return time, 25, 10, rho / 1852, theta


PLAIN = table("time,x,y", plain)
READ = {
    "blanks between columns": table("time x y", plain, " "),
    "blanks between columns, aligned": table("#  time      x      y", lambda *look: (f"{cell:12.2f}" for cell in look), " "),
    "tabs between columns, blanks between titles": "# 0.5 fps\n" + table("# time x y", plain, "\t"),
    "a date in columns": table(
        "year,month,day,hour,minute,second,x,y",
        lambda time, x, y: (2026, 5, 12, 8, 30 + int(time // 60), f"{time % 60:.1f}", x, y),
    ),
    "points of WKT": table("t,geom", lambda time, x, y: (time, f"POINT ({x:.2f} {y:.2f})")),
    "German titles": table(
        "Zeitpunkt [s];Entfernung [km];Peilung [gon]",
        lambda *look: (str(cell).replace(".", ",") for cell in polar(1e-3, 200 / math.pi)(*look)),
        ";",
    ),
    "German titles and degrees": table("Zeit;Entfernung (m);Azimut (Grad)", polar(1, 180 / math.pi), ";"),
    "French titles": table("temps,distance,azimut (deg)", polar(1, 180 / math.pi)),
    "units in brackets, in the row below": table("t,x,y\n(s),(km),(km)", lambda time, x, y: (time, x / 1000, y / 1000)),
    "Latin-1": table("Zeit (µs),x,y", lambda time, x, y: (int(1e6 * time), x, y)).encode("latin-1"),
    "UTF-16, as Excel's Unicode text": PLAIN.replace(",", "\t").encode("utf-16"),
    "comments above the header": f"# radar 3\n# 12 May, rain\n\n{PLAIN}",
    "words above the header": f"Radar log, of 12 May\nOperator: Smith\nTurn: 2.0\n\n{PLAIN}",
    "words above the header, as Excel fills up each row": f"Instrument,radar,\nTurn,2.0,\n,,\n{PLAIN}",
    "words above blanks between columns": "Radar 3\n% of twelve May\n" + table("time x y", plain, " "),
    "words in 150 lines above the header": "one, two\n" * 150 + PLAIN,
    "titles in two lines": table("time,position,\n,x,y", plain),
    "titles in four lines, of which one tells nothing": "by,A,A,A\n\n,Radar,,Own\n,of,of,of\ntime,x,y,x\n"
    + table("", lambda *look: (*plain(*look), 7)).lstrip(),
    "decimal commas below words": "Gerät;3,5\n"
    + table("time;x;y", lambda *look: (f"{cell:.3f}".replace(".", ",") for cell in look), ";"),
    "a header behind #, as numpy.savetxt writes it": f"# made by us\n# {PLAIN}",
    "Excel's line of the separator": "sep=;\r\n" + table("time;x;y", plain, ";", "\r\n"),
    "a delimiter at the end of each row": table("time,x,y", lambda *look: (*plain(*look), "")),
    "decimal commas in quotation marks": table(
        "time,x,y", lambda *look: (f'"{cell:.3f}"'.replace(".", ",") for cell in look)
    ),
    "units in the row below": table("t,range,azimuth\ns,km,gon", polar(1e-3, 200 / math.pi)),
    "a column of days beside that of times": table("date,time,x,y", clock),
    "days, as spreadsheets count": table("time,x,y", lambda time, x, y: (f"{46154.3 + time / 86400:.9f}", x, y)),
    "dates without marks": table(
        "time,x,y",
        lambda time, x, y: (f"202605120830{time % 60:02.0f}" if time < 60 else f"202605120831{time - 60:02.0f}", x, y),
    ),
    "positions between frames of reference": table("#timestamp, p_RS_R_x [m], p_RS_R_y [m]", plain),
    "minutes": table("t [min],x,y", lambda time, x, y: (time / 60, x, y)),
    "hours, yards and degrees": table(
        "time_h,Range (yd),Bearing (deg T)", lambda time, x, y: (time / 3600, *polar(1 / 0.9144, 180 / math.pi)(0, x, y)[1:])
    ),
    "a frame of reference, as ROS prints it": table(
        "%time,header.frame_id,pose.position.x,pose.position.y", lambda time, x, y: (10**18 + int(1e9 * time), "odom", x, y)
    ),
    "millimetres": table("Timestamp(ms),X(mm),Y(mm)", lambda *look: (int(1000 * each) for each in look)),
    "plots of ASTERIX, in NM": table("TOD,SAC,SIC,RHO,THETA", lambda *look: asterix(*look)),
    "an index without a title": table(",time,x,y", lambda *look: (int(look[0]) % 8, *plain(*look))),
}


GRADS = [
    ("Zeit_s;Entfernung_m;Azimut_Grad", np.linspace(40, 120, 40), "deg"),
    ("Zeit_s;Entfernung_m;Azimut_Grad", np.linspace(200, 399, 40), "0.9 deg"),
    ("time;range_m;bearing_grad", np.linspace(40, 120, 40), "0.9 deg"),
    ("time;range_m;bearing_grad", np.linspace(-190, 120, 40), "0.9 deg"),
    ("time;range_m;bearing_grad", np.linspace(9, 351, 40), "deg"),
    ("t;r;az_grad", np.linspace(40, 120, 40), "deg"),
]


@pytest.mark.parametrize(("titles", "angles", "unit"), GRADS)
def test_what_grad_is_is_told_by_the_language_of_titles_and_by_values_and_said_to_be_assumed(titles, angles, unit, tmp_path):
    (tmp_path / "d.csv").write_text(titles + "".join(f"\n{k};{900 + 5 * k};{angle:.3f}" for k, angle in enumerate(angles)))
    found = read_table(tmp_path / "d.csv")
    (title,) = {titles.split(";")[-1]} & set(found.guessed)
    assert (found.units["bearing"], found.guessed[title].split()[2]) == (unit, "gon:" if unit != "deg" else "deg:")


def test_a_unit_of_two_meanings_is_asked_for():
    """The units that were listed did not name gon."""
    with pytest.raises(ConfigError, match="say deg or gon"):
        Wishes.of(None, None, None, "bearing=grads", None, None, None)
    assert Wishes.of(None, None, None, "bearing=gon", None, None, None).units == {"bearing": "0.9 deg"}


def spots(recording, polar):
    """The place of each return in m, and the s since the first."""
    z = np.concatenate([scan.detections.z for scan in recording.scans])
    if polar:
        z = z[:, :1] * np.stack([np.cos(z[:, 1]), np.sin(z[:, 1])], axis=-1)
    return z, np.array([scan.time for scan in recording.scans]) - recording.scans[0].time


@pytest.mark.parametrize("name", READ)
@pytest.mark.costly
def test_it_is_read_as_the_plain_table(name, tmp_path):
    path, text = tmp_path / "d.csv", READ[name]
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    experiment = vedette.load(tomllib.loads(draft_config(path)))
    recording = experiment.source.open(experiment.tracker.sensors, RNG)
    assert len(recording.refused) == (1 if "in the row below" in name else 0)
    found, times = spots(recording, experiment.tracker.sensors["sensor"].kind == "range_bearing")
    wanted = np.array(LOOKS)
    np.testing.assert_allclose(times, wanted[:, 0], atol=1e-3)
    np.testing.assert_allclose(found, wanted[:, 1:], atol=0.1)


REFUSED = {
    "a line of as many words as the header, above it": (
        table("Radar,Station,North\ntime,x,y", plain),
        r"d.csv: no column .*; titles in several lines",
    ),
    "grouped digits": (
        table("time;x;y", lambda time, x, y: (time, f"{x:,.2f}", f"{y:,.2f}"), ";"),
        r"d.csv:2: x must be a number, got '3,0.*; write it without what groups its digits, 30",
    ),
    "mostly what is no number": (
        table("time,x,y", lambda time, x, y: (time, x, y if time < 20 else f"{y:.0f} or so")),
        r"d.csv: 30 of 40 rows cannot be read, the first of them d.csv:12: y must be a number",
    ),
    "a snapshot": (table("time,id,x,y", lambda time, x, y: (7, time, x, y), looks=LOOKS[:9]), "all rows; .* other moments"),
    "a large snapshot": (
        table("time,id,x,y", lambda time, x, y: (7, time, x, y), looks=LOOKS * 60),
        "'7' in all rows; .* other",
    ),
    "one time in all rows": (table("date,x,y", lambda time, x, y: (140214, x, y)), r"d.csv: date: .* all rows; .*--time"),
    "semicircles": (
        table("time,position_lat,position_long", lambda time, x, y: (time, 560731650 + 9 * y, 95443717 + 9 * x)),
        rf"d.csv:2: position_lat must be from -90 to 90, got .*, {180 / 2**31:.7e} deg".replace("e-08", "e-8"),
    ),
    "degrees and minutes without a letter": (
        table("time,lat,lon", lambda time, x, y: (time, f"{5925 + time / 100:.4f}", f"{1028 + time / 100:.4f}")),
        r"d.csv:2: lat must be from -90 to 90, got '5925.0000'; .* say so by a letter: 5925.0000N",
    ),
    "an Excel workbook": (
        b"PK\x03\x04" + bytes(99),
        "is an Excel workbook or a ZIP archive, not text: save the table as CSV",
    ),
    "an HDF5 file": (b"\x89HDF\r\n\x1a\n" + bytes(99), "d.csv: is an HDF5 file, not text: save"),
    "a file of MATLAB": (b"MATLAB 5.0 MAT-file" + bytes(99), "d.csv: is a file of MATLAB, not text: save"),
    "a tracking data message": (
        b"CCSDS_TDM_VERS = 1.0\nDATA_START\nRANGE = 2026-05-12T08:00:00 900.5\n" * 9,
        "as time,range,b",
    ),
    "elements of orbits": (
        "A\n1 25544U 98067A   26132.5 .00016717  00000-0  10270-3 0  9003\n2 25544  51.6 247.4 0006703 130.5 325.0 15.7\n"
        * 9,
        r"d.csv:2: holds elements of orbits \(TLE\)",
    ),
    "XML with words above its first element": ('<?xml version="1.0"?>\n' + "words, more\n" * 9, "d.csv:1: .* KML and TCX"),
    "captured packets": (b"\xd4\xc3\xb2\xa1\x02\x00" + bytes(99), "d.csv: holds packets .*: decode"),
    "a Parquet file": (b"PAR1" + bytes(99), "is a Parquet file: its name must end in .parquet"),
    "bytes of any kind": (bytes(range(1, 200)) * 3, r"among .*\\x02.*; name it `time` or `t`"),
    "clock times without colons": (
        table("time,x,y", lambda time, x, y: (int(75_900 + time if time < 60 else 79_940 + time), x, y)),
        r"time: must be times of day as 08:39:04, for no number ends in 60 to 99, got 75900",
    ),
    "dates without a year": (
        table("time,x,y", lambda time, x, y: (f"12.05. 08:30:{time % 60:02.0f}", x, y)),
        r"d.csv:2: time must be a number, or a date and time as .*, got '12.05. 08:30:00'",
    ),
    "no titles": (
        "\n".join(f"2026-05-12T08:30:{k:02d};211000001;{54 + k / 1e4:.4f};10.5" for k in range(20)),
        r"d.csv:1: must be a header line .*\(echo 'time;c2;c3;c4'; tail -n \+1 .*d.csv\) > titled.csv",
    ),
    "no titles above metres with many decimals": (
        "\n".join(f"{k};{k / 7 - 2:.6f};{2 - k / 9:.6f}" for k in range(20)),
        r"d.csv:1: must be a header line .*\(echo 'c1;c2;c3'; ",
    ),
    "no titles above two clocks and places of some rows, as dump1090 writes them": (
        "\n".join(
            f"MSG,3,1,1,2026/05/12,8:30:0{k},2026/05/12,8:30:0{k},{51.5 + k / 1e5 if k % 3 else '':.7},-.3333333"
            for k in range(9)
        ),
        r"d.csv:1: must be a header line .*\(echo 'c1,c2,c3,c4,date,time,c7,c8,latitude,longitude'; ",
    ),
    "no titles above what never changes, below other rows, as in HURDAT2": (
        "\n".join(f"AL01,ANA\n{k},{k}1.5N,55.5W,0.42500,0.42500" for k in range(9)) + 9 * "\n9,9.5N,55.5W,0.42500,0.42500",
        r"d.csv:2: must be a header line .*\(echo 'c1,latitude,longitude,c4,c5'; tail -n \+2",
    ),
    "rows of each object below its name, as in HURDAT2": (
        "\n".join(
            f"AL0{i}2026, ANA, 9,\n" + "\n".join(f"20260512, {k:02d}00, TS, {k}.5N, 55.5W, 30, 1000" for k in range(9))
            for i in range(1, 9)
        ),
        r"\(echo 'id,date,time,c3,latitude,longitude,c6,c7'; awk -F',' 'NF < 7 \{id = \$1; next\} \{print id FS \$0\}' ",
    ),
    "rows of several kinds without titles": (
        "0,imu,1\n1,gps,1,2\n2,mag,1,2,3\n" * 9,
        "put those of each into a file of its own",
    ),
    "lines above rows without titles, as GeoLife writes them": (
        "Geolife trajectory\nWGS 84\nAltitude is in Feet\nReserved 3\n0,2,255,My Track,0,0,2,8421376\n0\n"
        + "\n".join(f"39.9{k:02d}123,116.3{k:02d}456,0,492,39744.12,2008-10-23,02:53:{k:02d}" for k in range(20)),
        r"d.csv:7: must be a header line .*\(echo 'latitude,longitude,c3,c4,c5,date,time'; tail -n \+7 ",
    ),
    "fixes of a logger, as IGC": (
        "AXXX001\nHFDTE120526\n" + "".join(f"B0830{k:02d}5426123N01030456EA0058700612\n" for k in range(40)),
        r"d.csv:3: holds fixes .*gpsbabel -i igc",
    ),
    "ASTERIX, printed": (
        "Category: 48\nLen: 55\nI010: Data Source Identifier\nSAC: 25\nSIC: 10\nI040: Measured Position\nRHO: 12.5\n" * 9,
        r"d.csv:1: holds ASTERIX .*JSON",
    ),
    "a log of VEMCO's": (
        "VEMCO DATA LOG,2.0.0,vdat-9.3.0\nRECORD TYPE,FIELD,FIELD\nDET_DESC,Time,Full ID\n"
        + "".join(f"DET,2026-05-12 08:30:{k:02d},A69-1303-{k}\n" for k in range(40)),
        "d.csv:1: holds a log of VEMCO's",
    ),
    "a table of VEMCO's": (
        table(
            "Date and Time (UTC),Receiver,Transmitter,Station Name,Latitude,Longitude",
            lambda time, x, y: (f"2026-05-12 08:30:{time / 2:02.0f}", "VR2W-1", f"A69-{x:.0f}", "", "+0", "+0"),
        ),
        "d.csv: holds a table of VEMCO's, .* no positions",
    ),
    "NGSIM's trajectories": (
        table(
            "Vehicle_ID,Frame_ID,Total_Frames,Global_Time,Local_X,Local_Y,Global_X,Global_Y,Location",
            lambda time, x, y: (7, time, 40, 1113437421700 + 50 * int(time), x, y, x + 6e6, y + 2e6, "us-101"),
        ),
        "holds trajectories of NGSIM, .*--columns x=Local_X,y=Local_Y --units",
    ),
    "AIS": ("!AIVDM,1,1,,B,177KQJ5000G?tO`K>RA1wUbN0TKH,0*5C\n" * 3, "d.csv:1: holds sentences of NMEA 0183, not a table"),
    "AIS below words": ("slot, timeout\n\n!AIVDM,1,1,,A,15B4FT5000JRP>PE6E68Nbkl0PS5,0*70\n", "d.csv:3: holds sentences of"),
    "letters after latitudes": (
        table("time,lat,lon", lambda *look: (look[0], "59.4Q", "10.5E")),
        r"lat must be a number, got '59.4Q'; write degrees with decimals, or as 59 25.955 N",
    ),
    "objects side by side": (
        table("t,x1,y1,x2,y2", lambda time, x, y: (time, x, y, -x, -y)),
        r"d.csv: a row holds x1, y1 and x2, y2: write a row .* or read one alone: --columns x=x1,y=y1",
    ),
    "two solutions side by side": (
        table("t,lat1,lon1,lat2,lon2", lambda time, x, y: (time, 54 + time / 1e4, 10.5, 54, 10)),
        r"d.csv: a row holds lat1, lon1 and lat2, lon2: .* alone: --columns latitude=lat1,longitude=lon1",
    ),
    "titles for several columns, as of players": (
        ",,Home,\n,,11,\nFrame,Time [s],Player11,\n" + "\n".join(f"{k},{k / 25},{k / 99},{k / 77}" for k in range(20)),
        r"d.csv: no column .*; titles in .*, or for several columns",
    ),
    "points of a body side by side": (
        table("Rate\t60\nTime\tHip\t\tKnee\t\n\tX1\tY1\tX2\tY2", lambda t, x, y: (t, x, y, x, y), "\t"),
        r"among Time, Hip X1, Hip Y1, Knee X2, Knee Y2; say --columns x=",
    ),
    "lists in cells, of which blanks make numbers": (
        table("time,ranges", lambda t, x, y: (f"2026-05-12T08:{t / 2:02.0f}:00Z", f'"[{x:.0f}, 0, 0, 0, 0]"')),
        "among time, ranges;",
    ),
    "lists of positions in cells": (
        table("time,POLYLINE", lambda time, x, y: (time, f'"[[{x:.2f},{y:.2f}],[{x:.2f},{y:.2f}]]"')),
        "among time, POLYLINE; .* POLYLINE holds lists: write a row for each position",
    ),
    "lists of numbers in cells": (
        table("time,xs,ys", lambda time, x, y: (time, *(f'"[{each:.2f}, 0, 0, 0]"' for each in (x, y)))),
        "among time, xs, ys; .* xs holds lists",
    ),
    "a frame of a game in each line": (
        "\n".join(f"{k}:" + "".join(f"{i},{9 * i},{k / 7},{k / 9};" for i in range(22)) + ":0,0,1;:" for k in range(20)),
        "d.csv:1: holds several positions",
    ),
    "UTF-16 without its mark": (table("time,x,y", plain).encode("utf-16-le"), "d.csv: .* byte order mark: save"),
    "an ephemeris": ("CCSDS_OEM_VERS = 2.0\nMETA_START\nMETA_STOP\n", "d.csv: is .* in km"),
    "comments and words with numbers above rows without titles": (
        "# by A\n#\ngaze 576 304\n" + "\n".join(f"{k} {k / 7} {k / 9} 1" for k in range(20)),
        r"d.csv:4: .*\(echo 'c1 c2 c3 c4'; tail -n \+4",
    ),
    "words far above rows without titles, of as many": (
        "** BY A B\n** OF B\nat 3 May\n" + "RATE 1\n" * 30 + "\n".join(f"{k} {k / 7} {k / 9}\n{k} . 0" for k in range(60)),
        r"d.csv:34: must be a header line .*\(echo 'c1 c2 c3'; tail -n \+34",
    ),
    "comments above rows without titles": (
        "# by A\n# of 12 May\n" + "\n".join(f"{k} {k / 7} {k / 9} 1" for k in range(20)),
        r"d.csv:3: must be a header line .*\(echo 'c1 c2 c3 c4'; tail -n \+3",
    ),
    "a comment of seven words above rows of six cells": (
        "# Frame of X and Y: ground truth\n" + "\n".join(f"{k} {k / 7} {k / 9} 1 2 3" for k in range(20)),
        r"d.csv:2: must be a header line .*\(echo 'c1 c2 c3 c4 c5 c6'; tail -n \+2",
    ),
    "how far and where to something went": (
        table("t,distance travelled,angle", plain),
        "among t, distance travelled, angle;",
    ),
    "bearings alone, from where one is": (
        table("t,bearing,own_x,own_y", lambda time, x, y: (time, 0.1, x, y)),
        "bearing has no range beside it, and own_x is where .* kind 'bearing_only'",
    ),
    "one axis alone": (table("t,z", lambda time, x, y: (time, x)), "among t, z; .* one axis alone .* kind 'linear'"),
    "an angle of movement": (
        table("t,Distance between start and end,Angle of movement", plain),
        "among t, Distance between",
    ),
    "speeds in place of places": (
        table("t_ms;id;vrel_long;vrel_lat", lambda time, x, y: (int(1000 * time), 1, -3.0, 0.2), ";"),
        r"d.csv: no columns look like range .*; say --columns x=COLUMN,y=COLUMN",
    ),
    "blank lines": ("\n\n\n", "d.csv: holds blank lines only, .* as time,x,y"),
    "a picture": (b"\x89PNG\r\n\x1a\n" + bytes(99), "d.csv: is no text"),
    "a planned route": (table("time,x,y", lambda time, x, y: ("", x, y)), "empty in all rows, as in a planned route"),
    "no number": (table("time,x,y", lambda time, x, y: (time, "north", y)), "d.csv:2: x .* 'north'; write one, as 12.5"),
    "nuScenes' annotations": (table("sample_token,x,y", plain), "join the two by sample_token"),
    "a time that is written oddly": (
        table("time,x,y", lambda time, x, y: (f"8h{time:.0f}", x, y)),
        "d.csv:2: time must be a number, or a date and time .*; name another column, or say how dates are written",
    ),
    "negative ranges": (table("time,range,bearing", polar(-1, 1)), r"d.csv:2: range must be >= 0, got '-316"),
}


SPOTS = "LABEL,ID,TRACK_ID,POSITION_X,POSITION_Y,POSITION_T,FRAME"
TRACKMATE = f"{SPOTS}\nLabel,Spot ID,Track ID,X,Y,T,Frame\n,,,(micron),(micron),(sec),"


def test_a_draft_says_how_else_a_table_can_be_read(tmp_path):
    (tmp_path / "d.csv").write_bytes(READ["Latin-1"])
    assert "the titles are in Windows-1252, not in UTF-8" in read_table(tmp_path / "d.csv").assumed
    frames = [{"t": time, "raw": [{"x": x, "y": y}], "smoothed": [{"x": x, "y": y}]} for time, x, y in LOOKS]
    (tmp_path / "d.json").write_text(json.dumps(frames))
    read = read_table(tmp_path / "d.json")
    assert read.measured == {"x": "x", "y": "y"}
    told = "smoothed.x and smoothed.y are not read: --columns x=smoothed.x,y=smoothed.y takes them instead"
    assert told in read.assumed


def test_spots_of_trackmate_and_poses_of_nuscenes_are_read(tmp_path):
    """The units stand in a line of their own, two below the titles; positions are lists of numbers."""
    (tmp_path / "s.csv").write_text(table(TRACKMATE, lambda time, x, y: ("a", 1, 7, x, y, time, time / 2)))
    read = read_table(tmp_path / "s.csv")
    assert (read.time.title, read.measured) == ("POSITION_T", {"x": "POSITION_X", "y": "POSITION_Y"})
    assert read.units == {"x": "1e-6 m", "y": "1e-6 m"}
    poses = [{"timestamp": 1e6 * time, "translation": [x, y, 0.0], "rotation": [1.0, 0.0, 0.0, 0.0]} for time, x, y in LOOKS]
    (tmp_path / "p.json").write_text(json.dumps(poses))
    assert read_table(tmp_path / "p.json").measured == {"x": "translation.0", "y": "translation.1"}


@pytest.mark.parametrize(("hours", "pattern"), [(6, "%Y%m%d%H"), (6, "%Y%m%d%H%M"), (24, "%Y%m%d")])
def test_dates_without_marks_are_read_by_their_pattern(hours, pattern, tmp_path):
    """Those of storms every six hours, as 2004031918, were seconds."""
    times = [datetime(2026, 5, 12) + k * timedelta(hours=hours) for k in range(30)]
    rows = "".join(f"{time:{pattern}},{k},{2 * k}\n" for k, time in enumerate(times))
    (tmp_path / "d.csv").write_text(f"time,x,y\n{rows}")
    read = read_table(tmp_path / "d.csv")
    assert (read.dates, read.time_unit, read.assumed[0]) == (pattern, "", f"dates are written as {pattern}")


def test_steps_and_turns_beside_positions_are_no_ranges_and_bearings(tmp_path):
    for titles, axes in (
        ("Distance,Angle,x,y", {"x": "x", "y": "y"}),
        ("Range,Bearing,x,y", {"range": "Range", "bearing": "Bearing"}),
    ):
        (tmp_path / "d.csv").write_text(table(f"time,{titles}", lambda time, x, y: (time, 5, 0.1, x, y)))
        assert read_table(tmp_path / "d.csv").measured == axes


def test_what_a_record_holds_of_its_own_finding_is_no_return(tmp_path):
    """Strokes of lightning lay where the stations stand that heard them."""
    strokes = [
        {"time": k, "lat": 48.0 + k / 99, "lon": 10.0, "sig": [{"time": 3, "lat": 47.0, "lon": 9.0}]} for k in range(20)
    ]
    (tmp_path / "d.json").write_text(json.dumps(strokes))
    assert read_table(tmp_path / "d.json").left_out == ("(sig: each with a time of its own)",)
    scans = [{"time": k, "lat": 48.0, "lon": 10.0, "targets": [{"lat": 47.0 + k / 99, "lon": 9.0}]} for k in range(20)]
    (tmp_path / "d.json").write_text(json.dumps(scans))
    assert read_table(tmp_path / "d.json").left_out == ()


def test_of_two_times_the_one_that_goes_on_is_read(tmp_path):
    """As of a line in GeoJSON, whose beginning stands beside the times of its points."""
    (tmp_path / "d.csv").write_text(
        table("time,coordTimes,x,y", lambda t, x, y: ("2026-05-12T08:00:00Z", f"2026-05-12T08:{t / 2:02.0f}:00Z", x, y))
    )
    assert read_table(tmp_path / "d.csv").time.title == "coordTimes"


def test_one_of_several_positions_in_a_row_is_read_if_stated(tmp_path):
    (tmp_path / "d.csv").write_text(table("t,x1,y1,x2,y2", lambda time, x, y: (time, x, y, -x, -y)))
    read = read_table(tmp_path / "d.csv", wishes=Wishes(columns={"x": "x2", "y": "y2"}))
    assert read.measured == {"x": "x2", "y": "y2"}


def test_positions_that_objects_send_are_degrees_however_far_they_fly(tmp_path):
    """As of a flight of 600 km across the meridian of Greenwich."""
    (tmp_path / "d.csv").write_text(
        table(
            "Timestamp,Callsign,Position", lambda time, x, y: (time, "BAW1", f'"{51 + time / 40:.6f},{1 - time / 20:.6f}"')
        )
    )
    assert read_table(tmp_path / "d.csv").measured == {"latitude": "Position.x", "longitude": "Position.y"}


@pytest.mark.parametrize("name", REFUSED)
def test_it_is_refused_with_what_would_be_right(name, tmp_path):
    path, (text, told) = tmp_path / "d.csv", REFUSED[name]
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(InputError, match=told):
        draft_config(path)


def test_what_is_said_of_ngsims_trajectories_can_be_typed(tmp_path):
    (tmp_path / "d.csv").write_text(REFUSED["NGSIM's trajectories"][0])
    stated = "Global_Time", None, "x=Local_X,y=Local_Y", "time=ms,x=ft,y=ft", None, None, None
    read = read_table(tmp_path / "d.csv", wishes=Wishes.of(*stated))
    assert read.measured == {"x": "Local_X", "y": "Local_Y"}
    assert (read.time_unit, read.units, read.identity) == ("ms", {"x": "ft", "y": "ft"}, "Vehicle_ID")


@pytest.mark.costly
def test_the_wrong_delimiter_is_suspected(tmp_path):
    (tmp_path / "d.csv").write_text(PLAIN)
    config = tomllib.loads(drafted(PLAIN))
    config["source"] |= {"path": str(tmp_path / "d.csv"), "delimiter": ";"}
    with pytest.raises(InputError, match=r"'time,x,y'; ',' .*source\.delimiter"):
        vedette.load(config).run()


@pytest.mark.costly
def test_a_unit_that_nobody_knows_is_said():
    assert "for 'cubits' is no unit that is known" in drafted(table("time,x [cubits],y [cubits]", plain))


@pytest.mark.parametrize(("stated", "axis"), [({}, "x"), ({"x": "m"}, "y"), ({"x": "NM", "y": "NM"}, "")])
@pytest.mark.by_turns
def test_a_draft_with_a_unit_that_nobody_knows_does_not_fit(stated, axis, tmp_path):
    (tmp_path / "d.csv").write_text(table("time,x [cubits],y [cubits]", plain))
    failure = whole_draft(tmp_path / "d.csv", wishes=Wishes(units=stated)).failure
    assert (f"--units {axis}=NM" in failure) if axis else not failure


@pytest.mark.costly
def test_plain_seconds_are_no_clock_times():
    """A second of each minute under 60, ten minutes long: of clock times the gaps would be 40 s longer."""
    assert "time is in s" in drafted(table("time,x,y", lambda time, x, y: (5 * time, x, y)))


@pytest.mark.parametrize("titles", ["time,x,y", "time,range,bearing"])
@pytest.mark.by_turns
def test_returns_in_one_place_get_a_config_that_loads(titles):
    still = [(2.0 * k, 0.0, 0.0) for k in range(40)]
    config = tomllib.loads(drafted(table(titles, plain, looks=still)))
    vedette.load(config)
    Draft202012Validator(schema()).validate(config)


def drafted(text, where="d.csv"):
    with TemporaryDirectory() as folder:
        path = Path(folder) / where
        path.write_text(text)
        return draft_config(path)


def test_points_of_geojson_are_read_with_their_properties(tmp_path):
    points = [
        {
            "type": "Feature",
            "properties": {"t": k, "mmsi": 211_000_000 + k % 2},
            "geometry": {"type": "Point", "coordinates": [10.0 + 1e-4 * k, 54.0]},
        }
        for k in range(20)
    ]
    path = tmp_path / "d.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": points}))
    table = read_table(path)
    assert table.time.title == "properties.t"
    assert table.identity == "properties.mmsi"
    assert table.measured == {"latitude": "geometry.coordinates.1", "longitude": "geometry.coordinates.0"}


def test_frames_of_two_teams_and_a_ball_are_read(tmp_path):
    """A time that the first frame alone holds, and the ball beside the players, were taken for those of all."""
    frames = [
        {
            "generatedTime": "2026-05-12T08:30:00Z" if k == 0 else None,
            "timeMs": 40 * k,
            "ball": {"xyz": [0.1, 0.2]},
            "home": [{"playerId": "a", "xyz": [k / 10, 2.0]}],
            "away": [{"playerId": "b", "xyz": [5.0, k / 20]}],
        }
        for k in range(40)
    ]
    path = tmp_path / "d.jsonl"
    path.write_text("\n".join(map(json.dumps, frames)))
    table = read_table(path)
    assert (table.time.title, table.time_unit, table.identity) == ("timeMs", "ms", "playerId")
    assert table.measured == {"x": "xyz.0", "y": "xyz.1"}


@pytest.mark.parametrize(
    ("titles", "axes"),
    [("utm_e,utm_n", {"x": "utm_e", "y": "utm_n"}), ("p_x,p_y,p_z", {"x": "p_x", "y": "p_y", "z": "p_z"})],
)
def test_more_titles_of_positions(titles, axes, tmp_path):
    path = tmp_path / "d.csv"
    path.write_text("\n".join([f"time,{titles}", *(f"{k},{500_000 + k},{6e6 - k:.0f},{k}" for k in range(20))]) + "\n")
    if len(axes) == 2:
        path.write_text("\n".join(line.rpartition(",")[0] if i else line for i, line in enumerate(path.read_text().split())))
    assert read_table(path).measured == axes


@pytest.mark.parametrize(("text", "cure"), [("time\n0\n", "a comma, a semicolon"), ("<?xml version='1.0'?><kml/>\n", "GPX")])
def test_what_is_no_table_is_refused_with_its_line_and_a_cure(text, cure, tmp_path):
    path = tmp_path / "d.txt"
    path.write_text(text)
    with pytest.raises(InputError, match=rf"d\.txt:1: .*{cure}"):
        read_table(path)


def test_json_lines_are_read_whatever_their_name_says(tmp_path):
    path = tmp_path / "d.json"
    path.write_text(
        "\n".join(json.dumps({"now": k, "hex": "ab1", "lat": 39.85, "lon": -119.85 + k / 1e4}) for k in range(20))
    )
    table = read_table(path)
    assert (table.time.title, table.identity, table.measured) == ("now", "hex", {"latitude": "lat", "longitude": "lon"})


@pytest.mark.parametrize(
    ("name", "title"), [("user_id", "tracked_at"), ("user_id", "recorded_at"), ("Trajectory", "received_at")]
)
def test_a_moment_at_which_something_was_seen_is_a_time(name, title, tmp_path):
    path = tmp_path / "d.csv"
    path.write_text(table(f"{name},{title},x,y", lambda *look: (7, *plain(*look))))
    found = read_table(path)
    assert (found.time.title, found.identity) == (title, name)


def test_a_list_of_another_length_than_its_times_is_told_by_name(tmp_path):
    """It was left out without a word, and `no x` was found."""
    path = tmp_path / "d.json"
    path.write_text(json.dumps({"time": list(range(40)), "range": list(range(39)), "bearing": [0.1] * 40}))
    with pytest.raises(InputError, match="range: 39 for 40 times"):
        read_table(path)


def test_a_column_of_dates_is_the_time_whatever_its_title_says(tmp_path):
    """As of a survey, which has begun and ended."""
    path = tmp_path / "d.csv"
    path.write_text(
        table(
            "t_begin,t_end,x,y",
            lambda time, x, y: (*2 * (f"2026-05-12T08:{30 + time / 2:02.0f}:00Z",), x, y),
            looks=LOOKS[:30],
        )
    )
    found = read_table(path)
    assert found.time.title == "t_begin"
    assert any("t_begin is the time" in said for said in found.said)


@pytest.mark.parametrize(
    "titles", ["x_center,y_center", "cell X Coordinate (px),cell Y Coordinate (px)", "Loc.X,Loc.Y", "vehicle_x,vehicle_y"]
)
def test_what_says_that_an_x_is_a_position_stands_before_or_after_it(titles, tmp_path):
    (tmp_path / "d.csv").write_text(table(f"time,{titles},orientation_x,x_center_speed", lambda *look: (*look, 1, 2)))
    assert [*read_table(tmp_path / "d.csv").measured.values()] == titles.split(",")


def test_a_draft_says_which_positions_of_a_row_it_does_not_read(tmp_path):
    (tmp_path / "d.csv").write_text(table("time,x position,y position,goal loc x,goal loc y", lambda *look: (*look, 1, 2)))
    told = "goal loc x and goal loc y are not read: --columns x=goal loc x,y=goal loc y takes them instead"
    assert told in read_table(tmp_path / "d.csv").assumed


@pytest.mark.parametrize(
    ("title", "name"), [("PersID", "PersID"), ("storm_id", "storm_id"), ("uid", "uid"), ("sensor_id", "")]
)
def test_an_id_of_whom_it_may_be_names_objects(title, name, tmp_path):
    (tmp_path / "d.csv").write_text(table(f"time,{title},x,y", lambda time, x, y: (time, 3, x, y)))
    assert read_table(tmp_path / "d.csv").identity == name


def test_altitudes_in_the_steps_of_transponders_are_in_ft(tmp_path):
    """Below 20,000 they were in m."""
    for step, unit in ((25, "ft"), (7, None)):
        (tmp_path / "d.csv").write_text(
            table("time,lat,lon,altitude", lambda t, x, y, step=step: (t, 54 + t / 1e4, 10.5, 600 + step * t))
        )
        assert read_table(tmp_path / "d.csv").units.get("altitude") == unit


@pytest.mark.parametrize(
    ("data", "cure"),
    [([["ab1", 1, 2.0]] * 9, 'titles: {"columns"'), ([{"name": "a", "kind": "b"}] * 9, r"--time COLUMN$")],
)
def test_json_without_titles_or_times_is_refused_for_that_alone(data, cure, tmp_path):
    """Of words alone the titles were said to stand in several lines."""
    path = tmp_path / "d.json"
    path.write_text(json.dumps(data))
    with pytest.raises(InputError, match=cure):
        read_table(path)


def test_hours_and_minutes_beside_dates_are_read_where_neither_has_marks(tmp_path):
    """As of storms: the dates of 1851 were seconds, and the hours were left out."""
    row = lambda time, x, y: (f"185106{25 + time // 24:02.0f}", f"{time % 24:02.0f}00", x, y)  # noqa: E731
    (tmp_path / "d.csv").write_text(table("Date,Time,x,y", row))
    found = read_table(tmp_path / "d.csv")
    assert (found.time.title, found.dates) == ("Date + Time", "%Y%m%d %H%M")


@pytest.mark.costly
def test_a_column_that_begins_again_numbers_no_scans(tmp_path):
    """As of plays, whose ball is counted from another moment: its rows were refused."""
    rows = [
        (k, name, k + 7 * (name == "ball"), 10 * i, k / 9) for i, name in enumerate(("a", "b", "ball")) for k in range(40)
    ]
    (tmp_path / "d.csv").write_text("\n".join(["frame,id,time,x,y", *(",".join(map(str, row)) for row in rows)]) + "\n")
    text = draft_config(tmp_path / "d.csv")
    assert "frame numbers no scans" in text
    assert "cannot be read" not in text


@pytest.mark.costly
def test_a_column_that_counts_what_is_there_at_a_time_numbers_no_scans(tmp_path):
    """As of the points of a radar in each of its frames."""
    rows = [(k, 1 + i, 10 * i + k / 9, 20 * i) for k in range(60) for i in range(3 + k % 4)]
    (tmp_path / "d.csv").write_text("\n".join(["time,NumFrame,x,y", *(",".join(map(str, row)) for row in rows)]) + "\n")
    assert "NumFrame numbers no scans" in draft_config(tmp_path / "d.csv")


@pytest.mark.parametrize(("title", "name"), [("eddy", "eddy"), ("track", "track"), ("storm", "")])
def test_what_rows_are_sorted_by_before_their_times_names_objects(title, name, tmp_path):
    """Two eddies, and a kind that is the same for both; a storm whose rows are mixed is none, nor is what stands twice."""
    rows = [f"{k // 20 if name else k % 7 // 6},cyclone,{k % 20},{k % 20 + k // 20},{k}" for k in range(40)]
    (tmp_path / "d.csv").write_text("\n".join([f"{title},kind,time,x,y", *rows]))
    assert read_table(tmp_path / "d.csv").identity == name


def test_months_and_minutes_are_told_apart_by_the_size_of_their_letters(tmp_path):
    titles = "YYYY,MM,DD,hh,mm,ss"
    (tmp_path / "d.csv").write_text(table(f"{titles},x,y", lambda t, x, y: (2026, 5, 12, 8, t // 60, t % 60, x, y)))
    assert read_table(tmp_path / "d.csv").time.title == titles.replace(",", " + ")
