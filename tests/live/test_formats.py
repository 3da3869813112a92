"""Formats: round trips, splits anywhere, and bytes of no meaning."""

from __future__ import annotations

import json
from functools import reduce
from operator import xor
from typing import Any

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given, settings
from hypothesis import strategies as st

from vedette import Array, Space
from vedette.streams import Decoded, Format, Message, TrackReport
from vedette_files import FRAMES, Origin, east_north, label
from vedette_live.formats.asterix import Asterix
from vedette_live.formats.csv_lines import CsvLines
from vedette_live.formats.geojson import GeoJson
from vedette_live.formats.json_lines import JsonLines
from vedette_live.formats.nmea import Nmea
from vedette_live.placing import Placing
from vedette_standard import LinearSensor

PLANE = Space.of(x="m", vx="m/s", y="m", vy="m/s")
SENTENCES = (
    b"!AIVDM,1,1,,B,15M67FC000G?ufbE`FepT@3n00Sa,0*5C\r\n",
    b"!AIVDM,2,1,4,A,55O0W7`00001L@gCWGA2uItLth@DqtL5@F22220j1h742t0Ht0000000,0*08\r\n",
    b"!AIVDM,2,2,4,A,000000000000000,2*20\r\n",
    b"!AIVDM,1,1,,A,15NPOOPP00o?b=bE`UNv4?w428D;,0*24\r\n",  # without a course
)
JSON = (
    b'{"time": 1.5, "sensor": "north", "z": [[1, 2.5], [3.0, -4.0]], "evidence": [0.5, 1.0], "n": 3}\n',
    b'{"z": []}\n',
    b'{"marker": "north", "time": 2.0, "angle": 0.5}\n',
)
CSV = (b"12.5,north,1.0,2.0\n", b"13.5,north,,\n", b"time,sensor,range,bearing\n")


def asterix_blocks() -> bytes:
    gen = pytest.importorskip("asterix.generated")
    plots, marks, old = gen.Cat_048_1_32, gen.Cat_034_1_29, gen.Cat_001_1_4
    codes = (("SAC", 2), ("SIC", 17))
    place = (("RHO", (10.0, "NM")), ("THETA", (45.0, "°")))
    plot = plots.cv_record.create({"010": codes, "140": (3600.5, "s"), "040": place})
    north = marks.cv_record.create({"010": codes, "000": 1, "030": (3600.0, "s")})
    sector = marks.cv_record.create({"010": codes, "000": 2, "020": (90.0, "°")})
    track = old.cv_uap.cv_uaps["track"].create(
        {"010": codes, "020": ((("TYP", 1), 0, 0, 0, 0, 0, None),), "040": place, "141": (8.0, "s")}
    )
    blocks = [marks.create([north]), plots.create([plot, plot]), marks.create([sector]), old.create([track])]
    return b"".join(block.unparse().to_bytes() for block in blocks)


FORMATS: dict[str, tuple[Format, bytes]] = {
    "json": (JsonLines(), b"".join(JSON)),
    "csv": (CsvLines(columns=("time", "sensor", "range", "bearing")), b"".join(CSV)),
    "nmea": (Nmea(), b"".join(SENTENCES)),
}


def through(format_: Format, pieces: list[bytes]) -> tuple[list[Message], list[str]]:
    """Return all messages and refusals of a stream that comes in pieces."""
    memory, messages, refused = format_.start(), list[Message](), list[str]()
    for piece in pieces:
        decoded = format_.decode(memory, piece)
        memory = decoded.memory
        messages += decoded.messages
        refused += decoded.refused
    rest: Decoded = format_.end(memory)
    return [*messages, *rest.messages], [*refused, *rest.refused]


def seen(message: Message) -> tuple[object, ...]:
    return (message.sensor, message.time, message.axes, message.z.tolist(), message.marker, message.angle, message.number)


def report(**changed: object) -> TrackReport:
    parts: dict[str, object] = {
        "number": 7,
        "time": 4000.25,
        "space": PLANE,
        "ids": np.array([3, 70001]),
        "mean": np.array([[100.0, 5.0, -2000.5, 3.0], [-1e5, 0.25, 250.0, -40.0]]),
        "cov": np.tile(np.diag([4.0, 1.0, 9.0, 1.0]), (2, 1, 1)),
        "existence": np.array([0.99, 0.5]),
        "confirmed": np.array([True, False]),
    }
    return TrackReport(**{**parts, **changed})  # type: ignore[arg-type]


