"""The consistent trajectory finds the optimum of the truth, whatever is wrong with the surrogate."""

from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from tests.schedule.conftest import Aircraft, AnalyticModel
from vrsopt.errors import InputError
from vrsopt.schedule.bands import ForbiddenBand
from vrsopt.schedule.consistent import ConsistentOptions, consistent_trajectory
from vrsopt.schedule.corrected import CorrectedPath, FirstOrder, corrected
from vrsopt.schedule.nlp import node_functions
from vrsopt.schedule.physics_path import FlownPath, path_of
from vrsopt.schedule.refinement import refined_trajectory
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.schedule import NOMINAL_ROTOR_SPEED, ON_LIMIT, ScheduleSettings
from vrsopt.schedule.trajectory import TrajectoryProblem
from vrsopt.schedule.trust_region import kept_sides

MASS = 2050.0


@dataclass(frozen=True)
class Biased(Aircraft):
    """The analytic helicopter with smooth errors: of the fuel flow, its best rotor speed and twist, and the limits."""

    size: float = 1.0

    def outputs(self, mass: Any, omega: Any, twist: Any, rate: Any, c: Any, lib: Any) -> Any:
        fuel, power, limits = super().outputs(mass, omega, twist, rate, c, lib)
        ratio = omega / 44.4
        factor = 1 + self.size * (0.03 + 0.04 * (ratio - 0.9) + 0.2 * (twist - 0.2) + 0.02 * lib.sin(8 * ratio))
        return factor * fuel, power, [limit + 0.01 * self.size * lib.cos(5 * ratio) for limit in limits]


class AnalyticTruth:
    """An analytic helicopter in place of the physics."""

    def __init__(self, make: Any) -> None:
        self.make, self.trims, self.derivatives = make, 0, 0

    def fly(self, problem: Any, schedule: Any, takeoff_mass: float) -> FlownPath:
        inputs, weights, nodes = path_of(problem, schedule)
        model, changes = self.make(nodes), np.cumsum(problem.profile.mass_changes)[np.asarray(nodes.segment)]
        inputs[0] = takeoff_mass + changes
        for _ in range(30):
            values = model.evaluate(*inputs)
            flow = values.fuel_flow.reshape(-1, 3)
            step = problem.mesh.step
            before = np.concatenate([[0.0], np.cumsum(values.fuel_flow * weights)[2::3][:-1]])
            middle = before + step * (5 * flow[:, 0] + 8 * flow[:, 1] - flow[:, 2]) / 24
            end = before + step * (flow[:, 0] + 4 * flow[:, 1] + flow[:, 2]) / 6
            inputs[0] = takeoff_mass + changes - np.column_stack([before, middle, end]).ravel()
        self.trims += len(weights)
        excess = np.where(np.asarray(nodes.idle), -1.0, values.limits)
        return FlownPath(inputs, values.fuel_flow, excess, weights, float(weights @ values.fuel_flow))

    def first_order(self, problem: Any, flown: FlownPath, *, everywhere: bool = False) -> FirstOrder:
        conditions = problem.profile.conditions(problem.points.segment, problem.points.time)
        function, c = self.make(conditions).function()
        node, count = node_functions(function), flown.inputs.shape[1]
        slopes = ca.horzsplit(ca.densify(node.jacobian.map(count)(flown.inputs, c)), 4)
        slopes = np.stack([slope.full() for slope in slopes], axis=-1)
        self.derivatives += count
        return FirstOrder(flown.inputs, node.values.map(count)(flown.inputs, c).full(), slopes)


@pytest.fixture(scope="module")
def short(make_profile: Any) -> Any:
    """A climb and a cruise."""
    return make_profile(
        {"task": "hover", "duration": 20.0},
        {"task": "climb", "duration": 60.0, "speed": 40.0, "climb": np.radians(6.0)},
        {"task": "cruise", "duration": 200.0, "speed": 50.0},
    )


def biased(make_model: Any, size: float = 1.0) -> Any:
    def make(conditions: Any) -> AnalyticModel:
        return AnalyticModel(Biased(size=size), make_model()(conditions).coefficients)

    return make


def test_a_corrected_model_has_the_values_and_slopes_of_the_truth(make_model, transport):
    problem = TrajectoryProblem(transport, corrected(biased(make_model)), shared=False)
    truth = AnalyticTruth(make_model())
    flown = truth.fly(problem, problem.solve(MASS).schedule, MASS)
    first = truth.first_order(problem, flown)
    assert isinstance(problem.model, CorrectedPath)
    function, _ = problem.model.function()
    node, c = node_functions(function), problem.model.coefficients(first)
    for k in (5, 40, 100):
        assert node.values(flown.inputs[:, k], c[:, k]).full().ravel() == pytest.approx(first.values[:, k], rel=1e-12)
        found = node.jacobian(flown.inputs[:, k], c[:, k]).full()
        assert found == pytest.approx(first.slopes[:, :, k], rel=1e-9, abs=1e-12)


