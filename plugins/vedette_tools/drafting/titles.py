"""What the titles of a table's columns mean: the axis, the unit, and whether they are of the sensors' own platform."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Iterable, Sequence
from functools import lru_cache
from itertools import zip_longest

from attrs import frozen

GRAD = "grad"
"""What a circle has 360 of in German and the languages of the north, and 400 in English and French: a gon."""

OF_360 = frozenset((
    "zeitstempel", "zeitpunkt", "zeit", "uhrzeit", "datum", "tidspunkt", "tid", "umlauf", "umdrehung",
    "radialgeschwindigkeit", "radialgeschw", "entfernung", "distanz", "abstand", "avstand", "afstand", "peilung",
    "peiling", "azimut", "breitengrad", "breite", "breddegrad", "langengrad", "laengengrad", "lange", "laenge",
    "lengdegrad", "hohe", "hoehe", "kurs", "geschwindigkeit", "fart", "rechtswert", "hochwert", "ostwert", "nordwert",
    "ost", "winkel",
))  # fmt: skip
"""Words of titles, without accents, in languages in which Grad is a degree."""

UNITS: dict[str, dict[str, str]] = {
    "m": {
        **dict.fromkeys(("m", "metre", "metres", "meter", "meters"), "m"),
        **dict.fromkeys(("km", "kilometres", "kilometers"), "km"),
        **dict.fromkeys(("nm", "nmi"), "NM"),
        **dict.fromkeys(("ft", "feet"), "ft"),
        **dict.fromkeys(("yd", "yds", "yards"), "0.9144 m"),
        "cm": "0.01 m",
        "mm": "0.001 m",
        **dict.fromkeys(("micron", "microns", "um", "µm"), "1e-6 m"),
    },
    "rad": {
        **dict.fromkeys(("deg", "degs", "degree", "degrees", "°"), "deg"),
        **dict.fromkeys(("rad", "rads", "radian", "radians"), "rad"),
        "gon": "0.9 deg",
        **dict.fromkeys(("grad", "grads"), GRAD),
        "mrad": "mrad",
        **dict.fromkeys(("mil", "mils"), "mil"),
        **dict.fromkeys(("acp", "acps"), "0.087890625 deg"),
        "e7": "1e-7 deg",
        **dict.fromkeys(("semicircle", "semicircles"), "8.381903171539307e-8 deg"),
    },
    "s": {
        **dict.fromkeys(("s", "sec", "secs", "seconds"), "s"),
        **dict.fromkeys(("ms", "msec", "millis", "milliseconds"), "ms"),
        **dict.fromkeys(("us", "usec", "microseconds", "µs"), "us"),
        **dict.fromkeys(("ns", "nsec", "nanoseconds"), "ns"),
        **dict.fromkeys(("min", "mins", "minutes"), "min"),
        **dict.fromkeys(("h", "hr", "hrs", "hours"), "h"),
        **dict.fromkeys(("d", "day", "days", "datenum", "mjd", "jd"), "86400 s"),
    },
    "m/s": {
        **dict.fromkeys(("kn", "kt", "kts", "knot", "knots"), "kn"),
        **dict.fromkeys(("mps", "m/s", "ms"), "m/s"),
        **dict.fromkeys(("kmh", "kph", "km/h"), "km/h"),
        "mph": "0.44704 m/s",
    },
}
"""Units as titles write them, by the SI unit of what they measure."""

BORNE = ("mmsi", "icao24", "icao", "hex", "callsign", "call_sign")
"""Titles of codes that objects send with what they report of themselves."""

SENT = BORNE[:3]
"""Codes whose titles may have other words before them: source_mmsi, sourcemmsi."""

ANSWERED = (
    "acaddr", "ac_addr", "aircraft_address", "target_address", "mode3a", "mode_3a", "mode_3_a", "squawk",
)  # fmt: skip
"""Titles, which may have other words before them, of codes that transponders answer to a radar; the last four are not of
one alone."""

NAMES = (
    *BORNE[:4], *ANSWERED[:4], "track_id", "object_id", "target_id", "ship_id", "vessel_id", "vehicle_id", "animal_id",
    "tag_id", "device_id", "user_id", "uid", "player_id", "player", "person_id", "individual_local_identifier", "imo", "id",
    *BORNE[4:], "registration", "tail_number", "flight", "shipname", "ship_name", "vessel_name", "vehicle", "particle",
    "trajectory_id", "trajectory", "trip_id", "tracker", "tag", "name",
    *ANSWERED[4:],
)  # fmt: skip
"""Titles of columns by which returns name their objects, the surest first."""

OBJECTS = frozenset(name.removesuffix("_id") for name in NAMES if name.endswith("_id"))
"""Words for objects, before an axis of where one is: vehicle_x."""

OTHER_IDS = frozenset((
    "frame", "scan", "sweep", "turn", "image", "scene", "sensor", "source", "station", "radar", "site", "camera", "cam",
    "event", "message", "msg", "detection", "det", "measurement", "plot", "point", "spot", "cluster", "parent", "row",
    "index", "class", "type", "category", "status", "group", "session", "study", "zone", "record", "file", "sat", "sats",
    "satellite", "satellites", "sv", "lap", "leg", "segment", "fix", "seq", "sequence", "quality", "line", "channel",
))  # fmt: skip
"""Words of titles whose id is not an object's, or not for long."""

