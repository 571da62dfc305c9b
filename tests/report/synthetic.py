"""A mission, an aircraft and schedules made by hand: reports are tested without a surrogate and without physics.

The profile is flown smoothly as a planner would have it: every change of speed takes time. The aircraft is a formula.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial

from tests.report.synthetic_solution import made_shaft_power, made_solution
from vrsopt.atmosphere import GRAVITY
from vrsopt.helicopter import helicopter
from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.mission.loading import TakeoffLoading
from vrsopt.mission.motion import PathMotion
from vrsopt.mission.profile import Profile
from vrsopt.mission.route import Arc, Leg, Point, Pose, Stay
from vrsopt.mission.segment import Segment
from vrsopt.mission.wind import CALM, Wind
from vrsopt.schedule.activity import active_limits
from vrsopt.schedule.comparison import Band, Comparison, ScheduleResult
from vrsopt.schedule.emissions import changes
from vrsopt.schedule.path_model import PathValues
from vrsopt.schedule.quadrature import per_segment
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.rotor_energy import rotor_energy
from vrsopt.schedule.schedule import Schedule, ScheduleSettings
from vrsopt.schedule.verify import PhysicsFlight

SETTINGS = ScheduleSettings()
NOMINAL = SETTINGS.nominal_rotor_speed
TAKEOFF_MASS = 2200.0
# rotor speed over nominal that the "modelled" schedules want, by kind of task
WANTED = {"hover": 0.97, "vertical_climb": 0.98, "climb": 0.93, "cruise": 0.9, "descent": 0.84, "loiter": 0.86}
PRESCRIBED = {"climb": 1.0, "descent": 0.9}


@dataclass(frozen=True)
class Place:
    latitude_deg: float
    longitude_deg: float
    elevation_m: float

    @property
    def point(self) -> Point:
        return Point(self.latitude_deg, self.longitude_deg)


@dataclass
class Flight:
    """A profile in the making: where the aircraft is and how it moves there."""

    pose: Pose
    altitude: float = 0.0
    speed: float = 0.0
    climb_rate: float = 0.0
    time: float = 0.0
    segments: list[Segment] = field(default_factory=list)

    def fly(
        self,
        kind: str,
        duration: float,
        *,
        task: str | None = None,
        speed: float | None = None,
        climb_rate: float | None = None,
        radius: float | None = None,
        mass_change: float = 0.0,
        ground: float | None = None,
    ) -> None:
        """A segment in which speed and climb rate go smoothly to new values; ``radius`` > 0 turns right."""
        after = self.speed if speed is None else speed
        rate = self.climb_rate if climb_rate is None else climb_rate
        distance = _travelled(self.speed, after, duration)
        height = _travelled(self.climb_rate, rate, duration) + self.altitude
        length = float(distance(duration))
        path: Any = Stay(self.pose.point)
        if length > 0.0:
            path = Leg(*self.pose, length)
            if radius is not None:
                sweep = np.copysign(np.degrees(length / abs(radius)), radius)
                path = Arc.from_pose(self.pose, abs(radius), sweep_deg=float(sweep))
            self.pose = path.pose(length)
        window = [0.0, duration]
        motion = PathMotion(
            path, distance.convert(kind=Chebyshev, domain=window), height.convert(kind=Chebyshev, domain=window)
        )
        self.segments.append(Segment(task or kind, kind, self.time, duration, mass_change, motion, ground))
        self.altitude, self.speed, self.climb_rate = float(height(duration)), after, rate
        self.time = self.segments[-1].end

    def circuits(self, kind: str, count: int, *, leg: float, radius: float, task: str | None = None) -> None:
        """Race-tracks: straights of ``leg`` [m] and half circles."""
        for _ in range(2 * count):
            self.fly(kind, leg / self.speed, task=task)
            self.fly(kind, np.pi * abs(radius) / self.speed, task=task, radius=radius)

    def away(self, *, to: float, speed: float, ground: float = 0.0) -> None:
        """From a hover up to an altitude [m] and a speed [m/s]."""
        self.fly("vertical_climb", 4.0, climb_rate=2.0, ground=ground)
        self.fly("vertical_climb", 4.0, climb_rate=0.0, ground=ground)
        self.fly("climb", 25.0, speed=speed, climb_rate=5.0)
        self.fly("climb", (to - self.altitude) / 5.0 - 4.0)
        self.fly("climb", 8.0, climb_rate=0.0)

    def down(self, *, to: float, ground: float | None = None) -> None:
        """Down to a hover at an altitude [m]."""
        self.fly("descent", 8.0, climb_rate=-5.0)
        self.fly("descent", (self.altitude - to) / 5.0 - 12.5)
        self.fly("descent", 25.0, speed=0.0, climb_rate=0.0)
        self.altitude = to
        if ground is not None:
            self.fly("hover", 20.0, ground=ground)

    def profile(self, wind: Wind = CALM) -> Profile:
        return Profile(tuple(self.segments), 0.0, wind)


def _travelled(before: float, after: float, duration: float) -> Polynomial:
    """Distance over time when the speed goes from one value to another as a smoothstep."""
    change = after - before
    return Polynomial([0.0, before, 0.0, change / duration**2, -change / (2.0 * duration**3)])


def hop(wind: Wind = CALM) -> Profile:
    """Off the ground, up, a cruise with one full turn, down; lifts 50 kg on the way; 6 min."""
    flight = Flight(Pose(Point(37.6, -122.4), 0.0))
    flight.fly("ground_idle", 20.0, ground=0.0, task="idle at base")
    flight.fly("idle", 20.0, ground=0.0, task="idle at base")
    flight.fly("hover", 30.0, ground=0.0, task="hover at base")
    flight.away(to=200.0, speed=40.0)
    flight.fly("cruise", 60.0, task="cruise to quay")
    flight.fly("loiter", 2.0 * np.pi * 300.0 / 40.0, radius=-300.0, task="loiter")
    flight.fly("cruise", 40.0, task="cruise to quay")
    flight.down(to=20.0, ground=18.0)
    flight.fly("hover", 30.0, mass_change=50.0, ground=18.0, task="hover at quay")
    return flight.profile(wind)


BREEZE = Wind.from_directions([0.0], [240.0], [8.0])
HOP_PLACES = {"base": Place(37.6, -122.4, 0.0), "quay": Place(37.66, -122.4, 0.0)}


class Formula:
    """A path model: power of weight, rotor speed and climb; least at rotor speeds below nominal."""

    limit_names = LIMIT_NAMES
    bounds = {"mass": (1400.0, 2500.0), "rotor_speed": (31.0, 51.5), "twist": (0.1, 0.29)}
    quantity_names = ()
    polar_inertia, engine_share = 900.0, 1.0 / 1.8

    def __init__(self, conditions: Any) -> None:
        self.conditions = conditions

    def evaluate(self, mass: Any, rotor_speed: Any, twist: Any, rotor_speed_rate: Any = 0.0) -> PathValues:
        mass, rotor_speed, twist, rate = np.broadcast_arrays(mass, rotor_speed, twist, rotor_speed_rate)
        shape = (-1,) + (1,) * (mass.ndim - 1)
        c = self.conditions
        speed, climb, load, idle = (
            np.reshape(row, shape) for row in (c.speed, c.equivalent_climb_angle, c.load_factor, c.idle)
        )
        weight, ratio = mass * load * GRAVITY, rotor_speed / NOMINAL
        induced = 11.0 / np.sqrt(1.0 + (speed / 12.0) ** 2) * (weight / 21_000.0)
        drag = 0.55 * speed**3 * (1.0 + 0.3 * (twist - 0.16) ** 2)
        power = weight * (induced + speed * np.sin(climb)) + 95e3 * ratio**3 + drag + 900.0 * rotor_speed * rate
        each = np.maximum(power, 60e3) / 1.8
        each = np.where(idle, 45e3, each)
        fuel_flow = 2.0 * (0.0062 + 0.000075 * each / 1e3)
        loading = weight / (0.13 * 21_000.0 * 9.0 * ratio**2) * 0.68
        limits = [loading - 1.0, each / 257e3 - 1.0, each / ratio / 257e3 - 1.0, each / 300e3 - 1.0, loading - 1.3]
        return PathValues(fuel_flow, each, np.stack(np.broadcast_arrays(*limits)))

    def emissions(self, fuel_flow: np.ndarray, power_per_engine: np.ndarray, rotor_speed: Any) -> dict[str, np.ndarray]:
        nox = 5e-3 * fuel_flow * (power_per_engine / 200e3)
        rest = {"foca_nox": 0.8 * nox, "foca_co": 3e-2 * fuel_flow}
        return {"co2": 3.1 * fuel_flow, "nox": nox, "co": 2e-2 * fuel_flow, **rest}

    def nodes(self, index: np.ndarray) -> Any:
        raise AssertionError("a report searches at no nodes")

    def function(self, quantities: Any = ()) -> Any:
        raise AssertionError("a report solves no problem")


def _schedules(profile: Profile, variables: str) -> dict[str, Schedule]:
    """What a study would compare: rotor speeds by kind of task, raw and with 1 % per second, held at both ends."""
    free = variables != "twist"
    nodes = profile.grid(1.0)
    kinds = np.array([segment.kind for segment in profile.segments])[nodes.segment]
    bank = 1.0 + 0.3 * (nodes.turn_load_factor - 1.0)

    def wanted(table: dict[str, float]) -> np.ndarray:
        return np.where(nodes.idle, 1.0, np.array([table.get(kind, 0.88) for kind in kinds]) * bank)

    def limited(ratio: np.ndarray) -> np.ndarray:
        ratio = ratio.copy()
        ratio[0] = ratio[-1] = 1.0
        held = np.asarray(nodes.idle)
        for order in (range(1, len(ratio)), range(len(ratio) - 2, -1, -1)):
            for i in order:
                j = i - 1 if order.step > 0 else i + 1
                step = 0.01 * abs(nodes.time[i] - nodes.time[j])
                ratio[i] = 1.0 if held[i] else max(ratio[i], ratio[j] - step)
        return ratio

    def schedule(name: str, ratio: np.ndarray) -> Schedule:
        twist = SETTINGS.nominal_twist + 0.15 * (1.0 - ratio)
        rotor_speed = NOMINAL * (ratio if free else np.ones(len(ratio)))
        return Schedule(name, np.asarray(nodes.segment), np.asarray(nodes.time), rotor_speed, twist)

    raw, table = wanted(WANTED), wanted(WANTED | PRESCRIBED)
    return {
        "nominal": schedule("nominal", np.ones(len(nodes.time))),
        "pointwise": schedule("pointwise", raw),
        "pointwise_rate_limited": schedule("pointwise_rate_limited", limited(raw)),
        "prescribed": schedule("prescribed", table),
        "prescribed_rate_limited": schedule("prescribed_rate_limited", limited(table)),
        "trajectory": schedule("trajectory", limited(np.where(nodes.idle, 1.0, raw - 0.01))),
    }


def _physics(profile: Profile, schedule: Schedule) -> PhysicsFlight:
    """The same formula on a grid of 5 s, 0.1 % off: what a physics would say."""
    grid = FlightGrid(profile, Formula, step=5.0)
    flight = grid.fly(schedule, takeoff_mass=TAKEOFF_MASS)
    sides = np.repeat(1.001 * flight.fuel_flow[:, None], 2, axis=1)
    fuel = per_segment(flight.segment, flight.time, sides, np.arange(len(flight.time)), len(profile.segments))
    return PhysicsFlight(
        segment=flight.segment,
        time=flight.time,
        mass=flight.mass,
        fuel_flow=1.001 * flight.fuel_flow,
        usages=np.where(np.isfinite(flight.limits), 1.0 + flight.limits, np.nan),
        fuel=float(fuel.sum()),
        quadrature_error=1e-3,
        residual_norm=1e-9,
        emission_nodes=np.arange(len(flight.time)),
        emissions=grid.emissions(flight),
        success=True,
        message="",
        shaft_power=made_shaft_power(flight, sides),
    )


def compare(
    profile: Profile,
    name: str,
    places: dict[str, Place],
    *,
    schedules: list[str] | None = None,
    variables: str = "both",
) -> Comparison:
    """A comparison as :func:`vrsopt.solve` would return it."""
    machine = helicopter("bo105")
    grid = FlightGrid(profile, Formula)
    chosen = {key: one for key, one in _schedules(profile, variables).items() if schedules is None or key in schedules}
    flights = {key: grid.fly(schedule, takeoff_mass=TAKEOFF_MASS) for key, schedule in chosen.items()}
    emissions = {key: grid.emissions(flight) for key, flight in flights.items()}
    physics = {key: _physics(profile, schedule) for key, schedule in chosen.items()}
    base = flights["nominal"].fuel
    results = {
        key: ScheduleResult(
            schedule=schedule,
            flight=flights[key],
            physics=physics[key],
            emissions=emissions[key],
            fuel_delta_percent=100 * (flights[key].fuel / base - 1),
            fuel_delta_closed_percent=105 * (flights[key].fuel / base - 1),
            fuel_physics_delta_percent=100 * (physics[key].fuel / physics["nominal"].fuel - 1),
            changes=changes(emissions[key], emissions["nominal"]),
            physics_changes=changes(physics[key].emissions, physics["nominal"].emissions),
            energy=rotor_energy(grid, flights[key]),
            active=active_limits(grid, flights[key], SETTINGS),
        )
        for key, schedule in chosen.items()
    }
    nodes = profile.grid(60.0)
    flying = ~np.asarray(nodes.idle)
    segment, time = np.asarray(nodes.segment)[flying], np.asarray(nodes.time)[flying]
    middle = NOMINAL * (0.92 + 0.02 * np.sin(time / 200.0))
    flown = flights.get("trajectory", flights["nominal"])
    mission: Any = SimpleNamespace(name=name, notes=(), places=places)
    return Comparison(
        mission=mission,
        profile=profile,
        settings=SETTINGS,
        limits=Limits(machine.aircraft, machine.engine, "manual", 1.3),
        loading=TakeoffLoading(TAKEOFF_MASS, 300.0, base, 100.0, TAKEOFF_MASS - base),
        results=results,
        band=Band(segment, time, middle - 2.0, middle + 2.0),
        trajectory=made_solution(profile, 1.0001 * flown.fuel) if "trajectory" in chosen else None,
        provenance={
            "model_version": "3",
            "data_hash": "0123456789abcdef",
            "design_seed": 1,
            "search_seed": 1,
            "variables": variables,
        },
    )
