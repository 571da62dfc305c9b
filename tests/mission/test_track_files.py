"""Reading flown tracks: the forms that receivers and loggers write."""

import numpy as np
import pytest

from tests.mission.track_texts import TIMES, gpx, points, read, table


@pytest.mark.parametrize(
    ("header", "row"),
    [
        ("time_s,lat,lon,alt_m", "{t},{lat},{lon},{h}"),
        ("Timestamp (UTC);Latitude [deg];Longitude [deg];Altitude (m)", "{unix};{lat};{lon};{h}"),
        ("TIME\tLAT\tLNG\tELE", "{t}\t{lat}\t{lon}\t{h}"),
        ("time|GPS Latitude|GPS Longitude|GPS Altitude", "{t}|{lat}|{lon}|{h}"),
        ("timestamp_ms,latitude,longitude,altitude_ft", "{unix}000,{lat},{lon},1640.4199"),
        ("timestamp,latitude,longitude,altitudeFt", "{unix}000,{lat},{lon},1640.4199"),
        ("# time, lat, lon, altitude", "{t}, {lat}, {lon}, {h}"),
        (
            "time,icao24,lat,lon,velocity,heading,vertrate,onground,baroaltitude,geoaltitude",
            "{unix},3c6589,{lat},{lon},40.0,0.0,0,False,500,548",
        ),
        ("Timestamp,UTC,Callsign,Position,Altitude,Speed,Direction", '{unix},x,DHABC,"{lat},{lon}",1640.4199,77.75,0'),
        ("now,hex,timestamp,lat,lon,alt_baro,gs,track", "1,3c6589,{unix},{lat},{lon},1640.4199,77.75,360"),
        ("time,lat,lon,alt (feet),groundspeed_kt,course", "{t},{lat},{lon},1640.4199,77.75,0.0"),
        ("time,lat,lon,elevation,accuracy,bearing,speed", "{t},{lat},{lon},500,3,0,40"),
        ("time,lat,lon,altitude,speed (km/h)", "{t},{lat},{lon},500,144"),
        ("time,lat,lon,altitude,speed_mph", "{t},{lat},{lon},500,89.4775"),
    ],
)
def test_columns_and_units_are_recognised(tmp_path, header, row):
    track = read(tmp_path, table(header, row))
    np.testing.assert_allclose(track.time, TIMES, atol=1e-6)
    np.testing.assert_allclose(track.latitude_deg, 47 + 3.6e-4 * np.array(TIMES), atol=1e-9)
    np.testing.assert_allclose(track.longitude_deg, 8.0)
    np.testing.assert_allclose(track.altitude, 500.0, atol=1e-3)
    if track.ground_speed is not None:
        np.testing.assert_allclose(track.ground_speed, 40.0, atol=3e-3)
    assert (track.begin != "") == ("unix" in row)


@pytest.mark.parametrize(
    ("header", "row", "words"),
    [
        ("time,lat,lon,altitude", "{t},{lat},{lon},500", "column 'altitude' names no unit: metres assumed"),
        ("time,lat,lon,alt_baro", "{t},{lat},{lon},500", "column 'alt_baro' names no unit: feet assumed"),
        ("time,lat,lon,alt_m,gs", "{t},{lat},{lon},500,70", "column 'gs' names no unit: knots assumed"),
        (
            "time,lat,lon,alt_m,speed",
            "{t},{lat},{lon},500,40",
            "column 'speed' names no unit: metres per second assumed",
        ),
        ("time,Position,Altitude", '{t},"{lat},{lon}",500', "column 'Altitude' names no unit: feet assumed"),
    ],
)
def test_an_assumed_unit_is_said(tmp_path, header, row, words):
    assert words in read(tmp_path, table(header, row)).notes


def test_a_unit_in_the_name_is_not_an_assumption(tmp_path):
    assert read(tmp_path, table("time_s,lat,lon,altitude_m,groundspeed_kt", "{t},{lat},{lon},500,70")).notes == ()


@pytest.mark.parametrize(
    ("stamps", "begin"),
    [
        (["2024-05-17T10:00:00Z", "2024-05-17T10:00:30Z", "2024-05-17T10:01:00.500Z"], "2024-05-17 10:00:00 UTC"),
        (
            ["2024-05-17 12:00:00+02:00", "2024-05-17 12:00:30+02:00", "2024-05-17 12:01:00.5+02:00"],
            "2024-05-17 10:00:00 UTC",
        ),
        (["2024/05/17 10:00:00", "2024/05/17 10:00:30", "2024/05/17 10:01:00.500"], "2024-05-17 10:00:00 UTC"),
        (["1715940000", "1715940030", "1715940060.5"], "2024-05-17 10:00:00 UTC"),
        (["1715940000000", "1715940030000", "1715940060500"], "2024-05-17 10:00:00 UTC"),
        (["23:59:30", "00:00:00", "00:00:30.5"], ""),
        (["7", "37", "67.5"], ""),
    ],
)
def test_forms_of_time(tmp_path, stamps, begin):
    rows = "".join(f"{stamp},47.0,8.0,500\n" for stamp in stamps)
    track = read(tmp_path, "time,lat,lon,alt\n" + rows)
    np.testing.assert_allclose(track.time, [0.0, 30.0, 60.5], atol=1e-5)
    assert track.begin == begin


