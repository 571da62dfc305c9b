"""The study of the optimum rotor speed: its machinery on a few points, and what its limits must do."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest

from vrsopt.aircraft import load_aircraft
from vrsopt.limits import Limits
from vrsopt.turboshaft.bulk import solve_many
from vrsopt.turboshaft.data import load_engine

PROBLEMS = str(Path(__file__).parents[1] / "problems")
sys.path.insert(0, PROBLEMS)
try:
    import optimum_speed
    import optimum_speed_curves as curves
    import optimum_speed_limits as limits
    import optimum_speed_page as page
finally:
    sys.path.remove(PROBLEMS)

AIRCRAFT = load_aircraft("bo105")
GRID = ((1600.0, 2400.0), (0.0,), (30.0,))
CONSTANTS = {"induced_power_factor": 1.14, "section_drag_level": 0.0088, "parasite_area": 1.42}


@pytest.fixture(scope="module")
def walk():
    return curves.Walk(curves.Physics(), CONSTANTS)


@pytest.fixture(scope="module")
def level(walk):
    """Power curves at 30 m/s, sea level, by mass."""
    return {flight.mass: curve for flight, curve in walk.curves(*GRID)}


def best(curve, mass, *, margin=1.3, coupled=True):
    kept = Limits(AIRCRAFT, load_engine(AIRCRAFT.engine), manoeuvre_margin=margin)
    flight = curves.Flight(mass, 0.0, 30.0)
    return limits.optimum(curve, flight, kept, limits.Engine.at(0.0, 30.0), coupled=coupled, tail_limit=True)


def quadratic(ratio_of_least, depth=0.3, slowest=0.75):
    """A curve whose power is least at a known rotor speed."""
    ratio = np.linspace(1.15, slowest, 10)
    power = 200e3 * np.exp(depth * (ratio - ratio_of_least) ** 2 / 0.04)
    return curves.Curve(ratio, power, np.full(10, 0.02), "lower bound")


def test_every_combination_is_one_model():
    models = list(optimum_speed.factorial())
    assert len(models) == len(set(models)) == 40
    assert models[0] == curves.Physics()


def test_ingredients_reach_the_trim():
    physics = curves.Physics("recovery 0.95", "linear", "blade passage")
    assert physics.fidelity().chord_recovery == 0.95 and physics.fidelity().blade_passage
    assert not physics.stalling_tail
    assert curves.Physics().fidelity().chord_recovery is None
    assert curves.Physics("NACA 0012").aircraft.main_rotor.section.zero_lift_sine != (
        AIRCRAFT.main_rotor.section.zero_lift_sine
    )


def test_walk_gives_the_power_of_a_trim_on_its_own(walk, level):
    curve = level[2400.0]
    assert curve.ratio[0] == 1.15 and np.all(np.diff(curve.ratio) < 0)
    flight = curves.Flight(2400.0, 0.0, 30.0)
    for k in (3, len(curve.ratio) - 1):
        alone = walk.solve(flight, float(curve.ratio[k]))
        assert curves.rotor_power(alone) == pytest.approx(curve.power[k], rel=1e-6)


def test_interpolated_power_is_that_of_a_trim(walk, level):
    ratio = 0.5 * float(level[1600.0].ratio[3] + level[1600.0].ratio[4])
    trimmed = curves.rotor_power(walk.solve(curves.Flight(1600.0, 0.0, 30.0), ratio))
    between = math.exp(level[1600.0].between(np.log(level[1600.0].power), np.array([ratio]))[0])
    assert between == pytest.approx(trimmed, rel=5e-4)


def test_walk_ends_where_the_blades_could_carry_no_more():
    kept = Limits(AIRCRAFT, load_engine(AIRCRAFT.engine), manoeuvre_margin=1.0)
    assert curves.slowest(kept, curves.Flight(1600.0, 0.0, 0.0)) == curves.SLOWEST
    flight = curves.Flight(2400.0, 2000.0, 60.0)
    low = curves.slowest(kept, flight)
    assert curves.SLOWEST < low < 1.0
    tip = low * AIRCRAFT.main_rotor.nominal_rotor_speed * AIRCRAFT.main_rotor.radius
    loading = 2400 * 9.80665 / (1.0065 * AIRCRAFT.main_rotor.blade_area * tip**2)
    assert loading == pytest.approx(np.interp(60 / tip, [0.2, 0.3, 0.4], [0.13, 0.115, 0.095]), rel=0.01)


def test_interior_optimum_and_its_band():
    found = best(quadratic(0.95), 1600.0, coupled=False)
    assert found.active == "none"
    assert found.ratio == pytest.approx(0.95, abs=0.002)
    assert found.band[0] < found.ratio < found.band[1] < 1.0
    assert found.power_change == pytest.approx(math.exp(-0.3 * 0.05**2 / 0.04) - 1, abs=5e-4)


def test_coupled_engine_pulls_the_optimum_down_at_part_load():
    alone, together = (best(quadratic(0.95), 1600.0, coupled=coupled) for coupled in (False, True))
    assert together.ratio < alone.ratio


def test_margin_sets_the_heavy_optimum(level):
    slow = [best(level[2400.0], 2400.0, margin=margin) for margin in (1.0, 1.3, 1.5)]
    assert slow[0].ratio < slow[1].ratio < slow[2].ratio <= 1.0
    assert slow[1].active == slow[2].active == "blade loading"
    tip = slow[1].ratio * AIRCRAFT.main_rotor.nominal_rotor_speed * AIRCRAFT.main_rotor.radius
    loading = 2400 * 9.80665 / (1.225 * AIRCRAFT.main_rotor.blade_area * tip**2)
    assert 1.3 * loading == pytest.approx(np.interp(30 / tip, [0.1, 0.2], [0.14, 0.13]), rel=0.01)


def test_light_aircraft_slows_to_the_bound(level):
    found = best(level[1600.0], 1600.0, margin=1.0)
    assert found.active == "lower bound" and found.ratio == pytest.approx(0.75)
    assert found.power_change < found.fuel_change < -0.05


def test_no_optimum_without_the_nominal_rotor():
    assert best(quadratic(1.1, slowest=1.02), 1600.0) is None


def test_engine_table_is_the_engine():
    table = limits.Engine.at(1000.0, 40.0)
    mach = 40.0 / 336.43
    points = np.array(
        [[137e3, 0.873, 1000.0, 0.0, mach, 0.0, 0.0, 0.0], [231e3, 1.041, 1000.0, 0.0, mach, 0.0, 0.0, 0.0]]
    )
    exact = solve_many(points).outputs["fuel_flow"]
    fuel, _ = table.run(points[:, 0], points[:, 1], coupled=True)
    assert fuel == pytest.approx(exact, rel=2e-5)
    free, _ = table.run(points[:, 0], points[:, 1], coupled=False)
    assert np.all(free < fuel)


def test_page_keeps_its_text_and_gets_its_tables(tmp_path, walk, level):
    (tmp_path / "figures").mkdir()
    (tmp_path / "optimum_speed.md").write_text("# Title\n\nWords.\n\n" + page.MARKER + "\nold tables")
    flights = tuple((curves.Flight(mass, 0.0, 30.0), curve) for mass, curve in level.items())
    models = [
        optimum_speed.Mapped(curves.Physics(tail_rotor=tail), CONSTANTS, flights, "", 1.0)
        for tail in curves.TAIL_ROTORS
    ]
    dataset = optimum_speed.with_optima(optimum_speed.gathered(models, GRID))
    page.write_page(tmp_path, dataset, {"induced_power_factor": (1.0, 1.1), "parasite_area": (1.3, 1.6)})
    text = (tmp_path / "optimum_speed.md").read_text()
    assert text.startswith("# Title\n\nWords.\n") and "old tables" not in text
    assert "**1.140** / 1.420" in text
    assert f"{100 * best(level[2400.0], 2400.0).ratio:.1f} b" in text
    assert len(list((tmp_path / "figures").glob("*.png"))) == 3
