"""Missions for tests, in a few words: places at stated distances from each other, and what is flown."""

from __future__ import annotations

from typing import Any

from vrsopt.mission.file import Mission, mission_from
from vrsopt.mission.profile import Profile
from vrsopt.mission.route import WGS84

HOME = (47.0, 8.0)
IDLE, HOVER = {"kind": "idle", "duration_s": 60.0}, {"kind": "hover", "duration_s": 30.0}


def place(away: float = 0.0, bearing: float = 0.0, elevation: float = 400.0) -> dict[str, float]:
    """A place ``away`` [m] from HOME on a bearing [deg]."""
    point = WGS84.Direct(*HOME, bearing, away)
    return {"latitude_deg": point["lat2"], "longitude_deg": point["lon2"], "elevation_m": elevation}


PLACES = {"home": place(), "north": place(12_000.0), "east": place(15_000.0, 90.0)}


def climb(altitude: float, speed: float = 40.0, angle: float = 7.12) -> dict[str, Any]:
    """A climb to ``altitude`` [m]."""
    return {"kind": "climb", "altitude_m": altitude, "speed_m_s": speed, "climb_angle_deg": angle}


def descent(altitude: float | None = None, speed: float = 40.0, angle: float = -7.12) -> dict[str, Any]:
    """A descent to ``altitude`` [m], or to the hover that follows."""
    stated = {} if altitude is None else {"altitude_m": altitude}
    return {"kind": "descent", "speed_m_s": speed, "climb_angle_deg": angle, **stated}


def cruise(to: str | None = None, speed: float = 50.0, **others: Any) -> dict[str, Any]:
    """A cruise, to a place or as ``others`` say."""
    return {"kind": "cruise", "speed_m_s": speed, **({} if to is None else {"to": to}), **others}


def data(*tasks: dict[str, Any], places: dict[str, Any] = PLACES, **others: Any) -> dict[str, Any]:
    """A mission from home, as its file would state it."""
    loading = {"empty_kg": 1300.0, "crew_kg": 170.0, "equipment_kg": {"load": 200.0}}
    stated = {"name": "test", "aircraft": "bo105", "start": "home", "places": places, "loading": loading}
    return {**stated, "tasks": list(tasks), **others}


def mission(*tasks: dict[str, Any], **others: Any) -> Mission:
    """A mission from home."""
    return mission_from(data(*tasks, **others), where="test")


def flown(*tasks: dict[str, Any], **others: Any) -> Profile:
    """The profile of a mission from home."""
    return Profile.of(mission(*tasks, **others))


AROUND = {"around": "north", "speed_m_s": 40.0, "turn_radius_m": 350.0}
FREE_SPEED = {"speed_range_m_s": [35.0, 45.0]}
AT_EAST = {**AROUND, "around": "east"}
# every kind of task and of pattern; the places are 12 to 20 km apart
TOUR = (
    IDLE,
    HOVER,
    {"kind": "vertical_climb", "height_m": 60.0, "climb_rate_m_s": 3.0},
    climb(600.0),
    climb(900.0, 50.0, 4.0),
    cruise("north", 55.0),
    {"kind": "loiter", "leg_m": 1500.0, "bearing_deg": 60.0, "duration_s": 420.0, **AROUND, **FREE_SPEED},
    {"kind": "mass_change", "mass_change_kg": -50.0},
    {"kind": "loiter", "pattern": "circle", "turns": "left", "duration_s": 300.0, **AROUND},
    {"kind": "speed_change", "speed_m_s": 60.0, "acceleration_m_s2": 0.6},
    cruise("east", 60.0),
    descent(700.0, 50.0, -5.0),
    {**AT_EAST, "kind": "search", "leg_m": 3000.0, "spacing_m": 1200.0, "duration_s": 400.0},
    {**AT_EAST, "kind": "search", "pattern": "expanding_square", "spacing_m": 1200.0, "duration_s": 500.0},
    {**AT_EAST, "kind": "search", "pattern": "sector", "sector_m": 2500.0, "duration_s": 400.0},
    cruise(duration_s=90.0, course_deg=200.0),
    cruise(distance_m=4000.0, speed=45.0),
    descent(500.0),
    cruise("home", 50.0),
    descent(450.0),
    descent(angle=-4.0),
    HOVER,
    {"kind": "ground_idle", "duration_s": 40.0},
)
BREEZE = {"from_deg": 250.0, "speed_m_s": 12.0}
SHEAR = {"altitude_m": [400.0, 550.0, 900.0], "from_deg": [200.0, 230.0, 280.0], "speed_m_s": [3.0, 8.0, 14.0]}