OF_REPORTS = frozenset((
    *BORNE, "groundspeed", "groundspeed_kn", "sog", "sog_knots", "cog", "cog_degrees", "track_deg", "speedoverground",
    "courseoverground",
))  # fmt: skip
"""Titles of what objects report of themselves."""

OWN = ("own", "ownship", "own_ship", "platform", "ego", "ship", "vessel", "os", "self", "carrier", "boat")
"""Words that say a column is of the sensors' own platform."""

STANDS = ("sensor", "radar", "station", "site", "device")
"""Words that say so of a position alone: site_lat is where a radar stands, radar_range what it measures."""

COORDINATES = ("coordinates.0", "coordinates.1")
"""How the titles of a longitude and a latitude end in GeoJSON."""

IN_LISTS = re.compile(r"(.*\.)?(translation|position|location|center|centre|centroid|xyz?|pos|coord)\.([012])")
"""A title of a number of a list that is a position: translation.0 is x."""

PROPERTIES = "properties."
"""How titles of what GeoJSON tells beside positions begin."""

CENTRES = ("pos", "position", "pose", "center", "centre", "centroid", "p", "utm")
"""Words before an axis of a position, as of the middle of a box; frames may stand between, as in p_RS_R_x."""

COORDINATE = {*CENTRES, "coord", "coords", "coordinate", "coordinates", "loc", "location", "px", "pixel"} - {"p", "utm"}
"""Words of which one anywhere beside an x says that it is one: X_POSITION, cell x coordinate."""

SIZES = {"width", "length"}
"""Last words of titles beside which a height is the size of a box."""

SPOTS = ("latitude", "longitude", "altitude", "east", "north", "x", "y", "z")
PLACES = ("range", "bearing", "elevation", *SPOTS)
MOVING = (
    "v", "vel", "vrel", "velocity", "speed", "rate", "acc", "accel", "acceleration", "traveled", "travelled", "moved",
    "movement", "motion", "displacement", "orientation", "between",
)  # fmt: skip
"""Axes of places, where something stands or as a sensor sees it, and words of titles that name none, whatever else they
say: vrel_lat is a lateral speed, distance travelled, or between start and end, no range, angle of movement no bearing."""

