"""Schedules of rotor speed and blade twist that save fuel over a helicopter mission.

The verbs, in the order of the work, each also a sub-command of the command line ``vrsopt``:

``trim``      the aircraft with its engines at one operating point: powers, fuel flow, emissions, controls, limits
``engine``    one engine at a demanded power, gas-generator speed, turbine temperature or rating, with its emissions
``sample``    the operating point at many points: a design of experiments; ``add_points`` adds points of one's own
``fit``       a surrogate of a design of experiments, with its leave-one-out figures
``envelope``  the best rotor speed and twist at every operating point of the flight envelope, as maps
``solve``     a mission flown with several schedules, compared on the surrogate and on the physics

``physics_optimum`` is the rotor speed and twist of least fuel at one operating point, on the physics itself.
``MissionProblem`` is a mission as an optimal-control problem of one's own: constraints and objectives as expressions of
named quantities, solved again with other rates and limits (``ScheduleSettings``, ``ForbiddenBand``); its solution is a
``Trajectory``, which ``load_trajectory`` reads from a file.

What they take: ``read_mission`` reads a mission file (``vrsopt new`` writes one to begin with), ``load_aircraft``,
``load_engine`` and ``load_surrogate`` the shipped data or one's own. These are a ``Mission``, an ``Aircraft``,
``EngineData`` and a ``Surrogate``. ``rotor_map`` shows what the blades of a trimmed point do and feel. What they
return: ``OperatingPoint``, ``PointOptimum``, ``EngineResult``, ``Sampling``, ``Fit``, ``Envelope`` and ``Comparison``;
results carry ``success`` and ``message`` and print as a short table. Two errors are meant for users: ``InputError`` for
input that can not be used, ``NoSolutionError`` for a question without an answer; ``Status`` says how a solver ended.

SI units and radians everywhere, unless a name says otherwise (``power_w``, ``fuel_kg``). Names that mean the same
everywhere: ``mass`` (gross mass [kg]), ``takeoff_mass`` (gross mass at take-off [kg]), ``speed`` (true airspeed [m/s]),
``altitude`` (pressure altitude [m]), ``isa_offset`` (temperature above the standard atmosphere [K]), ``mach`` (of the
flight [-]), ``climb_angle`` (of the flight path [rad]), ``load_factor`` (of a coordinated turn [-]), ``rotor_speed``
(of the main rotor [rad/s]), ``twist`` (blade twist, washout positive [rad]), ``humidity`` (water vapour per dry air
[kg/kg]), ``workers`` (processes, on which no result depends), ``progress`` (whether standard error shows how far it
is)::

    import vrsopt

    point = vrsopt.trim(2200.0, 30.0, rotor_speed=40.0)
    print(point, point.fuel_flow, point.nox)
    print(point.derivatives()["nox"]["rotor_speed"])
    comparison = vrsopt.solve("problems/sarm.toml", schedules=("nominal", "trajectory"))
    print(comparison.summary()["schedules"]["trajectory"]["fuel_delta_percent"])

Everything here loads when it is first used. What is not here has its place in a module, for instance

``vrsopt.balance``               mass and centre of gravity from crew, payload and fuel
``vrsopt.mission.profile``       a mission as a flight in time; ``vrsopt.mission.track``: a flown track as a mission
``vrsopt.schedule.trajectory``   the whole-mission problem itself; ``vrsopt.schedule.tradeoff``: fuel against NOx
``vrsopt.surrogate.kriging``     Kriging as a scikit-learn estimator; ``vrsopt.surrogate.export``: as a CasADi function
``vrsopt.combustor.emissions``   emissions of an engine at many states; ``vrsopt.foca``: FOCA's estimate
``vrsopt.report.files``          the files that the command line writes
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vrsopt.aircraft import Aircraft, load_aircraft
    from vrsopt.envelope_map import Envelope, envelope
    from vrsopt.errors import InputError, NoSolutionError
    from vrsopt.helicopter import trim
    from vrsopt.mission.file import Mission, read_mission
    from vrsopt.operating_point import OperatingPoint
    from vrsopt.point_optimum import physics_optimum
    from vrsopt.point_problem import PointOptimum
    from vrsopt.rotor_fields import rotor_map
    from vrsopt.schedule.bands import ForbiddenBand
    from vrsopt.schedule.compare import solve
    from vrsopt.schedule.comparison import Comparison
    from vrsopt.schedule.mission_problem import MissionProblem
    from vrsopt.schedule.schedule import ScheduleSettings
    from vrsopt.schedule.trajectory_file import load_trajectory
    from vrsopt.schedule.trajectory_solution import Trajectory
    from vrsopt.solvers.status import Status
    from vrsopt.surrogate.design import add_points, sample
    from vrsopt.surrogate.sampling import Sampling
    from vrsopt.surrogate.store import Surrogate
    from vrsopt.surrogate.store import load as load_surrogate
    from vrsopt.surrogate.training import Fit, fit
    from vrsopt.turboshaft.data import EngineData, load_engine
    from vrsopt.turboshaft.performance import EngineResult, engine

__version__ = "0.7.0"

__all__ = [
    "Aircraft",
    "Comparison",
    "EngineData",
    "EngineResult",
    "Envelope",
    "Fit",
    "ForbiddenBand",
    "InputError",
    "Mission",
    "MissionProblem",
    "NoSolutionError",
    "OperatingPoint",
    "PointOptimum",
    "Sampling",
    "ScheduleSettings",
    "Status",
    "Surrogate",
    "Trajectory",
    "add_points",
    "engine",
    "envelope",
    "fit",
    "load_aircraft",
    "load_engine",
    "load_surrogate",
    "load_trajectory",
    "physics_optimum",
    "read_mission",
    "rotor_map",
    "sample",
    "solve",
    "trim",
]

_HOMES = {
    "Aircraft": "vrsopt.aircraft",
    "Comparison": "vrsopt.schedule.comparison",
    "EngineData": "vrsopt.turboshaft.data",
    "EngineResult": "vrsopt.turboshaft.performance",
    "Envelope": "vrsopt.envelope_map",
    "Fit": "vrsopt.surrogate.training",
    "ForbiddenBand": "vrsopt.schedule.bands",
    "InputError": "vrsopt.errors",
    "Mission": "vrsopt.mission.file",
    "MissionProblem": "vrsopt.schedule.mission_problem",
    "NoSolutionError": "vrsopt.errors",
    "OperatingPoint": "vrsopt.operating_point",
    "PointOptimum": "vrsopt.point_problem",
    "Sampling": "vrsopt.surrogate.sampling",
    "ScheduleSettings": "vrsopt.schedule.schedule",
    "Status": "vrsopt.solvers.status",
    "Surrogate": "vrsopt.surrogate.store",
    "Trajectory": "vrsopt.schedule.trajectory_solution",
    "add_points": "vrsopt.surrogate.design",
    "engine": "vrsopt.turboshaft.performance",
    "envelope": "vrsopt.envelope_map",
    "fit": "vrsopt.surrogate.training",
    "load_aircraft": "vrsopt.aircraft",
    "load_engine": "vrsopt.turboshaft.data",
    "load_surrogate": "vrsopt.surrogate.store",
    "load_trajectory": "vrsopt.schedule.trajectory_file",
    "physics_optimum": "vrsopt.point_optimum",
    "read_mission": "vrsopt.mission.file",
    "rotor_map": "vrsopt.rotor_fields",
    "sample": "vrsopt.surrogate.design",
    "solve": "vrsopt.schedule.compare",
    "trim": "vrsopt.helicopter",
}
_NAMES_AT_HOME = {"load_surrogate": "load"}  # where it differs


def __getattr__(name: str) -> Any:
    """A public name, imported from its module when it is first used (PEP 562)."""
    if name in _HOMES:
        value: Any = getattr(import_module(_HOMES[name]), _NAMES_AT_HOME.get(name, name))
    else:
        raise AttributeError(f"module 'vrsopt' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
