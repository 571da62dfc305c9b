"""A turboshaft in pyCycle at many points: run by pycycle_comparison.py in an environment that has om-pycycle.

    python pycycle_engine.py < request.json > answer.json

The request holds the numbers of the engine (SI) and the points in the order in which they are to be solved; the answer
the design point, the points, the times and the component maps. Nothing of vrsopt is used here, nor is it installed.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import openmdao
import openmdao.api as om
import pycycle
import pycycle.api as pyc
from pycycle_cycle import MOST_ITERATIONS, SPEED, prepared


class Stepper:
    """Moves the off-design point about, each time from where it stands, with the time that takes."""

    def __init__(self, problem: om.Problem) -> None:
        self.problem = problem
        self.design_s = self._design()
        self.start = self._states("OFF")

    def value(self, name: str, unit: str | None = None) -> float:
        return float(np.ravel(self.problem.get_val(name, units=unit))[0])

    def _design(self) -> float:
        """Solve the design point alone, then hand its states to the other point as the guess of them."""
        options = self.problem.model.OFF.nonlinear_solver.options
        options["maxiter"], options["err_on_non_converge"] = 0, False
        seconds = timed(self.problem.run_model)
        options["maxiter"], options["err_on_non_converge"] = MOST_ITERATIONS, True
        found, sought = self._states("DESIGN"), self._states("OFF")
        for name in found.keys() & sought.keys():
            self.problem.set_val(f"OFF.{name}", found[name])
        self.problem.set_val("OFF.cycle.W", self.value("DESIGN.inlet.Fl_O:stat:W", "kg/s"), units="kg/s")
        self.problem.set_val("OFF.cycle.speed", SPEED, units="rpm")
        return seconds

    def _states(self, point: str) -> dict[str, np.ndarray]:
        """What the solvers of a point solve for, by the name within the point."""
        listed = getattr(self.problem.model, point).list_outputs(explicit=False, out_stream=None, prom_name=False)
        return {name: np.array(entry["val"]) for name, entry in listed}

    def _place(self, point: dict[str, float]) -> None:
        place = {
            "OFF.cycle.demand": (point["power"], "W"),
            "OFF.pt_speed": (SPEED * point["power_turbine_speed"], "rpm"),
            "OFF.fc.alt": (point["altitude"], "m"),
            "OFF.fc.dTs": (1.8 * point["isa_offset"], "degR"),
            "OFF.fc.MN": (max(point["mach"], 1e-6), None),
        }
        for name, (value, unit) in place.items():
            self.problem.set_val(name, value, units=unit)

    def solve(self, point: dict[str, float], *, restart: bool) -> dict[str, Any]:
        """The stations at ``point``, and the process time [s] from the last point or, at a restart, the design's."""
        for name, value in (self.start if restart else {}).items():
            self.problem.set_val(f"OFF.{name}", value)
        self._place(point)
        try:
            seconds = timed(self.problem.run_model)
        except om.AnalysisError as error:
            return {"point": point, "converged": False, "message": str(error).splitlines()[0]}
        again = timed(self.problem.run_model)
        return {"point": point, "converged": True, "step_s": seconds, "repeat_s": again, **self.stations("OFF")}

    def stations(self, point: str) -> dict[str, float]:
        """What the cycle of ``point`` gives, SI."""
        wanted = {
            "power": ("pt_shaft.pwr_net", "W"),
            "fuel_flow": ("burner.Wfuel", "kg/s"),
            "air_flow": ("inlet.Fl_O:stat:W", "kg/s"),
            "pressure_ratio": ("compressor.PR", None),
            "gas_generator_speed": ("gg_shaft.Nmech", "rpm"),
            "compressor_exit_temperature": ("compressor.Fl_O:tot:T", "degK"),
            "turbine_inlet_temperature": ("burner.Fl_O:tot:T", "degK"),
            "power_turbine_inlet_temperature": ("ggt.Fl_O:tot:T", "degK"),
            "exhaust_temperature": ("pt.Fl_O:tot:T", "degK"),
        }
        values = {name: self.value(f"{point}.{where}", unit) for name, (where, unit) in wanted.items()}
        return values | {"gas_generator_speed": values["gas_generator_speed"] / SPEED}


def timed(action: Callable[[], object]) -> float:
    """Process time [s] of one call."""
    begin = time.process_time()
    action()
    return time.process_time() - begin


def maps() -> dict[str, dict[str, Any]]:
    """The component maps as tables (speed, other coordinate), and the point of theirs that is scaled to the design."""
    axi, lpt = pyc.AXI5, pyc.LPT2269
    return {
        "compressor": {
            "speed": axi.NcMap.tolist(),
            "line": axi.RlineMap.tolist(),
            "design": [axi.defaults["NcMap"], axi.defaults["RlineMap"]],
            "flow": axi.WcMap[0].tolist(),
            "pressure_ratio": axi.PRmap[0].tolist(),
            "efficiency": axi.effMap[0].tolist(),
        },
        "turbine": {
            "speed": lpt.NpMap.tolist(),
            "pressure_ratio": lpt.PRmap.tolist(),
            "design": [lpt.defaults["NpMap"], lpt.defaults["PRmap"]],
            "flow": lpt.WpMap[0].tolist(),
            "efficiency": lpt.effMap[0].tolist(),
        },
    }


def answer(request: dict[str, Any]) -> dict[str, Any]:
    """Everything the comparison needs of pyCycle."""
    problems: list[om.Problem] = []

    def build() -> None:
        problems.append(prepared(request["engine"]))
        problems[0].final_setup()

    setup_s = timed(build)
    stepper = Stepper(problems[0])
    design = stepper.stations("DESIGN")
    points = [stepper.solve(point, restart=i == 0) for series in request["series"] for i, point in enumerate(series)]
    return {
        "versions": {
            "python": sys.version.split()[0],
            "numpy": np.__version__,
            "openmdao": openmdao.__version__,
            "pycycle": pycycle.__version__,
        },
        "setup_s": setup_s,
        "design_s": stepper.design_s,
        "design": design,
        "points": points,
        "maps": maps(),
    }


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    given = json.load(sys.stdin)
    with open(os.devnull, "w") as nowhere, contextlib.redirect_stdout(nowhere):  # its solvers print
        found = answer(given)
    json.dump(found, sys.stdout)
