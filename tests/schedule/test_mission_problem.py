"""A mission stated, solved, changed and solved again through the open interface, on the shipped surrogate."""

from __future__ import annotations

import dataclasses
import json
import math
import re
import shutil
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

import vrsopt
from vrsopt.errors import InputError
from vrsopt.schedule.trajectory_file import FORM, load_trajectory
from vrsopt.surrogate import classic_netcdf, digested

HOP = Path(__file__).parents[1] / "hop.toml"


@pytest.fixture(scope="module")
def problem() -> vrsopt.MissionProblem:
    return vrsopt.MissionProblem(HOP)


@pytest.fixture(scope="module")
def solved(problem) -> vrsopt.Trajectory:
    return problem.solve()


@pytest.fixture(scope="module")
def saved(solved, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("trajectory") / "hop.nc"
    solved.save(path)
    return path


def test_solution_is_flown_on_the_fine_grid(problem, solved):
    flight = problem.fly(solved)
    assert solved.success and flight.success
    assert flight.fuel == pytest.approx(solved.fuel, rel=5e-5)
    assert flight.fuel < 0.9 * problem.fly(problem.setup.nominal).fuel
    assert solved.arcs[0].start == 0.0 and solved.arcs[-1].end == pytest.approx(problem.profile.duration)


def test_a_saved_trajectory_is_the_same_to_the_last_bit(solved, saved):
    found = load_trajectory(saved)
    for item in dataclasses.fields(vrsopt.Trajectory):
        ours, theirs = getattr(solved, item.name), getattr(found, item.name)
        if isinstance(ours, np.ndarray):
            assert np.array_equal(ours, theirs, equal_nan=True), item.name
        elif isinstance(ours, dict):
            assert list(ours) == list(theirs)
            assert all(np.array_equal(ours[name], theirs[name]) for name in ours), item.name
        elif item.name not in ("schedule", "mesh"):
            assert ours == theirs, item.name
    for name in ("segment", "time", "rotor_speed", "twist"):
        assert np.array_equal(getattr(solved.schedule, name), getattr(found.schedule, name))
    assert found.mesh.equals(solved.mesh)


def test_warm_start_from_a_file(problem, solved, saved):
    again = problem.solve(load_trajectory(saved))
    assert again.iterations < 0.4 * solved.iterations
    assert again.fuel == pytest.approx(solved.fuel, rel=1e-5)


def test_changed_settings_need_no_rebuild(problem, solved):
    before = problem.problem
    slow = problem.solve(solved, rotor_speed_rate=0.3, refine=False)
    free = problem.solve(solved, ends="free", refine=False)
    assert problem.problem is before
    assert free.fuel < solved.fuel < slow.fuel
    assert problem.fly(slow).max_rotor_speed_rate <= 0.3 * (1 + 1e-6)


def test_a_limit_in_the_way_is_named_with_its_unit(problem):
    found = problem.solve(limits={"engine power": 0.4}, refine=False)
    assert not found.success
    assert (
        "infeasible; it would take engine power 137.1 kW against 102.8 kW at 198 s (hover at site; also"
        in found.message
    )


def test_own_constraints_and_objective():
    problem = vrsopt.MissionProblem(HOP)
    q = problem.quantities
    problem.add_constraint("tip speed", 4.912 * q["rotor_speed"], lower=190.0, unit="m/s", tasks=["cruise to site"])
    problem.add_integral("cruise fuel", q["fuel_flow"], upper=5.0, unit="kg", tasks=["cruise to site"])
    problem.minimize(q["fuel_flow"] + 1e-6 * q["torque"])
    found = problem.solve(refine=False)
    assert found.success
    cruise = [k for k, segment in enumerate(problem.profile.segments) if segment.task == "cruise to site"]
    there = np.isin(found.schedule.segment, cruise)
    assert np.min(4.912 * found.schedule.rotor_speed[there]) >= 190.0 * (1 - 1e-6)
    assert found.limit_multipliers["tip speed"].any() and 0.0 < found.integrals["cruise fuel"] < 5.0
    assert found.objective > found.fuel


def test_functions_are_those_of_the_solver(problem, solved):
    """At the solution the gradient of the Lagrangian is zero."""
    functions, p = problem.functions, problem.problem.parameters(problem.takeoff_mass)
    assert functions.constraints(solved.x, p).numel() == len(functions.rows)
    assert len(solved.x) == len(functions.columns)
    x, q = functions.objective.mx_in()
    slope = ca.Function("slope", [x, q], [ca.gradient(functions.objective(x, q), x)])
    jacobian = functions.jacobian(solved.x, p)[1]
    stationary = slope(solved.x, p) + ca.mtimes(jacobian.T, solved.lam_g) + solved.lam_x
    assert float(ca.norm_inf(stationary)) < 1e-6


@pytest.mark.parametrize(
    ("state", "complaint"),
    [
        (
            lambda p: p.add_constraint("x", p.quantities["twist"], upper=1.0, tasks=["cruise"]),
            "tasks = 'cruise': allowed",
        ),
        (lambda p: p.add_constraint("torque", p.quantities["twist"], upper=1.0), "already has a limit of this name"),
        (lambda p: p.add_constraint("x", p.quantities["twist"]), "lower and upper = None: must have one of them"),
        (lambda p: p.quantities["speeed"], "'speeed': must be one of mass, rotor_speed"),
        (lambda p: p.minimize("time"), "objective = 'time': allowed: fuel, weights or an expression"),
        (lambda p: p.minimize({"noise": 1.0}), "objective: 'noise': weights of fuel, nox"),
        (lambda p: p.solve(rotorspeed_rate=1.0), "rotorspeed_rate: allowed changes: nominal_rotor_speed"),
        (lambda p: p.solve(rotor_speed_rate=None), "limited and unlimited differ"),
        (lambda p: p.solve(limits={"power": 0.9}), "limits = power: must be of"),
    ],
)
def test_what_can_not_be_stated_is_refused_in_one_line(problem, state, complaint):
    with pytest.raises(InputError, match=complaint):
        state(problem)


def test_a_trajectory_of_another_mission_is_refused(problem, solved):
    mesh = dataclasses.replace(solved.mesh, segment=np.minimum(solved.mesh.segment, 3))
    with pytest.raises(InputError, match="segments = 4: this mission has 7"):
        problem.solve(dataclasses.replace(solved, mesh=mesh))
    late = dataclasses.replace(solved.mesh, start=solved.mesh.start + np.where(solved.mesh.segment > 2, 1.0, 0.0))
    with pytest.raises(InputError, match=r"start of segment 3 = \S+ s: in this mission \S+ s \(cruise to site\)"):
        problem.solve(dataclasses.replace(solved, mesh=late))


def rewritten(path: Path, target: Path, change) -> Path:
    """The file with its record or arrays changed, and a digest that is right again."""
    attributes, variables = classic_netcdf.read(path.read_bytes())
    arrays = {name: (one.dimensions, one.values) for name, one in variables.items()}
    record = json.loads(attributes["record"])
    change(record, arrays)
    texts = {"structure": attributes["structure"], "record": json.dumps(record)}
    digested.save(target, arrays, texts, form=FORM)
    return target


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda record, arrays: arrays.pop("x"), "not a complete trajectory: x is missing"),
        (lambda record, arrays: record.pop("fuel"), "not a complete trajectory: fuel is missing"),
        (lambda record, arrays: record.update(end=[1]), "record: not what this program writes"),
        (lambda record, arrays: record.update(end=[True, "OPTIMAL", ""]), "status = 'OPTIMAL': one of CONVERGED, "),
        (lambda record, arrays: record.update(cost_factor=math.inf), "cost_factor = inf: a finite number"),
        (lambda record, arrays: record.update(iterations="many"), "record: not what this program writes"),
        (lambda record, arrays: record.update(transcription="euler"), "structure: does not match its arrays"),
        (lambda record, arrays: arrays["x"][1].fill(np.nan), "x: finite numbers only"),
        (lambda record, arrays: arrays["mesh_segment"][1].fill(0.5), "segments: whole numbers from 0"),
    ],
)
def test_a_file_that_does_not_fit_is_refused_by_field(saved, tmp_path, change, complaint):
    with pytest.raises(InputError, match=complaint):
        load_trajectory(rewritten(saved, tmp_path / "bad.nc", change))


