"""Physics of a flown schedule: the steady flight of each node, ground idle, edges, and what goes wrong by name."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.helicopter import helicopter
from vrsopt.limits import Limits
from vrsopt.mission.conditions import Conditions
from vrsopt.schedule import physics_node
from vrsopt.schedule.flight_nodes import flight_nodes
from vrsopt.schedule.ground_idle import ground_idle
from vrsopt.schedule.physics_node import NodePhysics
from vrsopt.schedule.schedule import Schedule
from vrsopt.schedule.trim_path import TrimPath
from vrsopt.schedule.verify import fly_physics

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

    def conditions(self, segment, time):
        """Linear in time between the two ends of a segment."""
        columns = {name: np.empty(len(time), dtype=type(value)) for name, value in NOTHING.items()}
        for k, (s, t) in enumerate(zip(segment, time, strict=True)):
            start, end = ({**NOTHING, **one} for one in self.ends[s])
            share = (t - self.segments[s].start) / self.segments[s].duration
            for name, column in columns.items():
                same = start[name] == end[name]
                column[k] = start[name] if same else start[name] + share * (end[name] - start[name])
        angle = columns["equivalent_climb_angle"]
        return Conditions(segment=segment, time=time, climb_angle=angle, **columns)

    def grid(self):
        """Both ends of every segment."""
        time = [t for s in self.segments for t in (s.start, s.start + s.duration)]
        return self.conditions(np.repeat(np.arange(len(self.segments)), 2), np.array(time))


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
    nodes = profile.grid()
    count = len(nodes.time)
    return Schedule("made", nodes.segment, nodes.time, np.full(count, rotor_speed), np.full(count, twist))


def flown(profile, mass=1900.0, **schedule):
    return fly_physics(profile, constant(profile, **schedule), limits=LIMITS, takeoff_mass=mass, nodes=profile.grid())


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
    trims, original = [], TrimPath.trim
    monkeypatch.setattr(TrimPath, "trim", lambda self, flight: trims.append(flight) or original(self, flight))
    reused = flown(profile)
    assert len(trims) == 5  # not at the start of b; the mass changes at that of c
    monkeypatch.setattr(physics_node, "SAME_MASS", 0.0)
    trims.clear()
    every = flown(profile)
    assert len(trims) == 6
    assert reused.fuel == pytest.approx(every.fuel, rel=1e-7)


def test_the_rate_of_the_rotor_speed_counts_on_both_sides_of_an_edge():
    profile = made(("a", 20.0, {"speed": 40.0}), ("b", 20.0, {"speed": 40.0}))
    schedule = replace(constant(profile), rotor_speed=np.array([40.0, 42.0, 42.0, 42.0]))
    flight = fly_physics(profile, schedule, limits=LIMITS, takeoff_mass=1900.0, nodes=profile.grid())
    assert flight.success, flight.message
    assert flight.fuel_flow[1] > 1.005 * flight.fuel_flow[2]  # the same trim, with and without the kinetic power


def test_slowing_the_rotor_down_gives_nothing_back_without_the_credit():
    profile = made(("a", 20.0, {"speed": 40.0}), ("b", 20.0, {"speed": 40.0}))
    schedule = replace(constant(profile), rotor_speed=np.array([40.0, 42.0, 42.0, 40.0]))
    nodes = profile.grid()
    credited, charged = (
        fly_physics(profile, schedule, limits=LIMITS, takeoff_mass=1900.0, nodes=nodes, spin_down_credit=credit)
        for credit in (True, False)
    )
    steady = flown(profile, rotor_speed=42.0)
    assert charged.fuel_flow[1] == pytest.approx(credited.fuel_flow[1], rel=1e-9)  # the rotor speeds up
    assert charged.fuel_flow[2] == pytest.approx(steady.fuel_flow[2], rel=1e-4)
    assert credited.fuel_flow[2] < 0.995 * charged.fuel_flow[2]


def test_a_variable_transmission_turns_the_turbine_at_its_best_speed():
    """No turbine speed burns less, the rotor turns as before, and its shaft has the same torque."""
    nodes = made(("cruise", 10.0, {"speed": 40.0})).grid()
    fixed, variable = (NodePhysics(MACHINE, LIMITS, 0.0, transmission=name) for name in ("fixed", "variable"))
    rotors = fixed.rotors(nodes, 0, mass=1900.0, rotor_speed=38.0, twist=0.15)
    own = variable.engine(rotors, 0.0)
    fuel = own.state.outputs["fuel_flow"]
    assert fuel < fixed.engine(rotors, 0.0).state.outputs["fuel_flow"] * (1 - 1e-4)
    for speed in np.linspace(0.7, 1.2, 26):
        other = MACHINE.engine_state(own.power, {**rotors.flight, "rotor_speed": speed * ROTOR.nominal_rotor_speed})
        assert other.outputs["fuel_flow"] > fuel * (1 - 1e-7)
    assert own.usages[2] == fixed.engine(rotors, 0.0).usages[2]


def test_derivatives_of_a_node_are_those_of_solved_neighbours():
    """Fuel flow and usages by mass, rotor speed, twist and rate, in a turn that sinks, against differences."""
    turn = {"speed": 30.0, "load_factor": 1.21, "turn_load_factor": 1.2, "turn": -1.0, "equivalent_climb_angle": -0.05}
    nodes, x, step = made(("turn", 10.0, turn)).grid(), np.array([1900.0, 41.0, 0.15, 0.1]), [5.0, 0.05, 5e-4, 1e-2]
    limits = replace(LIMITS, setting="manual", manoeuvre_margin=1.3)
    physics = NodePhysics(MACHINE, limits, 0.0)

    def solved(x):
        rotors = physics.rotors(nodes, 0, mass=x[0], rotor_speed=x[1], twist=x[2])
        state = rotors, physics.engine(rotors, x[3])
        return physics.jacobian(nodes, 0, state, mass=x[0], rate=x[3], rotor=physics.rotor_slopes(rotors)), state

    (values, slopes), (_, engines) = solved(x)
    assert values[0] == pytest.approx(2 * engines.state.outputs["fuel_flow"], rel=1e-12)
    assert values[1:] == pytest.approx(engines.usages - 1, abs=3e-4)  # the largest of two, rounded
    for k in range(4):
        above, below = (solved(x + sign * step[k] * np.eye(4)[k])[0][0] for sign in (1, -1))
        assert slopes[:, k] == pytest.approx((above - below) / (2 * step[k]), rel=1e-4, abs=1e-9)


def test_trims_along_a_path_are_those_of_a_fresh_start():
    """Each from its neighbours, by Broyden's method, as exact as any other."""
    path = TrimPath(MACHINE)
    flight = {**NOTHING, "climb_angle": 0.0, "isa_offset": 0.0, "speed": 40.0, "mass": 1900.0, "twist": 0.15}
    flight = {name: flight[name] for name in ("altitude", "isa_offset", "speed", "climb_angle", "load_factor", "twist")}
    for k in range(12):
        here = {**flight, "mass": 1900.0 - 2.0 * k, "rotor_speed": 42.0 - 0.1 * k, "speed": 40.0 + 0.2 * k}
        trim = path.trim(here)
        assert trim.success and trim.solution.residual_norm < 1e-8
    fresh = MACHINE.trim(here)
    assert trim.power == pytest.approx(fresh.power, rel=1e-7)
    assert trim.smallest_singular_value == pytest.approx(fresh.smallest_singular_value, rel=0.3)
    assert path.cascades == 1 and path.evaluations < 6 * 11


def test_nodes_are_the_bends_of_all_schedules():
    """Both ends of segments, bends, two steps where a panel is longer than two seconds, none longer than asked for."""
    profile = made(("a", 60.0, {"speed": 40.0}), ("b", 3.0, {"speed": 40.0}))
    time = np.array([0.0, 11.0, 12.0, 30.0, 60.0, 60.0, 63.0])
    bent = Schedule("bent", np.array([0, 0, 0, 0, 0, 1, 1]), time, np.array([42.0, 42, 41, 41, 41, 41, 41]), 0 * time)
    nodes = flight_nodes(profile, [constant(profile), bent])
    assert set(nodes.time) >= {0.0, 11.0, 12.0, 60.0, 61.5, 63.0}
    assert 30.0 not in nodes.time  # the schedule is straight there
    assert np.max(np.diff(nodes.time)) <= 10.0 and list(nodes.time).count(60.0) == 2
    with pytest.raises(InputError, match="step = 0"):
        flight_nodes(profile, [bent], step=0.0)


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