@pytest.mark.parametrize("name", [*FORMATS, "asterix"])
@given(data=st.data())
@settings(max_examples=30, deadline=None)
@pytest.mark.by_turns
def test_where_a_stream_is_split_changes_nothing(name: str, data: st.DataObject) -> None:
    format_, whole = (Asterix(), asterix_blocks()) if name == "asterix" else FORMATS[name]
    cuts = sorted(data.draw(st.lists(st.integers(0, len(whole)), max_size=6)))
    pieces = [whole[i:j] for i, j in zip([0, *cuts], [*cuts, len(whole)], strict=True)]
    messages, refused = through(format_, pieces)
    expected, _ = through(format_, [whole])
    assert [seen(message) for message in messages] == [seen(message) for message in expected]
    assert not refused
    assert messages


@pytest.mark.parametrize("name", [*FORMATS, "asterix"])
@given(data=st.data())
@settings(max_examples=60, deadline=None)
@pytest.mark.by_turns
def test_no_bytes_make_a_decoder_raise(name: str, data: st.DataObject) -> None:
    format_, whole = (Asterix(), asterix_blocks()) if name == "asterix" else FORMATS[name]
    noise = data.draw(st.one_of(st.binary(max_size=300), st.just(whole)))
    for at, value in data.draw(st.lists(st.tuples(st.integers(0, 10_000), st.integers(0, 255)), max_size=8)):
        noise = noise[: at % (len(noise) + 1)] + bytes([value]) + noise[at % (len(noise) + 1) + 1 :]
    messages, refused = through(format_, [noise])
    assert all(isinstance(told, str) and "\n" not in told for told in refused)
    assert all(np.isfinite(message.z).all() for message in messages if name != "json")


def test_json_lines_that_are_refused_are_told_and_counted() -> None:
    bad = [
        b"[1, 2]", b'{"time": 1.0}', b'{"z": [[1, true]]}', b'{"z": [[1, "2"]]}', b'{"z": [[1], [2, 3]]}', b'{"z": 3}',
        b'{"z": [], "n": -1}', b'{"z": [], "time": "now"}', b'{"z": [], "colour": 3}', b'{"z": [[1, 2]], "axes": ["x"]}',
        b'{"z": [], "marker": "south"}', b'{"z": [[1, 2]], "evidence": []}', b"\xff\xfe",
        b'{"z": [], "pose": {"position": [1]}}',
    ]  # fmt: skip
    messages, refused = through(JsonLines(), [b"\n".join([*bad, JSON[0].strip()]) + b"\n"])
    assert len(refused) == len(bad)
    assert [message.number for message in messages] == [3]


def test_a_line_without_end_costs_one_refusal_and_bounded_memory() -> None:
    format_ = JsonLines()
    memory, refused = format_.start(), 0
    for _ in range(40):
        decoded = format_.decode(memory, b"x" * 2**16)
        memory, refused = decoded.memory, refused + len(decoded.refused)
        assert len(memory.data) <= 2**20
    decoded = format_.decode(memory, b"\n" + JSON[0])
    assert (refused, len(decoded.messages)) == (1, 1)


def test_ais_gives_positions_and_passes_over_the_rest() -> None:
    messages, refused = through(Nmea(), [b"".join(SENTENCES), b"$GPGGA,1,2*00\r\n"])
    assert not refused
    assert [message.axes for message in messages] == [
        ("latitude", "longitude", "speed", "course"),
        ("latitude", "longitude"),
    ]
    np.testing.assert_allclose(messages[0].z[0, :3], [37.802118, -122.341618, 0.0], atol=1e-6)  # as gpsd decodes it


TAGGED = b"\\g:1-2-73874,n:157036,s:r003669945,c:1241544035*4A\\!AIVDM,1,1,,B,15N4cJ`005Jrek0H@9n`DW5608EP,0*13\r\n"
"""As published in gpsd's guide to AIVDM."""


def test_a_tag_block_tells_the_time_of_a_report_where_it_is_asked_for() -> None:
    ((message,), refused) = through(Nmea(tagged=True), [TAGGED])
    assert (message.time, refused) == (1241544035.0, [])
    assert through(Nmea(), [TAGGED])[0][0].time is None
    untold = SENTENCES[0].strip()
    for tag in (b"", b"2023-11-14T22:13:20 ", b"\\s:a*12\\"):  # a logger's time, no time
        assert through(Nmea(tagged=True), [tag + untold + b"\n"])[0][0].time is None
    in_ms = b"c:1241544035250,s:a"
    tag = b"\\%s*%02x\\" % (in_ms, reduce(xor, in_ms, 0))
    assert through(Nmea(tagged=True), [tag + untold + b"\n"])[0][0].time == 1241544035.25