def test_a_date_column_belongs_to_the_time_of_day(tmp_path):
    track = read(tmp_path, "date,time,lat,lon,alt\n2024-05-17,23:59:59,47,8,500\n2024-05-18,00:00:01,47,8,500\n")
    np.testing.assert_allclose(track.time, [0.0, 2.0])
    assert track.begin == "2024-05-17 23:59:59 UTC"


@pytest.mark.parametrize(
    "content",
    [
        b"\xef\xbb\xbf" + table().encode(),
        table().replace("\n", "\r\n").encode(),
        table().encode("utf-16"),
        ("pilot,time,lat,lon,alt\n" + "".join(f"J\xe9r\xf4me,{t},{47 + t * 1e-4},8,500\n" for t in TIMES)).encode(
            "latin-1"
        ),
        table("time;lat;lon;alt", "{t},5;47,1;8,0;500,0").encode(),
        ("a report of flight 7\n\n" + table()).encode(),
        table().replace("\n", "\n\n").encode(),
    ],
)
def test_encodings_line_ends_decimal_commas_and_lines_before_the_headings(tmp_path, content):
    track = read(tmp_path, content)
    assert len(track) == len(TIMES) and np.ptp(track.time) == 95.0 and np.all(track.altitude == 500.0)


def test_pressure_altitude_is_preferred_and_the_fuller_column_taken(tmp_path):
    both = read(tmp_path, table("time,lat,lon,geoaltitude,baroaltitude", "{t},{lat},{lon},548,500"))
    assert np.all(both.altitude == 500.0)
    one = read(tmp_path, table("time,lat,lon,geoaltitude,baroaltitude", "{t},{lat},{lon},548,"))
    assert np.all(one.altitude == 548.0)


def test_the_time_of_the_position_is_preferred_to_that_of_the_message(tmp_path):
    track = read(tmp_path, table("time,lat,lon,baroaltitude,lastposupdate", "1700000500,{lat},{lon},500,{unix}.25"))
    np.testing.assert_allclose(track.time, TIMES, atol=1e-6)


def test_on_the_ground_is_read(tmp_path):
    content = table("time,lat,lon,alt_baro,gs", "{t},{lat},{lon},1000,70") + "100,47.04,8,ground,0\n"
    track = read(tmp_path, content)
    assert track.on_ground is not None and track.on_ground.tolist() == [False] * 20 + [True]
    assert np.isnan(track.altitude[-1])
    flagged = read(tmp_path, table("time,lat,lon,alt,onground", "{t},{lat},{lon},500,True"))
    assert flagged.on_ground is not None and flagged.on_ground.all()


def test_a_few_bad_rows_are_left_out_and_counted(tmp_path):
    content = table(times=range(100)) + "bad,47,8,500\n50,147,8,500\n60,,,\n"
    track = read(tmp_path, content)
    assert len(track) == 100
    assert "1 of 103 rows have no position: left out" in track.notes
    assert any(
        note.startswith("2 of 103 rows can not be read: left out, the first is line 102: time = 'bad'")
        for note in track.notes
    )


def test_gpx_tracks_are_joined_in_the_order_of_time_and_routes_stand_in(tmp_path):
    late, early = points(range(60, 100, 5)), points(range(0, 50, 5))
    body = f'<wpt lat="1" lon="2"/><trk><trkseg>{late}</trkseg></trk><trk><trkseg>{early}</trkseg><trkseg/></trk>'
    track = read(tmp_path, gpx(body), "flight.gpx")
    np.testing.assert_allclose(track.time, [*range(0, 50, 5), *range(60, 100, 5)])
    assert track.begin == "2024-05-17 10:00:00 UTC" and track.name == "flight"
    assert track.notes == ("1 waypoints: left out", "2 tracks, segments or routes: joined in the order of time")
    route = read(tmp_path, gpx(f"<rte>{points(tag='rtept')}</rte>"), "flight.gpx")
    assert len(route) == len(TIMES)
    assert len(read(tmp_path, gpx(), "without_suffix")) == len(TIMES)


def test_ground_instead_of_an_altitude(tmp_path):
    rows = [f"{t},{47 + 3.6e-4 * max(t - 20, 0):.6f},8,{'ground' if t < 20 else 1640}" for t in TIMES]
    track = read(tmp_path, "\n".join(["timestamp,lat,lon,alt_baro", *rows]))
    assert list(track.on_ground) == [t < 20 for t in TIMES]
    assert np.all(np.isnan(track.altitude) == track.on_ground)