AXES: dict[str, tuple[str, ...]] = {
    **{
        axis: tuple(words.split())
        for axis, words in {
            "time": "time timestamp times timestamps t utc datetime date ts epoch stamp tstamp tod to_d when clock "
            "zeitstempel zeitpunkt zeit uhrzeit datum horodatage temps heure fecha_hora fecha tiempo hora tempo tijd "
            "tidspunkt tid tst now position_t tracked_at recorded_at received_at created_at observed_at measured_at seen_at "
            "logged_at datenum mjd jd elapsed gpst gps_tow gps_sow sod dttm",
            "scan": "scan sweep turn frame timestep umlauf umdrehung",
            "range_rate": "range_rate doppler radial_velocity radial_speed rr radialgeschwindigkeit radialgeschw",
            "range": "range rng distance dist r rho entfernung distanz abstand distancia avstand",
            "bearing": "bearing brg azimuth az azi theta angle peilung azimut acimut gisement relevement marcacion peiling",
            "elevation": "elevation elev el",
            "latitude": "latitude lat breitengrad breite latitud latitudine breddegrad",
            "longitude": "longitude lon lng long langengrad laengengrad lange laenge longitud longitudine lengdegrad",
            "altitude": "altitude alt hohe hoehe altitud geoaltitude geo_altitude baroaltitude baro_altitude",
            "heading": "heading hdg yaw",
            "course": "course cog kurs rumbo",
            "vnorth": "vnorth vn v_north v_n velocity_north north_velocity speed_north north_speed",
            "veast": "veast ve v_east v_e velocity_east east_velocity speed_east east_speed",
            "vx": "vx v_x velocity_x x_velocity speed_x x_speed vel_x",
            "vy": "vy v_y velocity_y y_velocity speed_y y_speed vel_y",
            "speed": "speed sog velocity geschwindigkeit vitesse velocidad fart",
            "east": "east easting e utm_e rechtswert ostwert ost este",
            "north": "north northing n utm_n hochwert nordwert nord norte",
            "sensor": "sensor source device station radar site",
        }.items()
    },
    **{
        axis: (axis, *(f"{place}_{axis}" for place in CENTRES), f"c{axis}", f"{axis}c", f"t{axis}", f"p{axis}", *ahead)
        for axis, ahead in (("x", ("dist_long", "long_dist", "abscisse")), ("y", ("dist_lat", "lat_dist", "ordonnee")))
    },
    "z": ("z", "up", "height", *(f"{place}_z" for place in CENTRES), "cz", "zc", "tz", "pz"),
}
"""The words for each axis, the surest first: in English, then in German, French, Spanish and others, without accents."""

MEASURES = {
    "time": "s",
    **dict.fromkeys(("range", "altitude", "east", "north", "x", "y", "z"), "m"),
    **dict.fromkeys(("bearing", "elevation", "latitude", "longitude", "heading", "course"), "rad"),
    **dict.fromkeys(("range_rate", "vnorth", "veast", "vx", "vy", "speed"), "m/s"),
}
"""The SI unit of each axis that has one."""


@frozen
class Meaning:
    """What a title means: an axis ("" if none is known), a unit ("" if it states none), of the own platform or not.

    `unknown` is a unit that it states and nobody knows.
    """

    title: str
    axis: str
    unit: str
    own: bool
    sure: bool
    unknown: str = ""


@lru_cache(1024)
def meaning(title: str, below: str = "") -> Meaning:
    """Return what a title means; `below` is its cell in a row of units.

    >>> meaning("own_lat [deg]")
    Meaning(title='own_lat [deg]', axis='latitude', unit='deg', own=True, sure=True, unknown='')
    >>> meaning("SlantRangeMetres").axis, meaning("SlantRangeMetres").unit
    ('range', 'm')
    >>> meaning("range [cubits]").unknown
    'cubits'
    """
    if title.endswith(COORDINATES):
        return Meaning(title, "latitude" if title.endswith("1") else "longitude", "", False, True)
    if listed := IN_LISTS.fullmatch(title.lower()):
        return Meaning(title, "xyz"[int(listed[3])], "", False, not listed[1])
    bracket = re.search(r"[\[(]\s*([^\])]+?)\s*[\])]", title)
    stated = bracket[1] if bracket else below.strip("[]() ")
    stated = stated or ("e7" if title.lower().endswith("e7") else "NM" if "I040.RHO" in title.upper() else "")  # as ASTERIX
    plain = (title.replace(bracket[0], " ") if bracket else title).removeprefix(PROPERTIES)
    words = words_of(plain)
    axis, own, sure = _axis(words)
    unit = _unit(stated or "_".join(words), axis)
    if not unit and len(words) > 1:
        shorter = _axis(words[:-1])
        if last := _unit(words[-1], shorter[0]):
            (axis, own, sure), unit = shorter, last
    return Meaning(title, axis, unit, own, sure, "" if unit or axis not in MEASURES else stated)