@pytest.mark.parametrize("wrong", [(b"*4A", b"*4B"), (b"*4A", b""), (b"c:12", b"c:-2"), (b"c:12", b"c:\xff2")])
def test_a_corrupted_tag_block_is_refused_with_its_report(wrong: tuple[bytes, bytes]) -> None:
    messages, (told,) = through(Nmea(tagged=True), [TAGGED.replace(*wrong)])
    assert not messages
    assert "TAG block" in told


PUBLISHED = {  # by gpsd's guide to AIVDM and its sample log
    b"!AIVDM,1,1,,B,177KQJ5000G?tO`K>RA1wUbN0TKH,0*5C": (477553000, 47.582833, -122.345833, 0.0, 51.0),
    b"!AIVDM,1,1,,A,15RTgt0PAso;90TKcjM8h6g208CQ,0*4A": (371798000, 48.381633, -123.395383, 12.3, 224.0),
    b"!AIVDM,1,1,,A,16SteH0P00Jt63hHaa6SagvJ087r,0*42": (440348000, 43.08015, -70.7582, 0.0, 93.4),
    b"!AIVDM,1,1,,B,25Cjtd0Oj;Jp7ilG7=UkKBoB0<06,0*60": (356302000, 40.392358, -71.626143, 13.9, 87.7),
    b"!AIVDM,1,1,,A,38Id705000rRVJhE7cl9n;160000,0*40": (563808000, 36.91, -76.327533, 0.0, 252.0),
}


@pytest.mark.parametrize("line", PUBLISHED)
def test_published_sentences_are_read_as_published(line: bytes) -> None:
    mmsi, latitude, longitude, speed, course = PUBLISHED[line]
    ((message,), refused) = through(Nmea(), [line + b"\n"])
    assert not refused
    np.testing.assert_allclose(message.z[0, :2], [latitude, longitude], atol=6e-7)
    np.testing.assert_allclose(message.z[0, 2:], [speed * 1852 / 3600, np.deg2rad(course)], rtol=1e-9)
    assert message.identity is not None
    assert label(int(message.identity[0])) == str(mmsi)


@pytest.mark.costly
def test_a_published_radar_plot_is_read_as_published() -> None:
    """The sample of category 048 of Croatia Control's decoder, whose values other decoders print too."""
    pytest.importorskip("asterix.generated")
    sample = "300030fdf70219c9356d4da0c5aff1e0020005283c660c10c236d4182001c0780031bc0000400deb07b9582e410020f5"
    ((message,), refused) = through(Asterix(), [bytes.fromhex(sample)])
    assert not refused
    assert (message.sensor, message.time, message.axes) == ("25/201", 27354.6015625, ("range", "azimuth", "altitude"))
    np.testing.assert_allclose(message.z, [[197.68359375 * 1852.0, np.deg2rad(340.13671875), 33000 * 0.3048]], rtol=1e-12)
    assert message.identity is not None
    assert label(int(message.identity[0])) == "3c660c"


def test_published_tracks_are_read_as_published() -> None:
    """The sample of category 062 of the same decoder, with a block of category 065 behind it that is passed over."""
    pytest.importorskip("asterix.generated")
    sample = (
        "3e00b7bfcffd021964043c5fd5007f3e9b0025188df8b42afcc2fcff3302a8000008be137411030118701d00ff2890000002741b100274ffb9dc"
        "190dbab0b880027408be40bfdfff021964043c5fea008123dc002b0ba6fdc917fee5eb0236fd550000055dc1203c0a554d8134df2ce020f61f29"
        "0d13010870040000009000000578161205780000ffe10019645358443437323341be122d44423733384d4544444c48454c582000200578dc190d"
        "5d32c10b0578055da041000cf8196402043c608718"
    )
    (first, second), refused = through(Asterix(), [bytes.fromhex(sample)])
    assert not refused
    assert (first.sensor, first.time) == ("25/100", 30911.6640625)
    place = ("latitude", "longitude")
    assert first.axes == (*place, "altitude", "east_speed", "north_speed")
    assert second.time == 30911.828125
    went = np.array([43300 * 0.3048, -51.25, 170.0])  # its item 130 is 0x1b10, in 6.25 ft
    np.testing.assert_allclose(first.z, [[44.73441302776337, 13.0415278673172, *went]], rtol=1e-12)
    np.testing.assert_allclose(second.z[:, :2], [[45.40080785751343, 15.13318419456482]], rtol=1e-12)
    ((by_pressure, _), _) = through(Asterix(heights="pressure"), [bytes.fromhex(sample)])
    np.testing.assert_allclose(by_pressure.z[0, 2], 15700 * 0.3048, rtol=1e-12)  # items 136 and 135


