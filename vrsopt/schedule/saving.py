"""What the fuel that a schedule saves comes from: less power for each part of the rotors, or less fuel for the power.

Two flights on the physics, 0 and 1, on the same nodes. With P the shaft power of all engines, P = sum P_k of
:mod:`vrsopt.schedule.shaft_power`, and s = fuel flow / P the specific consumption,

    F_0 - F_1 = sum_k (s_0 + s_1) / 2 (P_k0 - P_k1) + (P_0 + P_1) / 2 (s_0 - s_1)

at every node, exactly: the midpoint rule, in which neither flight comes first. The last term is the engine's. Its own
two causes, the load P and the speed N of the power turbine, are told apart by the midpoint rule too,

    speed: (P_0 + P_1) / 2 [ s(P_0, N_0) - s(P_0, N_1) + s(P_1, N_0) - s(P_1, N_1) ] / 2

with s of the engine's table (exact to 5e-7), and load: the rest. An engine at part load needs more fuel for each
kilowatt-hour: what the rotor saves is charged at the mean consumption, and the load usually gives some of it back.
Integrated by the rule that integrates the fuel itself, the causes sum to the difference of the two flights' fuel to
rounding. The flights may differ in mass: who has burned less carries more, which counts as induced power.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from vrsopt.atmosphere import standard_air
from vrsopt.schedule.quadrature import per_segment
from vrsopt.schedule.shaft_power import PARTS, ShaftPower
from vrsopt.surrogate.engine_table import engine_table

if TYPE_CHECKING:
    from vrsopt.limits import Limits
    from vrsopt.mission.profile import Profile
    from vrsopt.schedule.comparison import ScheduleResult
    from vrsopt.schedule.verify import PhysicsFlight

ENGINE = ("engine load", "turbine speed")
CAUSES = (*PARTS, *ENGINE)


@dataclass(frozen=True)
class Saving:
    """Fuel [kg] that a flight saves against another in each of S segments; negative where it burns more.

    ``base`` (S,): fuel of the other flight; ``causes`` (10, S), in the order of CAUSES.
    """

    base: np.ndarray
    causes: np.ndarray

    @property
    def per_segment(self) -> np.ndarray:
        """Fuel saved (S,) [kg]."""
        return np.asarray(self.causes.sum(axis=0))

    @property
    def fuel(self) -> float:
        """Fuel saved [kg]."""
        return float(self.causes.sum())

    @property
    def by_cause(self) -> dict[str, float]:
        """Fuel saved [kg] by cause."""
        return dict(zip(CAUSES, self.causes.sum(axis=1).tolist(), strict=True))

    def as_dict(self) -> dict[str, Any]:
        """The same for ``summary.json``."""
        total = float(self.base.sum())
        return {
            "fuel_kg": self.fuel,
            "percent": 100.0 * self.fuel / total,
            "by_cause_kg": self.by_cause,
            "by_cause_percent": {name: 100.0 * value / total for name, value in self.by_cause.items()},
        }


def saving(profile: Profile, limits: Limits, base: PhysicsFlight, own: PhysicsFlight) -> Saving | None:
    """What the flight ``own`` saves against ``base``, both of ``profile``; None unless both were solved.

    Raises :class:`ValueError` for flights on different nodes.
    """
    if base.shaft_power is None or own.shaft_power is None:
        return None
    if not (np.array_equal(base.time, own.time) and np.array_equal(base.segment, own.segment)):
        raise ValueError("saving: the flights have different nodes")
    segment, time = np.asarray(own.segment), np.asarray(own.time)
    parts = differences(base.shaft_power, own.shaft_power, _at_turbine_speeds(profile, limits, base, own))

    def integrated(flow: np.ndarray) -> np.ndarray:
        return per_segment(segment, time, flow, np.arange(len(time)), len(profile.segments))

    return Saving(integrated(base.shaft_power.fuel_flow), np.array([integrated(part) for part in parts]))


def savings(profile: Profile, limits: Limits, results: Mapping[str, ScheduleResult]) -> dict[str, Saving]:
    """What every schedule saves against the nominal one, where that is known."""
    base = results["nominal"].physics
    found = {name: saving(profile, limits, base, one.physics) for name, one in results.items() if name != "nominal"}
    return {name: one for name, one in found.items() if one is not None}


def differences(base: ShaftPower, own: ShaftPower, speed: np.ndarray) -> np.ndarray:
    """Fuel flow (10, N, 2) [kg/s] that ``own`` saves, by cause, in the order of CAUSES.

    ``speed`` (N, 2) [kg/J]: by how much the specific consumption is less for the turbine's speed.
    """
    before, after = (one.fuel_flow / one.total for one in (base, own))
    power = 0.5 * (base.total + own.total)
    rotor = 0.5 * (before + after) * (base.parts - own.parts)
    return np.concatenate([rotor, [power * (before - after - speed), power * speed]])


def _at_turbine_speeds(profile: Profile, limits: Limits, base: PhysicsFlight, own: PhysicsFlight) -> np.ndarray:
    """Specific consumption (N, 2) [kg/J] at the turbine speed of ``base`` less that at the speed of ``own``: mean of
    those at both powers, zero where the speeds are the same."""
    assert base.shaft_power is not None and own.shaft_power is not None
    powers = base.shaft_power, own.shaft_power
    result = np.zeros_like(powers[0].fuel_flow)
    here = np.flatnonzero((powers[0].turbine_speed != powers[1].turbine_speed).any(axis=1))
    if not here.size:
        return result
    table = engine_table(isa_offset=profile.isa_offset, engine_data=limits.engine)
    nodes = profile.conditions(own.segment[here], own.time[here])
    mach = nodes.speed / standard_air(nodes.altitude, profile.isa_offset).speed_of_sound
    coefficients = table.contract(nodes.altitude, mach)
    before, after = (one.turbine_speed[here] for one in powers)
    engines = limits.aircraft.transmission.engines
    for one in powers:
        power = one.total[here] / engines
        flows = [table.evaluate(coefficients, power, speed)[0] for speed in (before, after)]
        result[here] += 0.5 * (flows[0] - flows[1]) / power
    return result