def words_of(title: str) -> list[str]:
    """Return the words of a title, in small letters without accents."""
    plain = "".join(each for each in unicodedata.normalize("NFKD", title) if not unicodedata.combining(each))
    return [word.lower() for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|°", plain)]


def by_words_of(titles: Iterable[str]) -> dict[str, str]:
    """Return titles by their words, joined by underscores; of those alike the first."""
    found: dict[str, str] = {}
    for title in titles:
        found.setdefault("_".join(words_of(title)), title)
    return found


def _axis(words: Sequence[str]) -> tuple[str, bool, bool]:
    """Return the axis that words name, whether it is of the own platform, and whether that is sure."""
    own = any(word in OWN for word in words)
    whole = "_".join([word for word in words if word not in OWN] or words)
    for axis, names in AXES.items():
        if whole in names:
            return axis, own, True
    place = "_".join(word for word in words if word not in STANDS)
    for axis in SPOTS:
        if place in AXES[axis]:
            return axis, True, True
    letters = [word for word in words if word in ("x", "y", "z")]
    of_place = {*words[:1]} <= {*CENTRES} or "_".join(words[:-1]) in OBJECTS or COORDINATE & {*words}
    if len(letters) == 1 and of_place and not {*MOVING} & {*words}:
        return letters[0], own, False
    for axis, names in AXES.items():
        if axis == "sensor" and len(words) > 2:
            continue  # the type of a device is no sensor's name
        if axis in PLACES and any(word in MOVING for word in words):
            continue
        if any(re.search(rf"(^|_){name}(_|$)", whole) for name in names if len(name) > 2):
            return axis, own, False
    return "", own, False


def _unit(stated: str, axis: str) -> str:
    """Return the unit that a text states of an axis, as a config writes it; "" if it is none. "deg T" is in deg."""
    known = UNITS.get(MEASURES.get(axis, ""), {})
    plain = stated.lower().replace("\N{GREEK SMALL LETTER MU}", "\N{MICRO SIGN}")
    first, *_ = plain.split() or [""]
    return known.get(plain, known.get(first, ""))


def chosen(
    titles: Sequence[str], below: Sequence[str] = (), worded: Collection[str] = ()
) -> tuple[dict[str, Meaning], dict[str, Meaning]]:
    """Return the columns by axis: what the sensors measure, and what the own platform does. A sure title goes first, and
    one of `worded`, whose cells are mostly words or empty, after those that hold numbers; one titled x, y or z alone goes
    before all others of its axis, and a height beside a width and a length is a size.

    A heading is always the platform's. Positions that all say they are of a ship are what is measured, if nothing else is.
    """
    measured: dict[str, Meaning] = {}
    platform: dict[str, Meaning] = {}
    meanings = [meaning(title, stated) for title, stated in zip_longest(titles, below, fillvalue="")]
    last = {"".join(words_of(each.title)[-1:]) for each in meanings}
    meanings = [each for each in meanings if not (last >= SIZES and words_of(each.title)[-1:] == ["height"])]
    positions = {each.axis for each in meanings if not each.own} & {"range", "latitude", "x", "east"}

    def unsure(each: Meaning) -> tuple[bool, bool, bool]:
        letter = each.axis in ("x", "y", "z") and words_of(each.title)[:1] == [each.axis]
        return each.title in worded and each.axis in MEASURES, not each.sure, not letter

    for each in sorted(meanings, key=unsure):
        if each.axis:
            own = each.axis == "heading" or (each.own and bool(positions) and each.axis not in ("time", "scan", "sensor"))
            (platform if own else measured).setdefault(each.axis, each)
    return measured, platform
