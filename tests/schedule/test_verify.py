"""Physics of a flown schedule: the steady flight of each node, ground idle, edges, and what goes wrong by name."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from vrsopt.helicopter import helicopter
from vrsopt.limits import Limits
from vrsopt.mission.conditions import Conditions
from vrsopt.schedule import verify
from vrsopt.schedule.ground_idle import ground_idle
from vrsopt.schedule.schedule import Schedule
from vrsopt.schedule.verify import PhysicsPilot, fly_physics

MACHINE = helicopter("bo105")
LIMITS = Limits(MACHINE.aircraft, MACHINE.engine, "study", 1.0)
ROTOR = MACHINE.aircraft.main_rotor
NOTHING = {
    "speed": 0.0,
    "altitude": 100.0,
    "load_factor": 1.0,
    "turn_load_factor": 1.0,
    "turn": 0.0,
    "equivalent_climb_angle": 0.0,
    "height": np.inf,
    "idle": False,
    "ground_idle": False,
}


@dataclass(frozen=True)
class Made:
    """A profile of segments of one minute or less, each with one condition at its start and one at its end."""

    segments: tuple
    ends: tuple  # of each segment: what differs from a hover at its start and at its end
    mass_changes: np.ndarray
    isa_offset: float = 0.0

    def grid(self, max_step):
        rows = [{**NOTHING, **end} for pair in self.ends for end in pair]
        time = [t for s in self.segments for t in (s.start, s.start + s.duration)]
        columns = {name: np.array([row[name] for row in rows]) for name in NOTHING}
        segment = np.repeat(np.arange(len(self.segments)), 2)
        return Conditions(
            segment=segment, time=np.array(time), climb_angle=columns["equivalent_climb_angle"], **columns
        )


def made(*tasks, mass_changes=None):
    """``tasks``: name, duration [s], and the change against a hover at both ends or at start and end."""
    segments, ends, start = [], [], 0.0
    for name, duration, *changes in tasks:
        segments.append(SimpleNamespace(task=name, kind=name, start=start, duration=duration))
        ends.append((changes[0], changes[-1]))
        start += duration
    changes = np.zeros(len(tasks)) if mass_changes is None else np.array(mass_changes)
    return Made(tuple(segments), tuple(ends), changes)


def constant(profile, rotor_speed=42.0, twist=0.15):
    nodes = profile.grid(10.0)
    count = len(nodes.time)
    return Schedule("made", nodes.segment, nodes.time, np.full(count, rotor_speed), np.full(count, twist))


def flown(profile, mass=1900.0, **schedule):
    return fly_physics(profile, constant(profile, **schedule), limits=LIMITS, takeoff_mass=mass)


def point(mass, **flight):
    flight = {"altitude": 100.0, "isa_offset": 0.0, "speed": 0.0, "climb_angle": 0.0, "load_factor": 1.0, **flight}
    return MACHINE.point({"mass": mass, "rotor_speed": 42.0, "twist": 0.15, **flight}, limits=LIMITS)


def test_each_node_is_the_steady_flight_with_its_forces():
    """Speeding up, a turn to the left while slowing down, a vertical climb, a hover near the ground."""
    profile = made(
        ("speed up", 1.0, {"speed": 15.0, "load_factor": 1.02, "equivalent_climb_angle": 0.15}),
        (
            "turn",
            1.0,
            {"speed": 30.0, "load_factor": 1.21, "turn_load_factor": 1.2, "turn": -1.0, "equivalent_climb_angle": -0.1},
        ),
        ("climb", 1.0, {"speed": 2.0, "equivalent_climb_angle": np.pi / 2}),
        ("hover", 1.0, {"height": 2.0}),
    )
    flight = flown(profile)
    assert flight.success, flight.message
    ratio = 1.21 / 1.2
    expected = (
        point(flight.mass[0] * 1.02, speed=15.0, climb_angle=0.15),
        point(flight.mass[2] * ratio, speed=30.0, climb_angle=-0.1, load_factor=1.2, turn=-1.0),
        point(flight.mass[4], vertical_speed=2.0),
        point(flight.mass[6], ground_proximity=ROTOR.radius / 5.0),
    )
    for k, there in enumerate(expected):
        assert there.success
        assert flight.fuel_flow[2 * k] == pytest.approx(there.fuel_flow, rel=1e-5)
        assert flight.usages[:, 2 * k] == pytest.approx(list(there.usages.values()), rel=1e-5)
    right = point(flight.mass[2] * ratio, speed=30.0, climb_angle=-0.1, load_factor=1.2)
    assert right.fuel_flow != pytest.approx(expected[1].fuel_flow, rel=1e-5)


def test_ground_idle_burns_what_its_rating_says_and_is_no_flight():
    profile = made(
        ("start", 60.0, {"idle": True, "ground_idle": True}), ("run", 60.0, {"idle": True}), ("hover", 10.0, {})
    )
    flight = flown(profile, rotor_speed=ROTOR.nominal_rotor_speed)
    assert flight.success, flight.message
    idle = 2 * ground_idle(MACHINE.engine, altitude=100.0).outputs["fuel_flow"]
    assert flight.fuel_flow[:2] == pytest.approx(idle, rel=1e-9)
    assert flight.mass[0] - flight.mass[1] == pytest.approx(60.0 * idle, rel=1e-9)
    assert idle < flight.fuel_flow[2] < flight.fuel_flow[4]
    assert np.isnan(flight.usages[:, :4]).all() and np.isfinite(flight.usages[:, 4:]).all()
    assert flight.emissions.total("co") > 0


def test_an_edge_where_nothing_changes_is_trimmed_once(monkeypatch):
    cruise = {"speed": 40.0}
    profile = made(("a", 20.0, cruise), ("b", 20.0, cruise), ("c", 20.0, cruise), mass_changes=[0.0, 0.0, 100.0])
    trims, original = [], type(MACHINE).trim
    monkeypatch.setattr(
        type(MACHINE), "trim", lambda self, *args, **more: trims.append(args) or original(self, *args, **more)
    )
    reused = flown(profile)
    assert len(trims) == 5  # not at the start of b; the mass changes at that of c
    monkeypatch.setattr(verify, "SAME_MASS", 0.0)
    trims.clear()
    every = flown(profile)
    assert len(trims) == 6
    assert reused.fuel == pytest.approx(every.fuel, rel=1e-7)


def test_the_rate_of_the_rotor_speed_counts_on_both_sides_of_an_edge():
    profile = made(("a", 20.0, {"speed": 40.0}), ("b", 20.0, {"speed": 40.0}))
    schedule = replace(constant(profile), rotor_speed=np.array([40.0, 42.0, 42.0, 42.0]))
    pilot = PhysicsPilot(MACHINE, LIMITS, 0.0)
    flight = pilot.fly(profile, schedule, takeoff_mass=1900.0, step=10.0)
    assert flight.success, flight.message
    assert flight.fuel_flow[1] > 1.005 * flight.fuel_flow[2]  # the same trim, with and without the kinetic power


@pytest.mark.slow
def test_what_can_not_be_flown_is_named_with_time_and_task():
    fails = flown(made(("hover", 30.0, {}), ("too heavy", 30.0, {"speed": 20.0, "load_factor": 5.0})))
    assert not fails.success and fails.message.startswith("no physics at 30 s (too heavy): ")
    tight = {"speed": 3.0, "load_factor": 1.3, "turn_load_factor": 1.3, "turn": 1.0}
    fails = flown(made(("hover", 30.0, {}), ("pirouette", 30.0, tight)))
    assert not fails.success and fails.message.startswith("no physics at 30 s (pirouette): trim: load_factor = 1.3")
    heavy = flown(
        made(("hover", 10.0, {}), ("take-off", 10.0, {"speed": 45.0, "equivalent_climb_angle": 0.25})), 2400.0
    )
    assert "tail rotor loading" in heavy.message and "at 10 s (take-off)" in heavy.message
