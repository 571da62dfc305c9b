"""Flights of the agility study: profiles whose speed changes often or seldom, and what their schedules burn."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

from vrsopt.mission.file import Mission, mission_from, read_mission
from vrsopt.schedule.limiter import rate_limited_schedule
from vrsopt.schedule.mission_setup import MissionSetup
from vrsopt.schedule.nominal import nominal_schedule
from vrsopt.schedule.pointwise import pointwise_schedule
from vrsopt.schedule.refinement import refined_trajectory
from vrsopt.schedule.refly import Flight
from vrsopt.schedule.schedule import Schedule, ScheduleSettings
from vrsopt.surrogate.store import Surrogate

HERE = Path(__file__).parent
RATES = (0.1, 0.2, 0.5, 1.0, 2.0, 4.0)  # % of nominal rotor speed and deg of twist per second
CHANGES = (0, 5, 10, 20, 25)  # of speed, in the time of the nap-of-the-earth flight
NAP, NAP_TIME, ENDS = 20, 856.0, 110.0  # changes, s, s of it to take off and to land
SPEEDS = (15.0, 45.0)  # m/s, between which the flight goes
ACCELERATION = 2.0  # m/s2 at most
MISSIONS, MISSION_RATES = ("patm", "lem", "sarm"), (0.1, 0.5, 1.0)
HEIGHT, LAST = 50.0, 1600.0  # m, above the field; more way than the speeds would take, for the climb and the stop


@dataclass(frozen=True)
class Run:
    """One flight at one rate: fuels [kg] of the schedules on the same 1 s grid; whether each of them can be flown."""

    profile: str
    changes: int
    seconds: float
    rate: float
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


def nap_of_the_earth(changes: int, *, seed: int = 7) -> Mission:
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
        "name": f"{changes} changes of speed",
        "aircraft": "bo105",
        "start": "field",
        "places": {"field": field | {"longitude_deg": 0.0}, "end": field | {"longitude_deg": away / 111_319.5}},
        "loading": {"empty_kg": 1300.0, "crew_kg": 170.0, "equipment_kg": {"load": 300.0}},
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
        rates = RATES if changes == NAP else (0.2, 1.0)
        yield from runs(setup, changes=changes, rates=rates)
    for name in MISSIONS:
        setup = MissionSetup(read_mission(HERE / f"{name}.toml"), surrogate)
        yield from runs(setup, changes=-1, rates=MISSION_RATES)


def runs(setup: MissionSetup, *, changes: int, rates: tuple[float, ...]) -> Iterator[Run]:
    """One mission at several actuator rates, ends pinned, kinetic energy charged and credited."""
    mass, grid = setup.loading.takeoff_mass, setup.grid
    best = best_constant(setup)
    pointwise = pointwise_schedule(
        setup.profile, setup.make, takeoff_mass=mass, settings=setup.settings, method="batched", grid=grid
    )
    for rate in rates:
        settings = rated(setup.settings, rate)
        limited = rate_limited_schedule(pointwise, grid, takeoff_mass=mass, settings=settings)
        trajectory = refined_trajectory(grid, setup.make, takeoff_mass=mass, settings=settings)
        flown: dict[str, Flight] = {
            "nominal": grid.fly(setup.nominal, takeoff_mass=mass),
            "constant": grid.fly(held(setup, best, settings), takeoff_mass=mass),
            "pointwise": grid.fly(pointwise, takeoff_mass=mass),
            "rate_limited": grid.fly(limited, takeoff_mass=mass),
            "trajectory": grid.fly(trajectory.schedule, takeoff_mass=mass),
        }
        yield Run(
            profile=setup.mission.name,
            changes=changes,
            seconds=setup.profile.duration,
            rate=rate,
            look_ahead=float(limited.details["look_ahead"]),
            flyable={name: flight.success for name, flight in flown.items()},
            **{name: flight.fuel for name, flight in flown.items()},
        )


def rated(settings: ScheduleSettings, rate: float) -> ScheduleSettings:
    """The settings with actuators of ``rate`` per cent of nominal rotor speed, and degrees of twist, per second."""
    speed = 0.01 * rate * settings.nominal_rotor_speed
    return replace(settings, rotor_speed_rate=speed, twist_rate=math.radians(rate))


def held(setup: MissionSetup, point: np.ndarray, settings: ScheduleSettings) -> Schedule:
    """Rotor speed and twist of ``point`` (2,) all along, reached from nominal and left for it at the rates."""
    nominal = nominal_schedule(setup.profile, settings)
    constant = replace(
        nominal,
        name="constant",
        rotor_speed=np.full_like(nominal.rotor_speed, point[0]),
        twist=np.full_like(nominal.twist, point[1]),
    )
    mass = setup.loading.takeoff_mass
    return rate_limited_schedule(constant, setup.grid, takeoff_mass=mass, settings=settings)


def best_constant(setup: MissionSetup) -> np.ndarray:
    """Rotor speed [rad/s] and twist [rad] of least fuel held all along, within the limits if a constant can be."""
    mass, grid, settings = setup.loading.takeoff_mass, setup.grid, rated(setup.settings, 1.0)
    nominal = np.array([settings.nominal_rotor_speed, settings.nominal_twist])
    box = settings.box(grid.model.bounds)

    def merit(scaled: np.ndarray) -> float:
        schedule = nominal_schedule(setup.profile, settings)
        speed, twist = np.clip(scaled * nominal, *box)
        schedule = replace(
            schedule,
            rotor_speed=np.full_like(schedule.rotor_speed, speed),
            twist=np.full_like(schedule.twist, twist),
        )
        flight = grid.fly(schedule, takeoff_mass=mass)
        return flight.fuel * (1.0 + 10.0 * max(0.0, float(np.max(flight.limits))))

    found = minimize(merit, [0.95, 1.2], method="Nelder-Mead", options={"xatol": 1e-3, "fatol": 1e-4})
    return np.clip(found.x * nominal, *box)