def test_published_sectors_and_plots_of_category_001_are_read_as_their_bytes_say() -> None:
    """Samples of the same project: a sector; three plots, in 1/128 NM and 360 / 2^16 deg, as the standard has it."""
    pytest.importorskip("asterix.generated")
    ((sector,), refused) = through(Asterix(), [bytes.fromhex("220010f6190e023a692b408840408000")])
    assert not refused
    assert (sector.sensor, sector.time, sector.marker) == ("25/14", 0x3A692B / 128, "sector")
    assert sector.angle == pytest.approx(2 * np.pi * 0x40 / 256)
    plots = (
        "010048f7c619c9a00eb2767f189408aa42d8033405c8800d400ef7c619c9b00f7561ec1a14077eb5550e5205508014400e"
        "f7c619c9b00dca69de1a7c07f011110e3006188016400e"
    )
    (messages, refused) = through(Asterix(), [bytes.fromhex(plots)])
    assert not refused
    assert {message.sensor for message in messages} == {"25/201"}
    polar = np.array([[0x767F / 128 * 1852, 0x1894], [0x61EC / 128 * 1852, 0x1A14], [0x69DE / 128 * 1852, 0x1A7C]])
    polar[:, 1] *= 2 * np.pi / 2**16
    seen = np.concatenate([message.z for message in messages])
    np.testing.assert_allclose(seen[:, :2], polar, rtol=1e-12)
    np.testing.assert_allclose(seen[:, 2], np.array([37000, 34000, 39000]) * 0.3048)  # 0x5c8, 0x550 and 0x618, in 25 ft


def test_ais_that_is_wrong_is_refused() -> None:
    wrong = SENTENCES[0].replace(b"*5C", b"*5D")
    for line in (wrong, b"!AIVDM,1,1,,B,15M67FC000G\n", b"hello\n", b"!AIVDM,2,3,4,A,0,0*1F\n"):
        messages, refused = through(Nmea(), [line])
        assert (len(messages), len(refused)) == (0, 1), line


def test_ais_that_is_cut_short_is_refused() -> None:
    pyais = pytest.importorskip("pyais")
    line = b"AIVDM,1,1,,A,15NPO,0"
    sentence = b"!%s*%02X\r\n" % (line, reduce(xor, line))
    assert pyais.decode(sentence).lat is None
    decoded = Nmea().decode(Nmea().start(), sentence)
    assert (list(decoded.messages), list(decoded.refused)) == ([], ["is cut short"])


def test_asterix_names_sensors_and_finds_positions_times_and_marks() -> None:
    messages, refused = through(Asterix(), [asterix_blocks()])
    assert not refused
    assert {message.sensor for message in messages} == {"2/17"}
    assert [message.marker for message in messages] == ["north", "", "", "sector", ""]
    np.testing.assert_allclose(messages[1].z, [[18520.0, np.pi / 4]])
    assert (messages[1].axes, messages[1].time, messages[1].period) == (("range", "azimuth"), 3600.5, 86400.0)
    assert messages[3].angle == pytest.approx(np.pi / 2)
    assert (messages[4].time, messages[4].period) == (8.0, 512.0)
    np.testing.assert_allclose(messages[4].z, [[18520.0, np.pi / 4]])


def test_tracks_written_as_asterix_read_back() -> None:
    pytest.importorskip("asterix.generated")
    written = report(geodetic=lambda mean: (mean[:, 0] / 1e5, mean[:, 2] / 1e5, mean[:, 0]))
    messages, refused = through(Asterix(sac=1, sic=2), [Asterix(sac=1, sic=2).encode(written)])
    assert not refused
    assert [message.time for message in messages] == [4000.25] * 2
    place = ("latitude", "longitude")
    assert messages[0].axes == (*place, "east_speed", "north_speed")
    np.testing.assert_allclose(messages[0].z[:, :2], [[0.001, -0.020005]], atol=180 / 2**25)
    messages, _ = through(Asterix(), [Asterix().encode(report())])
    np.testing.assert_allclose([message.z[0] for message in messages], written.mean[:, [0, 2, 1, 3]], atol=0.25)


