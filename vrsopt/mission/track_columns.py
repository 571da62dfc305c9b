"""What the columns of a recorded track mean, from their names: quantity and unit.

Case, spaces and punctuation do not count, and the unit may follow the name: ``altitude_ft``, ``Speed (km/h)``,
``groundspeedKt``. A name without a unit has the unit of the programs that use it, metres and metres per second
otherwise; the reader says so.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

FOOT = 0.3048  # m
KNOT = 1852.0 / 3600.0  # m/s
METRES = {"m": 1.0, "meter": 1.0, "meters": 1.0, "metre": 1.0, "metres": 1.0, "msl": 1.0, "mamsl": 1.0}
FEET = {"ft": FOOT, "feet": FOOT, "foot": FOOT, "ftmsl": FOOT, "ftamsl": FOOT}
UNITS: dict[str, dict[str, float]] = {
    "time": {
        **dict.fromkeys(("s", "sec", "secs", "second", "seconds", "utc", "gmt", "z", "iso", "iso8601", "unix"), 1.0),
        **dict.fromkeys(("ms", "msec", "millis", "milliseconds"), 1e-3),
    },
    "latitude": dict.fromkeys(("deg", "degree", "degrees", "wgs84"), 1.0),
    "longitude": dict.fromkeys(("deg", "degree", "degrees", "wgs84"), 1.0),
    "altitude": METRES | FEET | {"km": 1000.0},
    "ground_speed": {
        **dict.fromkeys(("ms", "mps", "meterspersecond", "metrespersecond"), 1.0),
        **dict.fromkeys(("kt", "kts", "kn", "knot", "knots"), KNOT),
        **dict.fromkeys(("kmh", "kph", "kmph"), 1 / 3.6),
        "mph": 1609.344 / 3600.0,
    },
    "course": dict.fromkeys(("deg", "degree", "degrees", "true", "degtrue", "t"), 1.0),
}
# the names of each quantity, the one to prefer first; times of the position come before times of the message
NAMES: dict[str, tuple[str, ...]] = {
    "time": (
        *("lastposupdate", "timeposition", "lastpositionupdatetime", "timestamp", "epoch", "unixtime", "snapshotid"),
        *("datetime", "isotime", "time", "gpstime", "utctime", "utc", "t", "elapsed", "elapsedtime", "seconds"),
        *("logtime", "timeofday", "fixtime"),
    ),
    "date": ("date", "utcdate", "gpsdate"),
    "latitude": ("latitude", "lat", "gpslatitude", "gpslat"),
    "longitude": ("longitude", "lon", "long", "lng", "gpslongitude", "gpslon", "gpslong", "gpslng"),
    "position": ("position", "latlon", "latlng", "latitudelongitude"),
    "altitude": (
        *("pressurealtitude", "pressurealt", "baroaltitude", "barometricaltitude", "altbaro", "baroalt", "palt"),
        *("altitude", "alt", "altitudemsl", "altmsl", "altitudeamsl", "elevation", "elev", "ele", "gpsaltitude"),
        *("gpsalt", "altgps", "geoaltitude", "geoalt", "altgeom", "geomaltitude", "gnssaltitude", "altgnss", "height"),
    ),
    "ground_speed": (
        *("groundspeed", "gndspeed", "gndspd", "gs", "speedoverground", "sog", "gpsspeed", "speed", "velocity", "spd"),
    ),
    "course": (
        *("course", "track", "truetrack", "trackangle", "courseoverground", "cog", "trk", "gpscourse", "direction"),
        *("bearing", "heading", "hdg"),
    ),
    "on_ground": ("onground", "isonground", "ground", "gnd"),
    "aircraft": ("icao24", "icao", "hex", "hexident", "icaoaddress", "registration", "reg", "aircraft", "aircraftid"),
    "flight": ("callsign", "flightid", "flight", "ident"),
}
# names that mean feet and knots without saying so: receivers of the dump1090 family
RECEIVER_NAMES = {"altbaro": FOOT, "altgeom": FOOT, "gs": KNOT, "sog": KNOT}
# a position in one cell, or a snapshot: Flightradar24, which writes feet and knots
FLIGHT_TRACKER = ("position", "snapshotid")
SAID = {FOOT: "feet", KNOT: "knots", 1.0: "metres"}


@dataclass(frozen=True)
class Column:
    """A recognised column: its index and heading, and the factor to SI units."""

    quantity: str
    index: int
    heading: str
    factor: float
    rank: int  # among the names of its quantity, 0 is to prefer
    assumed: str = ""  # the unit assumed, if the name does not say one

    @property
    def note(self) -> str:
        """What was assumed, in a sentence; empty if nothing."""
        unit = "metres per second" if (self.quantity, self.assumed) == ("ground_speed", "metres") else self.assumed
        return f"column '{self.heading}' names no unit: {unit} assumed" if unit else ""


def recognised(headings: Sequence[str]) -> dict[str, list[Column]]:
    """The columns found for each quantity, the one to prefer first.

    ``headings``: of the columns, as the file has them.
    """
    keys = [re.sub(r"[^a-z0-9]+", "", heading.lower()) for heading in headings]
    tracker = any(key in FLIGHT_TRACKER for key in keys)
    found: dict[str, list[Column]] = {}
    for index, (heading, key) in enumerate(zip(headings, keys, strict=True)):
        column = _column(index, heading.strip(), key, tracker)
        if column:
            found.setdefault(column.quantity, []).append(column)
    return {quantity: sorted(columns, key=lambda column: column.rank) for quantity, columns in found.items()}


def _column(index: int, heading: str, key: str, tracker: bool) -> Column | None:
    for quantity, names in NAMES.items():
        if key in names:
            factor, assumed = 1.0, ""
            if quantity in ("altitude", "ground_speed"):
                usual = {"altitude": FOOT, "ground_speed": KNOT}[quantity] if tracker else 1.0
                factor = RECEIVER_NAMES.get(key, usual)
                assumed = SAID[factor]
            return Column(quantity, index, heading, factor, names.index(key), assumed)
    for quantity, units in UNITS.items():
        names = NAMES[quantity]
        for unit, factor in units.items():
            if key.endswith(unit) and key.removesuffix(unit) in names:
                return Column(quantity, index, heading, factor, names.index(key.removesuffix(unit)))
    return None
