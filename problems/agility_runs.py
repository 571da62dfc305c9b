"""Flights of the agility study: profiles whose speed changes often or seldom, and what their schedules burn."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from vrsopt.mission.file import Mission, mission_from, read_mission
from vrsopt.schedule.constant import best_constant_schedule
from vrsopt.schedule.limiter import rate_limited_schedule
from vrsopt.schedule.mission_setup import MissionSetup
from vrsopt.schedule.pointwise import pointwise_schedule
from vrsopt.schedule.refinement import refined_trajectory
from vrsopt.schedule.refly import FlightGrid
from vrsopt.surrogate.store import Surrogate

HERE = Path(__file__).parent
RATES = (0.1, 0.2, 0.5, 1.0, 2.0, 4.0)  # % of nominal rotor speed and deg of twist per second
CHANGES = (0, 5, 10, 20, 25)  # of speed, in the time of the nap-of-the-earth flight
NAP, NAP_TIME, ENDS = 20, 856.0, 110.0  # changes, s, s of it to take off and to land
SPEEDS = (15.0, 45.0)  # m/s, between which the flight goes
ACCELERATION = 2.0  # m/s2 at most
FEW_RATES = (0.1, 0.2, 1.0)
SLOW_TWIST, SLOW_TWIST_RATES = 0.1, (0.2, 0.5, 1.0)  # deg/s of twist per %/s of rotor speed
LOAD, HEAVY = 300.0, 800.0  # kg
MISSIONS, SHIPPED = ("patm", "lem", "sarm"), -1
HEIGHT, LAST = 50.0, 1600.0  # m, above the field; more way than the speeds would take, for the climb and the stop


@dataclass(frozen=True)
class Run:
    """One flight at one rate: fuels [kg] of the schedules on the same 1 s grid; whether each of them can be flown."""

    profile: str
    changes: int  # of speed; SHIPPED for a shipped mission
    seconds: float
    rate: float  # % of nominal rotor speed per second
    twist_rate: float  # deg/s
    credit: bool  # whether a rotor that slows down drives
    nominal: float
    constant: float
    pointwise: float
    rate_limited: float
    trajectory: float
    look_ahead: float  # s, what the rate-limited schedule needs to keep the limits
    flyable: dict[str, bool]

    def over(self, name: str) -> float:
        """Fuel of another schedule over that of the trajectory, per cent."""
        return 100.0 * (float(asdict(self)[name]) / self.trajectory - 1.0)


def nap_of_the_earth(changes: int, *, load: float = LOAD, seed: int = 7) -> Mission:
    """Low flight of about NAP_TIME at speeds that jump about between SPEEDS ``changes`` times, hover to hover.

    The speeds alternate between a slow and a fast draw, so that every change is one; the place where it ends is as far
    away as the flight goes.
    """
    random = np.random.default_rng(seed)
    low, high = SPEEDS
    third = (high - low) / 3.0
    draws = [random.uniform(low, low + third) if k % 2 else random.uniform(high - third, high) for k in range(changes)]
    speeds = [30.0, *draws]
    hold = (NAP_TIME - ENDS) / len(speeds)
    legs = [{"kind": "cruise", "duration_s": hold, "course_deg": 90.0, "speed_m_s": speed} for speed in speeds[:-1]]
    away = float(np.sum(speeds)) * hold + LAST
    field = {"latitude_deg": 0.0, "elevation_m": 0.0}
    data = {
        "name": f"{changes} changes of speed" + (", heavy" if load > LOAD else ""),
        "aircraft": "bo105",
        "start": "field",
        "places": {"field": field | {"longitude_deg": 0.0}, "end": field | {"longitude_deg": away / 111_319.5}},
        "loading": {"empty_kg": 1300.0, "crew_kg": 170.0, "equipment_kg": {"load": load}},
        "handling": {"cruise_acceleration_m_s2": ACCELERATION},
        "tasks": [
            {"kind": "hover", "duration_s": 10.0},
            {"kind": "climb", "altitude_m": HEIGHT, "speed_m_s": 30.0},
            *legs,
            {"kind": "cruise", "to": "end", "speed_m_s": speeds[-1]},
            {"kind": "descent", "speed_m_s": 30.0},
            {"kind": "hover", "duration_s": 10.0},
        ],
    }
    return mission_from(data, where="agility")


def flights(surrogate: Surrogate | None = None) -> Iterator[Run]:
    """All runs of the study, one after the other."""
    for changes in CHANGES:
        setup = MissionSetup(nap_of_the_earth(changes), surrogate)
        yield from runs(setup, changes, RATES if changes == NAP else FEW_RATES)
        if changes == NAP:
            yield from runs(setup, changes, FEW_RATES, credit=False)
            yield from runs(setup, changes, SLOW_TWIST_RATES, share=SLOW_TWIST)
            yield from runs(MissionSetup(nap_of_the_earth(changes, load=HEAVY), surrogate), changes, FEW_RATES)
    for name in MISSIONS:
        setup = MissionSetup(read_mission(HERE / f"{name}.toml"), surrogate)
        yield from runs(setup, SHIPPED, FEW_RATES)


def runs(
    setup: MissionSetup, changes: int, rates: tuple[float, ...], *, credit: bool = True, share: float = 1.0
) -> Iterator[Run]:
    """One mission at several rates [%/s] of the rotor speed, ``share`` of them in deg/s for twist; ends pinned."""
    mass = setup.loading.takeoff_mass
    for rate in rates:
        settings = replace(
            setup.settings,
            rotor_speed_rate=0.01 * rate * setup.settings.nominal_rotor_speed,
            twist_rate=math.radians(share * rate),
            spin_down_credit=credit,
        )
        grid = FlightGrid(setup.profile, setup.make, settings=settings)
        own = {"takeoff_mass": mass, "settings": settings}
        pointwise = pointwise_schedule(setup.profile, setup.make, method="batched", grid=grid, **own)
        limited = rate_limited_schedule(pointwise, grid, **own)
        schedules = {
            "nominal": setup.nominal,
            "constant": best_constant_schedule(grid, **own),
            "pointwise": pointwise,
            "rate_limited": limited,
            "trajectory": refined_trajectory(grid, setup.make, **own).schedule,
        }
        flown = {name: grid.fly(schedule, takeoff_mass=mass) for name, schedule in schedules.items()}
        yield Run(
            profile=setup.mission.name,
            changes=changes,
            seconds=setup.profile.duration,
            rate=rate,
            twist_rate=share * rate,
            credit=credit,
            look_ahead=float(limited.details["look_ahead"]),
            flyable={name: flight.success for name, flight in flown.items()},
            **{name: flight.fuel for name, flight in flown.items()},
        )