@pytest.mark.parametrize("frame", FRAMES)
def test_tracks_written_as_asterix_are_read_back_with_velocity_and_height(frame: str) -> None:
    """Velocities were written and never read, and heights not written."""
    pytest.importorskip("asterix.generated")
    origin, space = Origin(52.0, 5.0), Space.of(x="m", y="m", z="m", vx="m/s", vy="m/s")
    mean = np.array([[3e4, -4e4, 9000.0, 200.0, -30.0]])
    ground = east_north(frame)

    def geodetic(mean: Array) -> tuple[Array, Array, Array]:
        return origin.from_plane(*(mean[:, space.names.index(name)] for name in (*ground, "z")))

    (told,), _ = through(Asterix(), [Asterix().encode(
        report(space=space, mean=mean, ids=np.array([1]), confirmed=np.array([True]), geodetic=geodetic, ground=ground)
    )])  # fmt: skip
    sensor = LinearSensor(space.names, np.eye(5))
    (seen,) = Placing({"0/0": sensor}, {}, origin, frame).returns(told, "0/0")
    np.testing.assert_allclose(seen, mean[0], atol=1.5)


def test_heights_and_doppler_speeds_of_plots_are_read_where_they_are_valid() -> None:
    gen = pytest.importorskip("asterix.generated")
    plots, reports = gen.Cat_048_1_32, gen.Cat_021_2_6
    codes, place = (("SAC", 2), ("SIC", 17)), (("RHO", (10.0, "NM")), ("THETA", (45.0, "°")))

    def seen(category: Any, heights: str, **items: Any) -> dict[str, float]:
        record = category.cv_record.create({"010": codes, **{name[1:]: item for name, item in items.items()}})
        ((message,), refused) = through(Asterix(heights=heights), [category.create([record]).unparse().to_bytes()])
        assert not refused
        assert message.axes is not None
        return dict(zip(message.axes[2:], message.z[0, 2:].tolist(), strict=True))

    either, pressure, level = "geometric or pressure", "pressure", ("FL", (360.0, "FL"))
    for heights, flag, wanted in ((either, 0, {"altitude": 36000 * 0.3048}), (pressure, 1, {}), ("geometric", 0, {})):
        told = seen(plots, heights, i040=place, i090=(("V", 0), ("G", flag), level))
        assert told == pytest.approx(wanted)
    for doubtful, wanted in ((0, {"range_rate": -23.0}), (1, {})):
        doppler = {"CAL": (("D", doubtful), 0, ("CAL", (-23.0, "m/s")))}
        assert seen(plots, either, i040=place, i120=doppler) == wanted
    aircraft = {"i130": (("LAT", (52.0, "°")), ("LON", (5.0, "°"))), "i140": (35000.0, "ft"), "i145": (360.0, "FL")}
    for heights, feet in ((either, 35000), (pressure, 36000)):
        moving = {"i160": (("RE", 0), ("GS", (0.0625, "NM/s")), ("TA", (90.0, "°")))}
        wanted = {"altitude": feet * 0.3048, "speed": 0.0625 * 1852, "course": np.pi / 2}
        assert seen(reports, heights, **aircraft, **moving) == pytest.approx(wanted)


@pytest.mark.parametrize(
    ("time", "written"), [(86399.99, 86399.9921875), (86399.999, 0.0), (-1e-9, 0.0), (3 * 86400.0, 0.0)]
)
def test_no_time_of_day_is_that_of_midnight_after_it(time: float, written: float) -> None:
    """24 hours, which there are not in item 070, were written in the last 4 ms of a day."""
    pytest.importorskip("asterix.generated")
    messages, refused = through(Asterix(), [Asterix().encode(evolve(report(), time=time))])
    assert ([message.time for message in messages], refused) == ([written] * 2, [])


def test_a_place_that_asterix_cannot_write_is_left_out() -> None:
    """5,000 km east was written as 3,389 km west."""
    pytest.importorskip("asterix.generated")
    near, far = np.array([[5e5, 0.0, -4e6, 0.0], [5e6, 9000.0, 0.0, 0.0]])
    told = evolve(report(), mean=np.array([near, far]))
    messages, refused = through(Asterix(), [Asterix().encode(told)])
    assert ([message.z.tolist() for message in messages], refused) == ([[near[[0, 2, 1, 3]].tolist()]], [])
    everywhere = evolve(told, geodetic=lambda mean: (mean[:, 0] / 1e5, mean[:, 2] / 1e5, mean[:, 0]))
    messages, _ = through(Asterix(), [Asterix().encode(everywhere)])
    np.testing.assert_allclose([message.z[0, 0] for message in messages], [5.0, 50.0], atol=180 / 2**25)


