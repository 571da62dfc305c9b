"""The main job on the rescue mission, solved as in the README's first example, on the surrogate and on the physics."""

import inspect
import io
import re
import sys
from contextlib import chdir, redirect_stdout
from dataclasses import dataclass, replace

import matplotlib.pyplot as plt
import numpy as np
import pytest

import vrsopt
from tests.page_lines import assert_on_page
from tests.shown_code import FIRST_NOTEBOOK, ROOT, code_cells, first_example
from vrsopt.helicopter import helicopter
from vrsopt.mission.file import mission_from, read_mission
from vrsopt.mission.profile import Profile
from vrsopt.quantity import read_toml
from vrsopt.residual import TOLERANCE
from vrsopt.schedule.batched import batched_minimum
from vrsopt.schedule.compare import solve
from vrsopt.schedule.comparison import Comparison
from vrsopt.schedule.decision import decision_nodes
from vrsopt.schedule.genetic import genetic_minimum
from vrsopt.schedule.nominal import nominal_schedule
from vrsopt.schedule.pointwise import pointwise_schedule
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.study_input import loaded, schedule_settings
from vrsopt.schedule.surrogate_path import SurrogateAircraft
from vrsopt.schedule.trajectory import TrajectoryProblem
from vrsopt.surrogate.design import model_data_hash

PROBLEMS = ROOT / "problems"
sys.path.insert(0, str(PROBLEMS))
try:
    import validation
finally:
    sys.path.remove(str(PROBLEMS))

SARM = PROBLEMS / "sarm.toml"


@dataclass(frozen=True)
class Example:
    """What the README's first example leaves and prints."""

    result: Comparison
    printed: str


@pytest.fixture(scope="module")
def example() -> Example:
    """The example as it stands, but with the pointwise search beside the two schedules that it asks for."""
    asked, printed, names = 'schedules=("nominal", "trajectory")', io.StringIO(), {"__name__": "__main__"}
    code = first_example()
    assert code.count(asked) == 1
    with chdir(ROOT), redirect_stdout(printed):
        exec(code.replace(asked, 'schedules=("nominal", "pointwise", "trajectory")'), names)
    return Example(names["result"], printed.getvalue())


@pytest.fixture(scope="module")
def sarm(example) -> Comparison:
    return example.result


@pytest.mark.slow
def test_the_example_of_the_readme_prints_what_it_says(example):
    saved = re.search(r"mission fuel (-\d+\.\d+) %, on the physics (-\d+\.\d+) %", example.printed)
    assert saved, example.printed
    assert float(saved[1]) == pytest.approx(float(saved[2]), abs=0.2)


@pytest.mark.slow
def test_the_first_notebook_runs(sarm, monkeypatch):
    """Its mission is that of the example, and solved already."""

    def solved(*arguments, **options):
        asked = inspect.signature(solve).bind(*arguments, **options).arguments
        assert asked.keys() == {"mission", "schedules"} and asked["mission"] == sarm.mission
        return replace(sarm, results={name: sarm.results[name] for name in asked["schedules"]})

    monkeypatch.setattr(vrsopt, "solve", solved)
    monkeypatch.chdir(FIRST_NOTEBOOK.parent)
    names = {}
    with redirect_stdout(io.StringIO()) as printed, plt.rc_context({"backend": "agg"}):
        for code in code_cells(FIRST_NOTEBOOK):
            exec(code, names)
    plt.close("all")
    line = re.compile(r"^trajectory +\d+\.\d\d kg +-\d+\.\d\d %   physics +-\d+\.\d\d %$", re.MULTILINE)
    assert line.search(printed.getvalue()), printed.getvalue()