def test_the_optimum_of_the_truth_is_found_whatever_the_bias(make_model, transport):
    """Fuel, schedule and limits of the truth's own optimum; the surrogate's is worse, and breaks a limit."""
    own = TrajectoryProblem(transport, make_model())
    best = own.solve(MASS)
    start = TrajectoryProblem(transport, biased(make_model), mesh=best.mesh).solve(MASS)
    assert start.success and abs(start.fuel / best.fuel - 1) > 0.02
    options = ConsistentOptions(rotor_speed=2e-4, twist=2e-4, gap=1e-5)
    truth = AnalyticTruth(make_model())
    found = consistent_trajectory(
        transport, biased(make_model), truth, takeoff_mass=MASS, trajectory=start, options=options
    )
    assert found.success, found.message
    assert found.fuel_physics == pytest.approx(best.fuel, rel=5e-6)
    assert found.trajectory.fuel == pytest.approx(found.fuel_physics, rel=1e-5)
    assert found.trajectory.schedule.rotor_speed == pytest.approx(best.schedule.rotor_speed, abs=0.05)
    assert found.optimality.excess <= ON_LIMIT < found.history[0].excess
    assert found.optimality.at_stake < 0.03 * found.surrogate.at_stake
    kept = [step for step in found.history if step.kept]
    assert len(kept) >= 3 and kept[-1].rotor_speed < 2e-4


def test_a_region_too_wide_is_halved_until_the_fuel_falls(make_model, short):
    """A surrogate with curvature of the wrong sign goes to the end of the region every time."""

    @dataclass(frozen=True)
    class Flat(Biased):
        def outputs(self, mass: Any, omega: Any, twist: Any, rate: Any, c: Any, lib: Any) -> Any:
            fuel, power, limits = super().outputs(mass, omega, twist, rate, c, lib)
            return fuel * (1 - 4.0 * (twist - 0.17) ** 2 + 0.3 * (twist - 0.17)), power, limits

    def make(conditions: Any) -> AnalyticModel:
        return AnalyticModel(Flat(size=0.0), make_model()(conditions).coefficients)

    best = TrajectoryProblem(short, make_model()).solve(MASS)
    start = TrajectoryProblem(short, make, mesh=best.mesh).solve(MASS)
    truth = AnalyticTruth(make_model())
    found = consistent_trajectory(short, make, truth, takeoff_mass=MASS, trajectory=start)
    assert found.success, found.message
    assert found.fuel_physics == pytest.approx(best.fuel, rel=1e-5)
    assert found.history[0].fuel_physics > 1.001 * best.fuel
    assert found.history[-1].region[1] < 0.2 * found.history[0].region[1]
    fuels = [step.fuel_physics for step in found.history if step.kept]
    assert all(later <= earlier * (1 + 1e-6) for earlier, later in zip(fuels, fuels[1:], strict=False))


def test_what_is_not_reached_is_said(make_model, short):
    start = TrajectoryProblem(short, biased(make_model)).solve(MASS)
    options = ConsistentOptions(most_solves=2)
    truth = AnalyticTruth(make_model())
    found = consistent_trajectory(
        short, biased(make_model), truth, takeoff_mass=MASS, trajectory=start, options=options
    )
    assert not found.success and "2 solves" in found.message and not found.trajectory.schedule.success
    with pytest.raises(InputError, match="most_solves = 1: must be at least 2"):
        replace(options, most_solves=1)


def test_sides_of_bands_are_those_of_the_schedule():
    bands = ForbiddenBand(36.0, 38.0, 10.0), ForbiddenBand(30.0, 34.0, 10.0)
    speed = np.array([35.0, 34.0, 36.0 + 1e-6, 37.0, 38.0, 44.0, 33.0])
    lower, upper = kept_sides(speed, bands, 33.3, 50.0)
    assert lower.tolist() == [34.0, 34.0, 34.0, 34.0, 38.0, 38.0, 34.0]
    assert upper.tolist() == [36.0, 36.0, 36.0, 50.0, 50.0, 50.0, 36.0]
    assert [bound.tolist() for bound in kept_sides(speed[:1], (), 33.3, 50.0)] == [[33.3], [50.0]]