def test_a_damaged_or_foreign_file_is_refused(saved, tmp_path):
    damaged = Path(shutil.copy(saved, tmp_path / "damaged.nc"))
    content = bytearray(damaged.read_bytes())
    content[-9] ^= 1
    damaged.write_bytes(content)
    with pytest.raises(InputError, match="damaged: its content does not match its digest"):
        load_trajectory(damaged)
    with pytest.raises(InputError, match="not a trajectory, or damaged"):
        load_trajectory(HOP)
    with pytest.raises(InputError, match="not a trajectory: no attribute format"):
        load_trajectory(Path(vrsopt.__file__).parent / "data" / "surrogate.nc")


@pytest.mark.slow
def test_example_of_the_readme(tmp_path, monkeypatch, capsys):
    example = re.findall(r"```python\n(.*?)```", (HOP.parents[1] / "README.md").read_text(), re.DOTALL)[1]
    assert "MissionProblem" in example
    monkeypatch.chdir(tmp_path)
    exec(example.replace("problems/sarm.toml", str(HOP)), {})  # what is tested is that it runs
    shown = capsys.readouterr().out.splitlines()
    assert shown[0].startswith("optimal to 1e-07 {'mission NOx': 0.0") and (tmp_path / "slower.nc").is_file()
    surrogate, physics = map(float, shown[-1].split())
    assert surrogate == pytest.approx(physics, rel=2e-3)


