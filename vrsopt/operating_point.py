"""One operating point: the trimmed aircraft with its engines, classified under its limits.

Converged is not flyable: every point is classified, with the reason and the numbers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from vrsopt.aircraft import Aircraft
from vrsopt.combustor.emissions import fit_range
from vrsopt.limits import Limits
from vrsopt.solution import Solution
from vrsopt.solvers.status import Status
from vrsopt.trimming import Trim
from vrsopt.turboshaft.data import EngineData

CONTROLS = ("collective", "lateral_cyclic", "longitudinal_cyclic", "tail_collective", "pitch", "roll")
ROTOR_OUTPUTS = (
    "blade_loading",
    "advance_ratio",
    "figure_of_merit",
    "tail_blade_loading",
    "advancing_tip_mach",
    "hub_roll_moment",
    "hub_pitch_moment",
)
ENGINE_RESULTS = (
    "main_rotor_power",
    "tail_rotor_power",
    "shaft_power_per_engine",
    "fuel_flow",
    "nox",
    "co",
    "co2",
    "nox_index",
    "co_index",
    "co2_index",
    "gas_generator_speed",
    "turbine_inlet_temperature",
    "power_turbine_inlet_temperature",
    "one_engine_inoperative_margin",
    "autorotative_energy",
)


@dataclass(frozen=True)
class OperatingPoint:
    """Trimmed aircraft with its engines, SI units; powers, fuel and emissions are those of all engines that operate,
    unless named so.

    ``main_rotor_power``, ``tail_rotor_power`` [W]; ``shaft_power_per_engine`` [W] of the ``engines_operating``;
    ``fuel_flow`` [kg/s]. ``nox`` (as NO2), ``co`` and ``co2`` [kg/s], ``nox_index``, ``co_index`` and ``co2_index`` per
    fuel [kg/kg] (:mod:`vrsopt.combustor.emissions`); co2 is the fuel's carbon less that in CO and in the hydrocarbons
    of FOCA's correlation. ``nox_of_fits``: NOx [kg/s] by the name of the combustor's fit; the shipped one is nox.

    Controls and attitude [rad]: ``collective`` and ``tail_collective``, ``lateral_cyclic``, ``longitudinal_cyclic``,
    ``pitch`` nose up, ``roll`` to the right. ``gas_generator_speed`` [ratio to design]; ``turbine_inlet_temperature``
    and ``power_turbine_inlet_temperature`` [K]. ``blade_loading``, ``tail_blade_loading`` [-], thrust coefficient over
    solidity; ``advance_ratio``, ``figure_of_merit`` and ``advancing_tip_mach`` [-]. ``hub_roll_moment``,
    ``hub_pitch_moment`` [N m], roll to the right and nose up. ``one_engine_inoperative_margin``: what the rating of the
    remaining engines leaves when one has failed [W]; ``autorotative_energy``: kinetic energy of the rotors [J].

    ``success``: trim and engine solved, in ``iterations``, to ``residual_norm`` (largest scaled residual).
    ``feasible``: flyable as well; ``reason`` says why not, ``classification`` in one word, ``usages`` the share of each
    limit that is used [-]. Numbers of a point that was not solved are nan; so are the emissions alone where the
    combustor was not solved, which ``message`` then says. ``trim`` and ``gas_path`` (of one engine) are the solutions
    themselves.
    """

    success: bool
    status: Status
    message: str
    feasible: bool
    reason: str
    classification: str
    residual_norm: float
    iterations: int
    engines_operating: int
    main_rotor_power: float
    tail_rotor_power: float
    shaft_power_per_engine: float
    fuel_flow: float
    nox: float
    co: float
    co2: float
    nox_index: float
    co_index: float
    co2_index: float
    collective: float
    lateral_cyclic: float
    longitudinal_cyclic: float
    tail_collective: float
    pitch: float
    roll: float
    gas_generator_speed: float
    turbine_inlet_temperature: float
    power_turbine_inlet_temperature: float
    blade_loading: float
    advance_ratio: float
    figure_of_merit: float
    tail_blade_loading: float
    advancing_tip_mach: float
    hub_roll_moment: float
    hub_pitch_moment: float
    one_engine_inoperative_margin: float
    autorotative_energy: float
    nox_of_fits: Mapping[str, float]
    usages: Mapping[str, float]
    trim: Trim = field(repr=False)
    gas_path: Solution | None = field(repr=False)  # of one engine; None without a trim
    aircraft: Aircraft = field(repr=False)
    engine: EngineData = field(repr=False)

    @property
    def solution(self) -> Solution:
        """The solved (or failed) trim."""
        return self.trim.solution

    @property
    def nox_range(self) -> tuple[float, float]:
        """Least and largest NOx [kg/s] over the fits of the combustor; nan if one of them was not solved."""
        return fit_range(self.nox_of_fits.values())

    def derivatives(self) -> dict[str, dict[str, float]]:
        """Exact derivatives of powers, fuel flow and emissions: see :func:`vrsopt.point_derivatives.derivatives`."""
        from vrsopt.point_derivatives import derivatives

        return derivatives(self)

    @property
    def powers(self) -> dict[str, float]:
        """Where the power of the rotors goes [W], each its own integral: their sum is the power at the shafts within
        the work of structural damping. Parasite: all that is dragged through the air, the tail rotor too."""
        if not self.trim.success:
            return {}
        out = self.solution.outputs
        names = ("induced", "profile", "parasite", "climb")
        return {name: out[f"{name}_power"] for name in names} | {"tail rotor": out["tail_rotor_power"]}

    @property
    def margins(self) -> dict[str, float]:
        """What is left to each limit, as a part of it; negative beyond."""
        return {name: 1.0 - usage for name, usage in self.usages.items()}

    def __str__(self) -> str:
        def degrees(*names: str) -> str:
            return ", ".join(f"{math.degrees(getattr(self, name)):.2f}" for name in names)

        low, high = (3.6e6 * flow for flow in self.nox_range)
        fits = f" ({low:.0f} to {high:.0f} over the combustor's fits)" if high > low else ""
        alone = self.engines_operating < self.aircraft.transmission.engines
        operating = f", {self.engines_operating} of {self.aircraft.transmission.engines} operating" if alone else ""
        rows = (
            ("main, tail rotor", f"{self.main_rotor_power / 1e3:.1f} kW, {self.tail_rotor_power / 1e3:.1f} kW"),
            ("shaft per engine", f"{self.shaft_power_per_engine / 1e3:.1f} kW{operating}"),
            ("fuel flow, CO2", f"{self.fuel_flow * 3600:.1f} kg/h, {self.co2 * 3600:.1f} kg/h"),
            ("NOx", f"{self.nox * 3.6e6:.0f} g/h{fits}, index {self.nox_index * 1e3:.2f} g/kg"),
            ("CO", f"{self.co * 3.6e6:.0f} g/h, index {self.co_index * 1e3:.2f} g/kg"),
            ("emissions", "no hydrocarbons listed; at idle power NOx and CO are indicative only"),
            ("collective", f"{degrees('collective')} deg; tail rotor {degrees('tail_collective')} deg"),
            ("cyclic", f"lateral, longitudinal {degrees('lateral_cyclic', 'longitudinal_cyclic')} deg"),
            ("attitude", f"pitch, roll {degrees('pitch', 'roll')} deg"),
            ("gas generator", f"{100 * self.gas_generator_speed:.1f} %"),
            ("turbine inlet", f"{self.turbine_inlet_temperature:.0f} K"),
            ("blade loading", f"{self.blade_loading:.4f} at advance ratio {self.advance_ratio:.3f}"),
            ("advancing tip", f"Mach {self.advancing_tip_mach:.3f}"),
            ("hub moments", f"roll, pitch {self.hub_roll_moment:.0f}, {self.hub_pitch_moment:.0f} N m"),
            ("power goes to", ", ".join(f"{name} {1e-3 * value:.1f}" for name, value in self.powers.items()) + " kW"),
            ("margins left", ", ".join(f"{name} {100 * left:.0f} %" for name, left in self.margins.items())),
            ("one engine out", f"{1e-3 * self.one_engine_inoperative_margin:+.0f} kW to its rating"),
            ("autorotation", f"{1e-3 * self.autorotative_energy:.0f} kJ in the rotors"),
            ("figure of merit", f"{self.figure_of_merit:.3f}" if self.advance_ratio < 0.01 else "- (not a hover)"),
            ("flyable", "yes" if self.feasible else f"no: {self.reason}"),
            ("result", self.message),
        )
        return "\n".join(f"{label:<17}{text}" for label, text in rows)


def classify(
    usages: Mapping[str, float], trim: Trim, engine: Solution, power: float, limits: Limits
) -> tuple[str, str]:
    """Class of a solved point and the reason with its numbers; the first limit that is broken, rotor before engine.

    ``usages``: share of each limit by name [-]; ``power``: of one engine [W].
    """
    out, allowance = trim.solution.outputs, 1 + 1e-6
    rated, whose = limits.rated_power, " with one engine inoperative" if limits.one_engine_inoperative else ""
    temperature = engine.outputs["power_turbine_inlet_temperature"]
    causes = {
        "blade loading": (
            "stalled",
            f"blade loading {out['blade_loading']:.4f} is {usages['blade loading']:.3f} times the largest allowed "
            f"at advance ratio {out['advance_ratio']:.3f}",
        ),
        "tail rotor loading": (
            "tail rotor",
            f"tail-rotor blade loading {out['tail_blade_loading']:.4f} is {usages['tail rotor loading']:.3f} times the "
            f"largest allowed at advance ratio {out['tail_advance_ratio']:.3f}",
        ),
        "engine power": ("over power", f"{power / 1e3:.1f} kW per engine above {rated / 1e3:.1f} kW{whose}"),
        "torque": ("over torque", f"torque {100 * usages['torque']:.1f} % of the rated torque{whose}"),
        "turbine temperature": (
            "over temperature",
            f"inter-turbine temperature {temperature:.0f} K above {limits.temperature:.0f} K{whose}",
        ),
    }
    for name, cause in causes.items():
        if usages[name] > allowance:
            return cause
    return "ok", ""