def test_forbidden_bands_are_kept_or_their_breach_is_said(make_model, short):
    """The truth's optimum is inside the band, the surrogate's schedule beside it; without a side it goes there."""
    band = ForbiddenBand(0.78 * NOMINAL_ROTOR_SPEED, 0.83 * NOMINAL_ROTOR_SPEED, 15.0)
    settings = ScheduleSettings(forbidden_bands=(band,))
    grid = FlightGrid(short, biased(make_model), settings=settings)
    start = refined_trajectory(grid, biased(make_model), takeoff_mass=MASS, settings=settings)
    free = TrajectoryProblem(short, biased(make_model), mesh=start.mesh).solve(MASS)

    def consistent(trajectory: Any) -> Any:
        truth = AnalyticTruth(make_model())
        return consistent_trajectory(
            short, biased(make_model), truth, takeoff_mass=MASS, trajectory=trajectory, settings=settings
        )

    found, flown = consistent(start), FlightGrid(short, make_model(), settings=settings)
    assert found.success and "; stationarity" in found.message
    assert flown.fly(found.trajectory.schedule, takeoff_mass=MASS).success
    assert found.optimality.at_stake < 0.1 * found.surrogate.at_stake
    astray = consistent(free)
    assert not astray.success and "forbidden rotor speed 78 to 83 %: " in astray.message
    assert astray.fuel_physics < found.fuel_physics


def test_a_schedule_that_is_not_stationary_is_no_success(make_model, short):
    """Derivatives of which only three tenths point where the truth's do: problem and physics agree all the same."""

    @dataclass(frozen=True)
    class Tilted(Aircraft):
        def outputs(self, mass: Any, omega: Any, twist: Any, rate: Any, c: Any, lib: Any) -> Any:
            fuel, power, limits = super().outputs(mass, omega, twist, rate, c, lib)
            return fuel * (1 + 0.05 * (twist - 0.2)), power, limits

    class Weak(AnalyticTruth):
        def first_order(self, problem: Any, flown: FlownPath, *, everywhere: bool = False) -> FirstOrder:
            first = super().first_order(problem, flown)
            first.slopes[0, 2] *= 1.0 if everywhere else 0.3
            return first

    def make(conditions: Any) -> AnalyticModel:
        return AnalyticModel(Tilted(), make_model()(conditions).coefficients)

    def consistent(truth: AnalyticTruth) -> Any:
        return consistent_trajectory(short, make, truth, takeoff_mass=MASS, trajectory=start)

    start = TrajectoryProblem(short, make).solve(MASS)
    right, weak = consistent(AnalyticTruth(make_model())), consistent(Weak(make_model()))
    assert right.success and right.optimality.at_stake < 1e-5 * right.fuel_physics
    assert abs(weak.trajectory.fuel / weak.fuel_physics - 1.0) < 5e-5 and weak.fuel_physics > right.fuel_physics
    assert not weak.success and not weak.trajectory.schedule.success
    assert (
        "no optimum of the physics: 0.015" in weak.message and "% of the fuel at stake, 0.01 % allowed" in weak.message
    )


@pytest.mark.parametrize("everywhere_right", [True, False])
def test_a_standstill_because_the_region_has_shrunk_is_no_success(make_model, short, everywhere_right):
    """Derivatives that point uphill: steps are refused until those of all points are asked for; if these do too, until
    the region alone keeps the steps short."""

    @dataclass(frozen=True)
    class Tilted(Aircraft):
        def outputs(self, mass: Any, omega: Any, twist: Any, rate: Any, c: Any, lib: Any) -> Any:
            fuel, power, limits = super().outputs(mass, omega, twist, rate, c, lib)
            return fuel * (1 + 0.005 * (twist - 0.2)), power, limits

    class Uphill(AnalyticTruth):
        def first_order(self, problem: Any, flown: FlownPath, *, everywhere: bool = False) -> FirstOrder:
            first = super().first_order(problem, flown)
            first.slopes[0, 2] *= 1.0 if everywhere and everywhere_right else -1.0
            return first

    def make(conditions: Any) -> AnalyticModel:
        return AnalyticModel(Tilted(), make_model()(conditions).coefficients)

    start = TrajectoryProblem(short, make).solve(MASS)
    truth = Uphill(make_model())
    found = consistent_trajectory(short, make, truth, takeoff_mass=MASS, trajectory=start)
    assert abs(found.trajectory.fuel / found.fuel_physics - 1.0) < 5e-4
    if everywhere_right:
        assert found.success and not found.history[1].kept and found.history[-1].kept, found.message
    else:
        assert not found.success and "solves: no room to tell, the region has shrunk; stationarity" in found.message
        assert not any(step.kept for step in found.history[1:])