@pytest.mark.slow
def test_own_constraint_decides_on_the_side_of_a_forbidden_band():
    """Least fuel is below the band, the constraint above it."""
    problem = vrsopt.MissionProblem(HOP)
    speed, nominal = problem.quantities["rotor_speed"], problem.settings.nominal_rotor_speed
    bands = (vrsopt.ForbiddenBand(0.85 * nominal, 0.93 * nominal, 20.0),)
    free = problem.solve(forbidden_bands=bands)
    assert free.success and free.schedule.rotor_speed.min() < 0.85 * nominal
    problem.add_constraint("fast", speed, lower=0.935 * nominal, unit="rad/s", tasks=["cruise to site"])
    fast = problem.solve(forbidden_bands=bands)
    assert fast.success and problem.fly(fast, forbidden_bands=bands).success
    assert fast.schedule.rotor_speed.min() >= 0.93 * nominal * (1 - 1e-9)


@pytest.mark.parametrize(
    ("stated", "complaint"),
    [
        ({"mass": math.nan}, "mass = nan: a number above 0, kg"),
        ({"mass": "a"}, "mass = 'a': a number above 0, kg"),
        ({"settings": 5}, "settings = 5: must be of ScheduleSettings"),
        ({"mesh": 5}, "mesh = 5: must be of MeshOptions, Mesh"),
        ({"surrogate": 5}, "surrogate = 5: must be of Surrogate, Path, str"),
        ({"ipopt": 5}, "ipopt = 5: must be of Mapping"),
    ],
)
def test_arguments_of_another_kind_are_refused(stated, complaint):
    with pytest.raises(InputError, match=re.escape(complaint)):
        vrsopt.MissionProblem(HOP, **stated)
    with pytest.raises(InputError, match="mission = None: must be of Mission"):
        vrsopt.MissionProblem(None)


def test_a_flight_within_changed_limits_passes(problem, solved):
    """The blade loading is on its limit: a tighter one is broken, one within reach is flown as it was asked."""
    assert "blade loading" in problem.fly(solved, limits={"blade loading": 0.9}).message
    with pytest.raises(InputError, match="limits = power: must be of"):
        problem.fly(solved, limits={"power": 0.9})
