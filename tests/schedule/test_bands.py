"""Forbidden bands of the rotor speed, and the search over all courses that finds which side of them to be on."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from vrsopt.errors import InputError, NoSolutionError
from vrsopt.schedule.bands import ForbiddenBand, allowed_regions, check_bands
from vrsopt.schedule.bellman import Jump, Layers, cheapest
from vrsopt.schedule.crossings import Crossings, Window, windows_around
from vrsopt.schedule.mesh import Mesh
from vrsopt.schedule.refinement import refined_trajectory
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.schedule import ScheduleSettings
from vrsopt.schedule.speed_maps import SpeedMaps
from vrsopt.schedule.speed_plan import best_course, speed_plan

MASS = 2150.0  # kg
SETTINGS = ScheduleSettings()
NOMINAL = SETTINGS.nominal_rotor_speed


def band(low: float, high: float, crossing_time: float = 12.0) -> ForbiddenBand:
    """A band given by per cent of the nominal rotor speed."""
    return ForbiddenBand(low / 100 * NOMINAL, high / 100 * NOMINAL, crossing_time)


@pytest.mark.parametrize(
    ("bands", "regions"),
    [
        ((), ((30.0, 50.0),)),
        (((40.0, 42.0),), ((30.0, 40.0), (42.0, 50.0))),
        (((44.0, 60.0), (20.0, 35.0)), ((35.0, 44.0),)),
        (((30.0, 32.0), (50.0, 52.0)), ((32.0, 50.0),)),
        (((10.0, 20.0), (60.0, 70.0)), ((30.0, 50.0),)),
    ],
)
def test_regions_that_bands_leave(bands, regions):
    assert allowed_regions([ForbiddenBand(*ends, 5.0) for ends in bands], 30.0, 50.0) == regions


def test_bands_that_contradict_each_other_or_the_settings_are_refused():
    with pytest.raises(InputError, match=r"forbidden bands 30 to 40 rad/s and 39 to 45 rad/s: must not touch"):
        allowed_regions([ForbiddenBand(39.0, 45.0, 5.0), ForbiddenBand(30.0, 40.0, 5.0)], 20.0, 60.0)
    with pytest.raises(InputError, match=r"contains the rotor speed 44\.4 rad/s, at which the rotor is held"):
        check_bands([band(95.0, 105.0)], bounds=(33.3, 51.0), rate=0.444, held=NOMINAL)
    message = r"crossing_time = 5 s: at 0\.444 rad/s2 it takes 8 s to cross"
    with pytest.raises(InputError, match=message):
        replace(SETTINGS, forbidden_bands=(band(86.0, 94.0, 5.0),))
    replace(SETTINGS, forbidden_bands=(band(86.0, 94.0, 0.0),))  # never to be crossed


def test_cheapest_course_is_that_of_all_courses():
    """Against the enumeration of every course of a small problem, jumps among them."""
    rng = np.random.default_rng(5)
    steps, speed = 5, np.array([30.0, 31.0, 34.0, 35.0])
    layers = Layers(
        time=np.arange(steps + 1.0),
        segment=np.zeros(steps, dtype=int),
        idle=np.zeros(steps, dtype=bool),
        speed=speed,
        region=np.array([0, 0, 1, 1]),
        allowed=np.ones((steps + 1, 4), dtype=bool),
        reach=np.ones(steps),
    )
    shape = 2, steps, 4
    up, down = rng.uniform(0.0, 0.3, (2, *shape))
    maps = SpeedMaps(rng.uniform(0.0, 1.0, shape), np.zeros(shape), up, down, np.full(shape, 10.0), np.zeros(shape))
    jumps = [Jump(1, 2, 1.0), Jump(2, 1, 1.0)]

    def fuel(states: tuple[int, ...]) -> float:
        total = 0.0
        for k, (a, b) in enumerate(zip(states, states[1:], strict=False)):
            change = speed[b] - speed[a]
            if abs(change) > 1.0 and (a, b) not in ((1, 2), (2, 1)):
                return np.inf
            price = maps.up if change > 0 else maps.down
            total += 0.5 * (maps.fuel_flow[0, k, a] + maps.fuel_flow[1, k, b])
            total += 0.5 * change * (price[0, k, a] + price[1, k, b])
        return total

    best = min(product(range(4), repeat=steps + 1), key=fuel)
    found = cheapest(layers, maps, jumps)
    assert found.fuel == pytest.approx(fuel(best), rel=1e-12)
    assert tuple(found.state.tolist()) == best
    alone = cheapest(layers, maps, [])
    assert alone.fuel >= found.fuel and len(set(layers.region[alone.state])) == 1


def test_windows_keep_apart_and_corridors_close_at_their_ends():
    windows = windows_around([(10.0, 18.0, 0, 1), (20.0, 28.0, 1, 0)], [12.0, 12.0], 29.0)
    assert windows == (Window(8.0, 19.0, 0, 1), Window(19.0, 29.0, 1, 0))
    crossings = Crossings(((30.0, 38.0), (42.0, 50.0)), 0, windows)
    lower, upper = crossings.bounds(np.array([0.0, 8.0, 12.0, 19.0, 25.0, 29.0]))
    assert lower.tolist() == [30.0, 30.0, 30.0, 42.0, 30.0, 30.0]
    assert upper.tolist() == [38.0, 38.0, 50.0, 50.0, 50.0, 38.0]
    mesh = crossings.split(Mesh(np.zeros(2, dtype=int), np.array([0.0, 19.0]), np.array([19.0, 20.0])))
    assert {0.0, 8.0, 19.0, 29.0} <= set(mesh.start.tolist()) and len(mesh) == 10


def test_search_over_all_courses_finds_the_optimum_of_the_collocation(transport, make_model):
    """Two methods that have nothing in common but the aircraft; the search knows 0.5 % steps of the rotor speed."""
    grid = FlightGrid(transport, make_model())
    plan = speed_plan(grid, make_model(), takeoff_mass=MASS, settings=SETTINGS)
    trajectory = refined_trajectory(grid, make_model(), takeoff_mass=MASS)
    planned, optimum = (grid.fly(s, takeoff_mass=MASS) for s in (plan.schedule, trajectory.schedule))
    assert optimum.fuel <= planned.fuel < 1.0005 * optimum.fuel
    assert planned.max_rotor_speed_rate <= SETTINGS.rotor_speed_rate * 1.26  # by whole spacings
    assert not plan.crossings.windows


def test_trajectory_keeps_out_of_a_band_but_for_its_crossings(transport, make_model):
    """The free optimum is inside the band for long; with it each crossing is within its time, and the fuel is more."""
    settings = replace(SETTINGS, forbidden_bands=(band(84.0, 90.0, 12.0),))
    free_grid = FlightGrid(transport, make_model())
    grid = free_grid.under(settings)
    free = refined_trajectory(free_grid, make_model(), takeoff_mass=MASS)
    found = refined_trajectory(grid, make_model(), takeoff_mass=MASS, settings=settings)
    assert found.success
    flight = grid.fly(found.schedule, takeoff_mass=MASS)
    assert flight.success and not grid.fly(free.schedule, takeoff_mass=MASS).success
    assert free.fuel < found.fuel < 1.02 * free.fuel
    low, high = settings.forbidden_bands[0].lower, settings.forbidden_bands[0].upper
    time = np.linspace(0.0, transport.duration, 20001)
    speed = np.interp(time, found.schedule.time, found.schedule.rotor_speed)
    inside = (speed > low + 1e-6) & (speed < high - 1e-6)
    starts, ends = np.flatnonzero(np.diff(inside.astype(int)) == 1), np.flatnonzero(np.diff(inside.astype(int)) == -1)
    assert len(starts) == len(ends) > 0
    assert np.all(time[ends] - time[starts] <= 12.0 + 0.1)


def test_a_band_never_to_be_crossed_keeps_the_rotor_on_its_side(transport, make_model):
    settings = replace(SETTINGS, forbidden_bands=(band(80.0, 90.0, 0.0),))
    grid = FlightGrid(transport, make_model(), settings=settings)
    plan = speed_plan(grid, make_model(), takeoff_mass=MASS, settings=settings)
    assert not plan.crossings.windows
    assert plan.schedule.rotor_speed.min() >= 0.9 * NOMINAL * (1 - 1e-12)


def test_periodic_and_free_ends(make_profile, make_model):
    profile = make_profile({"task": "cruise", "duration": 60.0, "speed": 40.0}, {"task": "hover", "duration": 40.0})
    fuel = {}
    for ends in ("pinned", "periodic", "free"):
        settings = replace(SETTINGS, ends=ends)
        grid = FlightGrid(profile, make_model(), settings=settings)
        schedule = speed_plan(grid, make_model(), takeoff_mass=MASS, settings=settings).schedule
        fuel[ends] = grid.fly(schedule, takeoff_mass=MASS).fuel
        if ends == "periodic":
            assert schedule.rotor_speed[0] == schedule.rotor_speed[-1]
    assert fuel["free"] <= fuel["periodic"] <= fuel["pinned"]


def test_no_course_to_the_end_is_no_solution(make_profile, make_model):
    profile = make_profile({"task": "idle", "duration": 10.0}, {"task": "cruise", "duration": 60.0, "speed": 40.0})
    settings = replace(SETTINGS, rotor_speed_rate=0.0)
    held = speed_plan(FlightGrid(profile, make_model()), make_model(), takeoff_mass=MASS, settings=settings)
    assert np.ptp(held.schedule.rotor_speed) < 1e-9
    layers = Layers(
        time=np.array([0.0, 1.0]),
        segment=np.zeros(1, dtype=int),
        idle=np.zeros(1, dtype=bool),
        speed=np.array([40.0, 44.0]),
        region=np.zeros(2, dtype=int),
        allowed=np.array([[True, False], [False, True]]),
        reach=np.array([0.5]),
    )
    flat = np.zeros((2, 1, 2))
    with pytest.raises(NoSolutionError, match="no course within its rate and outside its forbidden bands leads"):
        best_course(layers, SpeedMaps(flat, flat, flat, flat, flat + 1.0, flat), [], periodic=False)