@pytest.mark.parametrize("format_", [Nmea(sentence="TTM"), Asterix()])
def test_tracks_whose_x_points_north_are_written_as_those_whose_x_points_east(format_: Format) -> None:
    if isinstance(format_, Asterix):
        pytest.importorskip("asterix.generated")
    turned = report(ground=("y", "x"), mean=report().mean[:, [2, 3, 0, 1]])
    assert format_.encode(turned) == format_.encode(report())


def test_tracks_written_as_sentences_read_back() -> None:
    lines = Nmea(sentence="TTM").encode(report()).decode().splitlines()
    parts = [line.partition("*")[0].split(",") for line in lines]
    far, bearing = np.array([[float(part[2]), float(part[3])] for part in parts]).T
    np.testing.assert_allclose(far, np.hypot(*report().mean[:, [0, 2]].T) / 1852.0, atol=0.005)
    np.testing.assert_allclose(bearing, np.rad2deg(np.arctan2(*report().mean[:, [0, 2]].T)) % 360, atol=0.051)
    assert [part[12] for part in parts] == ["T", "Q"]
    placed = report(geodetic=lambda mean: (np.array([59.5, -0.25]), np.array([-10.125, 170.0]), mean[:, 0]))
    first = Nmea().encode(placed).decode().splitlines()[0].split(",")
    assert first[2:6] == ["5930.0000", "N", "01007.5000", "W"]
    with pytest.raises(ValueError, match="origin"):
        Nmea().encode(report())


def test_tracks_written_as_json_and_geojson_read_back() -> None:
    placed = report(geodetic=lambda mean: (np.array([59.5, -0.25]), np.array([-10.125, 170.0]), mean[:, 0]))
    told = json.loads(JsonLines().encode(placed))
    assert [track["id"] for track in told["tracks"]] == [3, 70001]
    assert [track["x"] for track in told["tracks"]] == placed.mean[:, 0].tolist()
    assert told["tracks"][0]["sigma"] == {"x": 2.0, "vx": 1.0, "y": 3.0, "vy": 1.0}
    places = json.loads(GeoJson().encode(placed))
    assert [feature["geometry"]["coordinates"] for feature in places["features"]] == [[-10.125, 59.5], [170.0, -0.25]]


def test_csv_lines_are_read_as_a_csv_source_reads_a_table() -> None:
    """Dates, decimal commas and a header of other words were refused."""
    format_ = CsvLines(columns=("time", "range", "bearing"), separator=";", decimal=",", dates="%d.%m.%Y %H:%M:%S")
    head = b"\xef\xbb\xbf# Turm 3\nZeit;Entfernung;Peilung\n"
    for row in (b"30.11.2026 06:00:01;900,5;0,25", b"1796018401,0;900,5;0,25"):
        given = evolve(format_, dates=format_.dates if b"." in row else "")
        messages, refused = through(given, [head[:5], head[5:] + row + b"\n# late\nZeit;Entfernung;Peilung\n"])
        assert [(message.time, message.z.tolist()) for message in messages] == [(1796018401.0, [[900.5, 0.25]])]
        assert len(refused) == 2
    plain = CsvLines(columns=("time", "range", "bearing"))
    messages, refused = through(plain, [b"2026-11-30T06:00:01Z,900,0\n08:00:01.5,900,0\n30.11.2026,900,0\n"])
    assert [(message.time, message.period) for message in messages] == [(1796018401.0, None), (28801.5, 86400.0)]
    assert len(refused) == 1
    for wrong, place in (({"decimal": ","}, "decimal"), ({"dates": "%H:%M"}, "dates")):
        with pytest.raises(ValueError, match=place):
            CsvLines(columns=("time", "x"), **wrong)


def test_csv_units_and_empty_looks() -> None:
    format_ = CsvLines(columns=("time", "range", "bearing"), units={"range": "NM", "bearing": "deg"})
    messages, refused = through(format_, [b"1.0,2.0,90\n2.0,,\n3.0,1_0,5\n4.0,1.0\n"])
    np.testing.assert_allclose(messages[0].z, [[3704.0, np.pi / 2]])
    assert messages[1].z.shape == (0, 2)
    assert len(refused) == 2
    for wrong in ({"range": "parsec"}, {"speed": "kn"}):
        with pytest.raises(ValueError, match="units"):
            CsvLines(columns=("time", "range"), units=wrong)
