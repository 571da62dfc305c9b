"""Random missions, as the data of a mission file: tasks that mostly suit each other, and some that do not."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

from vrsopt.mission.route import WGS84

SPEEDS = st.floats(8.0, 70.0)
COURSES = st.floats(0.0, 360.0)
ALTITUDES = st.floats(0.0, 1500.0)


def numbers(low: float, high: float, *likely: float) -> st.SearchStrategy[float]:
    """A number of the range, often one that is likely to matter."""
    return st.one_of(st.sampled_from([low, high, *likely]), st.floats(low, high))


@st.composite
def places(draw: DrawFn) -> dict[str, Any]:
    """Two to four places within 60 km, some of them close to each other."""
    base = (draw(numbers(-65.0, 65.0, 0.0)), draw(numbers(-180.0, 180.0, 8.0)))
    found = {}
    for name in "ABCD"[: draw(st.integers(2, 4))]:
        away = draw(numbers(0.0, 3e4, 5e3, 8e3, 1.2e4, 2e4)) if found else 0.0
        point = WGS84.Direct(*base, draw(COURSES), away)
        elevation = draw(numbers(0.0, 500.0, 100.0))
        found[name] = {"latitude_deg": point["lat2"], "longitude_deg": point["lon2"], "elevation_m": elevation}
    return found


def optional(**fields: st.SearchStrategy) -> st.SearchStrategy[dict[str, Any]]:
    """Some of the fields."""
    return st.fixed_dictionaries({}, optional=fields)


def task(kind: str, *others: st.SearchStrategy, **fields: st.SearchStrategy) -> st.SearchStrategy[dict[str, Any]]:
    """A task with these fields, and optional ones."""
    return st.tuples(st.fixed_dictionaries({"kind": st.just(kind), **fields}), *others).map(
        lambda parts: {key: value for part in parts for key, value in part.items()}
    )


def patterns(names: st.SearchStrategy[str]) -> list[st.SearchStrategy[dict[str, Any]]]:
    """The tasks that fly a pattern, around one of the places."""
    common = {
        "around": names,
        "speed_m_s": st.floats(15.0, 60.0),
        "turn_radius_m": st.floats(100.0, 800.0),
        "duration_s": numbers(1.0, 2500.0, 600.0, 900.0),
    }
    legs, spacings, side = st.floats(500.0, 6000.0), st.floats(200.0, 3000.0), st.sampled_from(["left", "right"])
    turning = optional(bearing_deg=COURSES, turns=side)
    return [
        task("loiter", turning, leg_m=legs, **common),
        task("loiter", optional(turns=side), pattern=st.just("circle"), **common),
        task("search", optional(leg_bearing_deg=COURSES), leg_m=legs, spacing_m=spacings, **common),
        task("search", turning, pattern=st.just("expanding_square"), spacing_m=spacings, **common),
        task("search", optional(bearing_deg=COURSES), pattern=st.just("sector"), sector_m=legs, **common),
    ]


def in_flight(names: st.SearchStrategy[str]) -> st.SearchStrategy[dict[str, Any]]:
    """Tasks of all kinds that do not end at rest."""
    steep = optional(speed_m_s=SPEEDS)
    straight = optional(course_deg=COURSES)
    return st.one_of(
        task("cruise", to=names, speed_m_s=SPEEDS),
        task("cruise", straight, duration_s=numbers(1.0, 600.0), speed_m_s=SPEEDS),
        task("cruise", straight, distance_m=numbers(100.0, 2e4), speed_m_s=SPEEDS),
        task("climb", steep, optional(climb_angle_deg=numbers(0.5, 30.0)), altitude_m=ALTITUDES),
        task("descent", steep, optional(climb_angle_deg=numbers(-30.0, -0.5)), altitude_m=ALTITUDES),
        task("speed_change", speed_m_s=SPEEDS, acceleration_m_s2=numbers(0.05, 3.0, 0.5)),
        task("mass_change", mass_change_kg=numbers(-200.0, 200.0)),
        *patterns(names),
    )


def at_rest() -> st.SearchStrategy[dict[str, Any]]:
    """Tasks of all kinds that stand over a place."""
    mass = optional(mass_change_kg=numbers(-200.0, 200.0, 0.0))
    return st.one_of(
        task("idle", mass, duration_s=numbers(1.0, 300.0)),
        task("ground_idle", mass, duration_s=numbers(1.0, 300.0)),
        task("hover", mass, optional(height_m=numbers(0.0, 50.0, 2.0)), duration_s=numbers(1.0, 300.0)),
        task("vertical_climb", optional(climb_rate_m_s=numbers(0.1, 6.0)), height_m=numbers(0.0, 300.0)),
    )


@st.composite
def flights(draw: DrawFn, names: list[str], start: str, highest: float) -> tuple[list[dict[str, Any]], str]:
    """From a hover over one place to a hover over another, in an order that may be flown; and the place."""
    altitudes, at = numbers(highest + 50.0, highest + 900.0, highest + 300.0), start
    steep, by = optional(speed_m_s=st.floats(20.0, 60.0)), {"speed_m_s": st.floats(20.0, 70.0)}
    tasks = [{"kind": "climb", "altitude_m": draw(altitudes), **draw(steep)}]
    parts = ["cruise", "cruise", "climb", "straight", "pattern", "speed", "mass", "any"]
    for part in [*draw(st.lists(st.sampled_from(parts), max_size=4)), "end"]:
        onward = st.sampled_from([name for name in names if name != at])
        if part == "pattern":
            tasks += [{"kind": "cruise", "to": (at := draw(onward)), "speed_m_s": 50.0}]
            tasks += [draw(st.one_of(*patterns(st.sampled_from(names))))]
        elif part == "straight":
            stated = draw(st.sampled_from(["duration_s", "distance_m"]))
            straight = optional(course_deg=COURSES) if len(tasks) > 1 else st.builds(dict, course_deg=COURSES)
            tasks += [draw(task("cruise", straight, **by)) | {stated: draw(st.floats(100.0, 6000.0))}]
        elif part == "speed":
            tasks += [{"kind": "speed_change", "acceleration_m_s2": 0.7, **draw(st.fixed_dictionaries(by))}]
            tasks += [{"kind": "cruise", "to": (at := draw(onward)), "speed_m_s": 40.0}]
        elif part == "climb":
            kind = draw(st.sampled_from(["climb", "descent"]))
            tasks += [{"kind": kind, "altitude_m": draw(altitudes), **draw(steep)}]
        elif part == "mass":
            tasks += [{"kind": "mass_change", "mass_change_kg": draw(numbers(-60.0, 60.0))}]
        elif part == "any":
            tasks += [draw(in_flight(st.sampled_from(names)))]
        else:
            tasks += [{"kind": "cruise", "to": (at := draw(onward)), **draw(st.fixed_dictionaries(by))}]
    if draw(st.booleans()):
        tasks += [{"kind": "descent", "altitude_m": highest + 20.0, **draw(steep)}]
    tasks += [{"kind": "descent", **draw(steep)}, {"kind": "hover", "duration_s": draw(st.floats(15.0, 60.0))}]
    return tasks, at


@st.composite
def winds(draw: DrawFn) -> dict[str, Any]:
    """Wind of up to 15 m/s, the same everywhere or by altitude."""
    if draw(st.booleans()):
        return {"from_deg": draw(COURSES), "speed_m_s": draw(numbers(0.0, 15.0, 5.0))}
    altitudes = sorted(draw(st.sets(st.integers(0, 1500), min_size=1, max_size=3)))
    return {
        "altitude_m": altitudes,
        "from_deg": [draw(COURSES) for _ in altitudes],
        "speed_m_s": [draw(st.floats(0.0, 15.0)) for _ in altitudes],
    }


@st.composite
def missions(draw: DrawFn) -> dict[str, Any]:
    """A mission as the data of its file."""
    where = draw(places())
    names, at = sorted(where), "A"
    anywhere, highest = st.sampled_from(names), max(place["elevation_m"] for place in where.values())
    ground = {"kind": draw(st.sampled_from(["idle", "ground_idle"])), "duration_s": 60.0}
    hover = {"kind": "hover", "duration_s": 30.0}
    tasks = draw(st.sampled_from([[ground, hover], [hover]]))
    for part in draw(st.lists(st.sampled_from(["flight", "flight", "rest", "any"]), min_size=1, max_size=3)):
        if part == "flight":
            more, at = draw(flights(names, at, highest))
        elif part == "rest":
            more = draw(st.lists(at_rest(), max_size=2))
        else:
            more = draw(st.lists(st.one_of(in_flight(anywhere), at_rest()), max_size=4))
        tasks = tasks + more
    tasks = tasks + draw(st.sampled_from([[], [ground], [hover], [hover, ground]]))
    handling = optional(
        acceleration_m_s2=numbers(0.05, 3.0, 1.0),
        cruise_acceleration_m_s2=numbers(0.05, 3.0, 0.4),
        vertical_acceleration_m_s2=numbers(0.05, 2.0, 0.5),
        bank_deg=numbers(5.0, 45.0, 20.0),
        roll_in_s=numbers(0.5, 10.0, 3.0),
    )
    data = {
        "name": "random",
        "aircraft": "bo105",
        "start": "A",
        "places": where,
        "loading": {"empty_kg": 1300.0, "crew_kg": 170.0, "equipment_kg": {"load": 400.0}},
        "handling": draw(handling),
        "tasks": tasks,
    }
    return {**data, "wind": draw(winds())} if draw(st.booleans()) else data