@pytest.mark.slow
class TestRescueMission:
    def test_every_schedule_succeeds_on_surrogate_and_physics(self, sarm):
        assert sarm.success
        assert set(sarm.results) == {"nominal", "pointwise", "pointwise_rate_limited", "trajectory"}
        for result in sarm.results.values():
            assert result.flight.success and result.physics.success
            assert result.physics.residual_norm < TOLERANCE

    def test_the_validation_page_has_these_numbers(self, sarm):
        """But for the last column: a node more or less on the limit."""
        page = re.sub(r"[^|]*\|$", "", validation.PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
        assert_on_page(["| " + " | ".join(row[:-1]) + " |" for row in validation.mission_rows(sarm)], page)

    def test_the_physics_confirms_the_fuel(self, sarm):
        for result in sarm.results.values():
            assert result.physics.fuel == pytest.approx(result.flight.fuel, rel=1.5e-3)
            assert result.fuel_physics_delta_percent == pytest.approx(result.fuel_delta_percent, abs=0.1)
            own, physics = result.emissions, result.physics.emissions
            for name in ("co2", "nox", "co"):
                assert physics.total(name) == pytest.approx(own.total(name), rel=3e-3)
            assert physics.quadrature_error["nox"] < 1e-3 * own.total("nox")

    def test_take_off_mass_leaves_exactly_the_reserve(self, sarm):
        loading = sarm.loading
        assert loading.fuel_loaded - loading.fuel_burned == pytest.approx(loading.reserve_fuel, abs=2e-6)
        assert sarm.results["nominal"].flight.mass[-1] == pytest.approx(1615.0 + loading.reserve_fuel, abs=1e-5)

    def test_trajectory_keeps_its_rates_and_costs_no_more_than_the_rate_limited_search(self, sarm):
        trajectory, limited = sarm.results["trajectory"].flight, sarm.results["pointwise_rate_limited"].flight
        for flight in (trajectory, limited):
            assert flight.max_rotor_speed_rate <= 0.01 * 44.4 * (1 + 1e-6)
            assert flight.max_twist_rate <= np.radians(1.0) * (1 + 1e-6)
        assert trajectory.fuel <= limited.fuel * 1.0002

    def test_resimulation_confirms_the_nlp(self, sarm):
        solver = sarm.summary()["solver"]
        assert abs(solver["resimulation_error"]) < 1e-4
        assert solver["iterations"] <= 60 * sarm.trajectory.rounds

    def test_schedules_save_fuel_and_order_as_they_must(self, sarm):
        fuel = {name: result.flight.fuel for name, result in sarm.results.items()}
        assert fuel["pointwise"] < fuel["pointwise_rate_limited"] < fuel["nominal"]
        closed = sarm.results["trajectory"].fuel_delta_closed_percent
        assert closed < sarm.results["trajectory"].fuel_delta_percent < 0

    def test_ends_and_idle_are_nominal(self, sarm):
        schedule = sarm.results["trajectory"].schedule
        idle = [k for k, segment in enumerate(sarm.profile.segments) if segment.kind == "idle"]
        still = np.isin(schedule.segment, idle)
        assert schedule.rotor_speed[still] == pytest.approx(44.4, rel=1e-6)
        assert schedule.twist[still] == pytest.approx(np.radians(8.0), rel=1e-6)

    def test_genetic_search_finds_the_optimum_of_the_batched_one(self, sarm):
        settings = schedule_settings(sarm.mission, helicopter("bo105"))
        model = SurrogateAircraft(_surrogate(), sarm.limits)(decision_nodes(sarm.profile, 60.0).conditions())
        some = np.linspace(0, len(model.condition) - 1, 12).astype(int)
        model, mass = model.nodes(some), np.full(len(some), 1850.0)
        box = settings.box(model.bounds)
        exact, (found, _) = (search(model, mass, box=box) for search in (batched_minimum, genetic_minimum))
        assert found.fuel_flow == pytest.approx(exact.fuel_flow, rel=1e-4)
        assert np.max(found.excess) < 1e-9


def _surrogate():
    return loaded(None, model_data_hash())


@pytest.mark.slow
def test_without_rates_and_inertia_the_trajectory_is_the_pointwise_optimum():
    mission = read_mission(SARM)
    profile, machine = Profile.of(mission), helicopter("bo105")
    settings = replace(schedule_settings(mission, machine), rotor_speed_rate=None, twist_rate=None)
    limits = solve_limits(mission)
    make = SurrogateAircraft(_surrogate(), limits, kinetic_energy=False)
    trajectory = TrajectoryProblem(profile, make, settings=replace(settings, ends="free")).solve(1855.0)
    assert trajectory.success
    pointwise = pointwise_schedule(profile, make, takeoff_mass=1855.0, settings=settings, method="batched")
    grid = FlightGrid(profile, make)
    fuel = [grid.fly(schedule, takeoff_mass=1855.0).fuel for schedule in (trajectory.schedule, pointwise)]
    assert fuel[0] == pytest.approx(fuel[1], rel=5e-4)


def solve_limits(mission):
    from vrsopt.limits import Limits

    machine = helicopter(mission.aircraft)
    return Limits(machine.aircraft, machine.engine, mission.limits.limits, mission.limits.manoeuvre_margin)


@pytest.mark.slow
def test_a_heavy_aircraft_after_light_turns():
    """The box of the surrogate bounds mass times load factor node by node, not the mass everywhere."""
    data = read_toml(SARM)
    data["loading"]["equipment_kg"]["cargo"] = 245.0
    mission = mission_from(data, where="sarm")
    profile, machine = Profile.of(mission), helicopter("bo105")
    make, settings = SurrogateAircraft(_surrogate(), solve_limits(mission)), schedule_settings(mission, machine)
    grid = FlightGrid(profile, make)
    flight = grid.fly(nominal_schedule(profile, settings), takeoff_mass=2120.0)
    assert flight.mass.max() > 2500 / 1.18
    assert TrajectoryProblem(profile, make, settings=settings).solve(2120.0).success
