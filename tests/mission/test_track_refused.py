"""Files that are no flown tracks end in one line: file, line or field, value, what is allowed."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.mission.track_texts import gpx, points, read, table
from vrsopt.errors import InputError
from vrsopt.mission.track_file import LARGEST, read_track

HEAD = "time,latitude,longitude,altitude\n"
GOOD = "".join(f"{t},47.0,8.0,500\n" for t in range(5))
REFUSED = [
    ("empty.csv", b"", "empty: allowed: a flown track"),
    ("blank.csv", b" \n\n\t\n", "empty"),
    ("mark.csv", b"\xef\xbb\xbf", "no column recognised"),
    ("null.csv", b"\x00" * 100, "line 1: '\\x00': not text"),
    ("binary.csv", bytes(range(256)) * 20, "not text"),
    ("late_null.csv", (HEAD + GOOD).encode() + b"5,47,8,5\x0000\n", "line 7: '\\x00': not text"),
    ("halves.csv", b"\xff\xfe" + b"a" * 7, "not text in utf-16"),
    ("photo.gpx", b"\x89PNG\r\n\x1a\n" + bytes(50), "not text"),
    (
        "prose.csv",
        b"Dear Sir,\nI flew home.\n",
        "line 1: 'Dear Sir,': no column recognised, allowed: a row of headings: time",
    ),
    ("numbers.csv", GOOD.encode(), "line 1: '0,47.0,8.0,500': no column recognised"),
    ("header.csv", HEAD.encode(), "line 1: no rows after the headings: allowed: at least 2"),
    ("one.csv", (HEAD + "0,47,8,500\n").encode(), "1 rows with a position: allowed: at least 2"),
    (
        "no_time.csv",
        b"lat,lon,alt\n47,8,500\n",
        "line 1: column for time: missing among (lat, lon, alt), allowed: time,",
    ),
    ("no_lat.csv", b"time,lon,alt\n0,8,500\n", "column for latitude: missing among (time, lon, alt), allowed: lat"),
    ("no_lon.csv", b"time,lat,alt\n0,8,500\n", "column for longitude: missing"),
    ("no_alt.csv", b"time,lat,lon\n0,47,8\n", "column for altitude: missing among (time, lat, lon), allowed: altitude"),
    ("agl.csv", b"time,lat,lon,height_agl\n0,47,8,50\n", "column for altitude: missing"),
    ("only_line.csv", b"time,lat,lon,alt\n\n\n", "no rows after the headings"),
    ("sbs.csv", b"MSG,3,1,1,3C6589,1,2024/05/17,10:00:00.000,,,,1500,,,47.0,8.0,,,0,0,0,0\n", "no column recognised"),
    ("xml.csv", b"<gpx></gpx>", "line 1: '<': allowed: a table"),
    ("text_time.csv", (HEAD + "noon,47,8,500\n" * 3).encode(), "line 2: time = 'noon': allowed: seconds, Unix"),
    ("empty_time.csv", (HEAD + ",47,8,500\n" * 3).encode(), "line 2: time = '': allowed: seconds"),
    ("nan_time.csv", (HEAD + "nan,47,8,500\n" * 3).encode(), "line 2: time = 'nan': allowed"),
    ("inf_time.csv", (HEAD + "inf,47,8,500\n" * 3).encode(), "line 2: time = 'inf': allowed"),
    ("huge_time.csv", (HEAD + "1e300,47,8,500\n" * 3).encode(), "line 2: time = '1e300': allowed"),
    ("month13.csv", (HEAD + "2024-13-01T00:00:00,47,8,500\n" * 3).encode(), "line 2: time = '2024-13-01T00:00:00'"),
    ("hour25.csv", (HEAD + "25:00:00,47,8,500\n" * 3).encode(), "line 2: time = '25:00:00': allowed"),
    ("us_date.csv", (HEAD + "05/17/2024 10:00,47,8,500\n" * 3).encode(), "line 2: time = '05/17/2024 10:00'"),
    (
        "mixed_time.csv",
        (HEAD + "0,47,8,500\n10:00:00,47,8,500\n").encode(),
        "line 3: time = '10:00:00': allowed: times of",
    ),
    ("lat91.csv", (HEAD + "0,91,8,500\n" * 3).encode(), "line 2: latitude = '91': allowed: a number from -90 to 90"),
    (
        "lat_text.csv",
        (HEAD + "0,N47,8,500\n" * 3).encode(),
        "line 2: latitude = 'N47': allowed: a number from -90 to 90",
    ),
    ("lat_dms.csv", (HEAD + "0,47 12 30,8,500\n" * 3).encode(), "line 2: latitude = '47 12 30'"),
    ("lat_nan.csv", (HEAD + "0,nan,8,500\n" * 3).encode(), "line 2: latitude = 'nan': allowed"),
    ("lat_inf.csv", (HEAD + "0,-inf,8,500\n" * 3).encode(), "line 2: latitude = '-inf': allowed"),
    ("lat_huge.csv", (HEAD + "0,1e308,8,500\n" * 3).encode(), "line 2: latitude = '1e308': allowed"),
    ("lat_over.csv", (HEAD + "0,1e999,8,500\n" * 3).encode(), "line 2: latitude = '1e999': allowed"),
    ("lat_under.csv", (HEAD + "0,4_7,8,500\n" * 3).encode(), "line 2: latitude = '4_7': allowed"),
    ("lat_comma.csv", (HEAD + '0,"47,1",8,500\n' * 3).encode(), "line 2: latitude = '47,1': allowed"),
    (
        "lon181.csv",
        (HEAD + "0,47,181,500\n" * 3).encode(),
        "line 2: longitude = '181': allowed: a number from -180 to 180",
    ),
    ("lon_none.csv", (HEAD + "0,47,,500\n" * 3).encode(), "line 2: longitude = '': allowed"),
    ("lon_missing.csv", (HEAD + "0,47\n" * 3).encode(), "line 2: longitude = '': allowed"),
    ("nowhere.csv", (HEAD + "0,,,500\n" * 3).encode(), "0 rows with a position: allowed: at least 2"),
    (
        "alt_text.csv",
        (HEAD + "0,47,8,high\n" * 3).encode(),
        "line 2: altitude = 'high': allowed: a number from -1000 to",
    ),
    ("alt_unit.csv", (HEAD + "0,47,8,500 m\n" * 3).encode(), "line 2: altitude = '500 m': allowed"),
    ("alt_inf.csv", (HEAD + "0,47,8,inf\n" * 3).encode(), "line 2: altitude = 'inf': allowed"),
    (
        "alt_huge.csv",
        (HEAD + "0,47,8,1e9\n" * 3).encode(),
        "line 2: altitude = '1e9': allowed: a number from -1000 to 20000",
    ),
    (
        "alt_feet.csv",
        b"t,lat,lon,alt_ft\n" + b"0,47,8,99999\n" * 3,
        "line 2: alt_ft = '99999': allowed: a number from -3280.84",
    ),
    ("alt_none.csv", (HEAD + "0,47,8,\n1,47,8,\n").encode(), "altitude: no row has a value"),
    (
        "speed.csv",
        b"t,lat,lon,alt,speed\n" + b"0,47,8,5,fast\n" * 3,
        "line 2: speed = 'fast': allowed: a number from 0 to 500",
    ),
    (
        "speed_minus.csv",
        b"t,lat,lon,alt,gs\n" + b"0,47,8,5,-3\n" * 3,
        "line 2: gs = '-3': allowed: a number from 0 to 971.9",
    ),
    (
        "course.csv",
        b"t,lat,lon,alt,track\n" + b"0,47,8,5,720\n" * 3,
        "line 2: track = '720': allowed: a number from -360 to",
    ),
    ("position.csv", b"t,position,alt\n" + b"0,47;8,5\n" * 3, "line 2: position = '47;8': allowed: a number from -90"),
    ("quote.csv", (HEAD + '0,"47,8,500\n' * 3).encode(), "line 3: latitude = '47,8,500"),
    ("long.csv", (HEAD + "0,47,8," + "5" * 200_000 + "\n").encode(), "line 2: not a row of a table: field larger than"),
    ("wide.csv", (HEAD + "0," + "9" * 5000 + ",8,500\n" * 2).encode(), "line 2: latitude = '9999999"),
    (
        "two.csv",
        b"time,icao24,lat,lon,alt\n0,abc,47,8,5\n1,def,47,8,5\n",
        "icao24 = 'abc', 'def': 2 aircraft, allowed: the rows",
    ),
    (
        "calls.csv",
        b"time,callsign,lat,lon,alt\n0,A,47,8,5\n1,B,47,8,5\n2,C,47,8,5\n",
        "callsign = 'A', 'B', 'C': 3 aircraft",
    ),
    ("half.csv", (HEAD + GOOD + "x,47,8,500\n").encode(), "line 7: time = 'x': allowed: seconds"),
    ("text.gpx", b"not xml at all", "not a GPX file: "),
    ("cut.gpx", gpx()[:400].encode(), "not a GPX file: "),
    ("table.gpx", table().encode(), "not a GPX file: "),
    ("none.gpx", gpx("").encode(), "no track: allowed: a track (trk) or a route (rte) with points"),
    ("waypoints.gpx", gpx('<wpt lat="1" lon="2"/>').encode(), "no track: allowed"),
    ("hollow.gpx", gpx("<trk><trkseg/></trk>").encode(), "no track: allowed"),
    ("kml.gpx", b"<kml><Document/></kml>", "no track: allowed"),
    ("point.gpx", gpx(f"<trk><trkseg>{points([0])}</trkseg></trk>").encode(), "1 points: allowed: at least 2"),
    ("untimed.gpx", gpx(f"<trk><trkseg>{points(stamp='')}</trkseg></trk>").encode(), "time: 20 of 20 points have none"),
    ("flat.gpx", gpx(f"<trk><trkseg>{points(ele='')}</trkseg></trk>").encode(), "ele: no point has one"),
    (
        "twice.gpx",
        gpx(f"<trk><trkseg>{points()}</trkseg></trk>" * 2).encode(),
        "track 2 segment 1 begins before track 1",
    ),
    ("lat.gpx", gpx().replace('lat="47.000000"', 'lat="north"').encode(), "not a GPX file: "),
    ("nolat.gpx", gpx().replace('lat="47.000000"', "").encode(), "not a GPX file: "),
    ("lat91.gpx", gpx().replace('lat="47.000000"', 'lat="91"').encode(), "latitude_deg = 91: allowed: -90 to 90"),
    ("latnan.gpx", gpx().replace('lat="47.000000"', 'lat="nan"').encode(), "latitude_deg = nan: allowed: -90 to 90"),
    ("lon.gpx", gpx().replace('lon="8.0"', 'lon="-200"').encode(), "longitude_deg = -200: allowed: -180 to 180"),
    ("ele.gpx", gpx().replace("<ele>500", "<ele>high").encode(), "not a GPX file: "),
    ("ele_huge.gpx", gpx().replace("<ele>500", "<ele>1e9").encode(), "altitude = 1e+09: allowed: -1000 to 20000"),
    ("noon.gpx", gpx().replace("2024-05-17T", "noon").encode(), "time: 20 of 20 points have none that"),
    ("month.gpx", gpx().replace("2024-05", "2024-15").encode(), "time: 20 of 20 points have none that"),
    ("bomb.gpx", gpx().replace("<gpx", '<!DOCTYPE x [<!ENTITY a "b">]><gpx', 1).encode(), "document type declaration"),
    (
        "bomb16.gpx",
        gpx().replace("<gpx", '<!DoctypE x [<!ENTITY a SYSTEM "f">]><gpx', 1).encode("utf-16"),
        "document type",
    ),
    ("entity.gpx", gpx().replace("500", "&secret;").encode(), "not a GPX file: "),
]


@pytest.mark.parametrize(("name", "content", "words"), REFUSED, ids=[name for name, _, _ in REFUSED])
def test_what_is_no_track_is_refused_in_one_line(tmp_path, name, content, words):
    with pytest.raises(InputError) as caught:
        read(tmp_path, content, name)
    message = str(caught.value)
    assert message.startswith(str(tmp_path / name) + ": ") and words in message
    assert "\n" not in message and "allowed" in message or "not a GPX" in message or "not a row" in message
    assert len(message) < 600 + len(str(tmp_path))


def test_files_that_are_not_there(tmp_path):
    for path, words in (
        (tmp_path / "none.gpx", "no such file"),
        (tmp_path, "can not be read"),
        (tmp_path / ("n" * 300), "can not be read"),
        (tmp_path / "a\0b", "can not be read"),
    ):
        with pytest.raises(InputError, match=words) as caught:
            read_track(path)
        assert str(caught.value).count(str(path)) == 1 and str(caught.value).count(words) == 1


def test_a_file_too_large_is_not_read(tmp_path):
    path = tmp_path / "large.csv"
    with path.open("wb") as stream:
        stream.truncate(LARGEST + 1)
    with pytest.raises(InputError, match=f"allowed: at most {LARGEST}"):
        read_track(path)


def only_input_errors(path: Path, content: bytes) -> None:
    path.write_bytes(content)
    try:
        track = read_track(path)
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert len(track) >= 2 and np.isfinite(track.time).all() and np.abs(track.latitude_deg).max() <= 90.0


FUZZ = settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
CELLS = st.sampled_from(
    ["0", "1", "47", "8", "500", "", "nan", "1e400", "-", '"', "10:00:00", "2024-05-17", "\u00b2", "x"]
)


@FUZZ
@given(content=st.binary(max_size=300), name=st.sampled_from(["a.csv", "a.gpx", "a"]))
def test_any_bytes(tmp_path, content, name):
    only_input_errors(tmp_path / name, content)


@FUZZ
@given(rows=st.lists(st.lists(CELLS, max_size=6).map(",".join), max_size=12))
def test_any_cells(tmp_path, rows):
    only_input_errors(tmp_path / "a.csv", "\n".join(["date,time,lat,lon,alt,speed", *rows]).encode())


@FUZZ
@given(data=st.data())
def test_any_damage(tmp_path, data):
    name, text = data.draw(st.sampled_from([("a.csv", table()), ("a.gpx", gpx())]))
    content = bytearray(text.encode())
    for _ in range(data.draw(st.integers(1, 8))):
        at = data.draw(st.integers(0, len(content) - 1))
        size = data.draw(st.integers(0, 12))
        content[at : at + size] = data.draw(st.binary(max_size=8))
    only_input_errors(tmp_path / name, bytes(content))
