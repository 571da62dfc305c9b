"""The trajectory problem in dymos; runs in an environment of its own, needs none of the product but its node function.

    python dymos_trajectory.py FOLDER SLSQP|IPOPT

FOLDER has node.casadi (the node function) and problem.npz (coefficients at the nodes, edges, bounds); the result is
printed as one JSON object. pyOptSparse, the usual way from dymos to IPOPT, is not in the package index: IPOPT is
CasADi's, see dymos_ipopt.py.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

import casadi as ca
import dymos as dm
import numpy as np
import openmdao.api as om
from dymos_ipopt import IpoptDriver

STATES = ("mass", "omega", "twist", "omega_rate_in")
MAX_ITERATIONS = 300


class Aircraft(om.ExplicitComponent):
    """Fuel flow and limits at the nodes of the phase."""

    def initialize(self) -> None:
        self.options.declare("num_nodes", types=int)
        self.options.declare("function")
        self.options.declare("coefficients")

    def setup(self) -> None:
        n, f = self.options["num_nodes"], self.options["function"]
        if n != self.options["coefficients"].shape[1]:
            raise ValueError(f"{n} nodes, coefficients at {self.options['coefficients'].shape[1]}")
        x = [ca.SX.sym(name) for name in STATES]
        c = ca.SX.sym("c", f.size1_in(4))
        centre = [ca.SX.sym("centre", 4)]
        y = ca.vertcat(*f(*x, c, *centre))
        inputs = [ca.vertcat(*x), c, *centre]
        self._flow_and_limits = ca.Function("value", inputs, [y]).map(n)
        self._slopes = ca.Function("slope", inputs, [ca.jacobian(y, inputs[0])]).map(n)
        self._names = ("fuel_rate", *(f"limit{k}" for k in range(y.numel() - 1)))
        for name in STATES:
            self.add_input(name, shape=(n,))
        for name in self._names:
            self.add_output(name, shape=(n,))
        self.declare_partials("*", "*", rows=np.arange(n), cols=np.arange(n))

    def _point(self, inputs: Any) -> np.ndarray:
        return np.stack([inputs[name] for name in STATES])

    def compute(self, inputs: Any, outputs: Any) -> None:
        x = self._point(inputs)
        y = np.array(self._flow_and_limits(x, self.options["coefficients"], x))
        for k, name in enumerate(self._names):
            outputs[name] = -y[k] if k == 0 else y[k]

    def compute_partials(self, inputs: Any, partials: Any) -> None:
        x = self._point(inputs)
        slopes = np.array(self._slopes(x, self.options["coefficients"], x)).reshape(len(self._names), -1, len(STATES))
        for k, name in enumerate(self._names):
            for column, state in enumerate(STATES):
                partials[name, state] = (-1.0 if k == 0 else 1.0) * slopes[k, :, column]


def problem_of(data: Any, function: Any, driver: om.Driver) -> om.Problem:
    """One phase, Radau of order 3 on the given edges; mass is the state, rotor speed and twist are controls."""
    edges = data["edges"]
    ends = 2.0 * edges / edges[-1] - 1.0
    grid = dm.Radau(num_segments=len(edges) - 1, order=3, segment_ends=ends, compressed=True)
    phase = dm.Phase(
        ode_class=Aircraft,
        ode_init_kwargs={"function": function, "coefficients": data["coefficients"]},
        transcription=grid,
    )
    phase.set_time_options(fix_initial=True, fix_duration=True, units="s")
    phase.add_state(
        "mass", rate_source="fuel_rate", targets=["mass"], fix_initial=True, units=None, ref=100.0, ref0=0.0
    )
    for k, name in enumerate(("omega", "twist")):
        low, high = data["box"][:, k].tolist()
        rate, nominal = float(data["rates"][k]), float(data["nominal"][k])
        feed = {"rate_targets": ["omega_rate_in"]} if name == "omega" else {}
        phase.add_control(
            name,
            targets=[name],
            units=None,
            lower=low,
            upper=high,
            ref=nominal,
            fix_initial=True,
            fix_final=True,
            continuity=True,
            rate_continuity=False,
            **feed,
        )
        phase.add_path_constraint(f"{name}_rate", lower=-rate, upper=rate, ref=rate, units="1/s")
    for k in range(function.size1_out(1)):
        phase.add_path_constraint(f"limit{k}", upper=0.0)
    phase.add_objective("mass", loc="final", ref=-100.0)
    trajectory = dm.Trajectory()
    trajectory.add_phase("phase", phase)
    problem = om.Problem(driver=driver, reports=False)
    problem.model.add_subsystem("trajectory", trajectory)
    driver.declare_coloring(show_summary=False)
    problem.setup()
    phase.set_time_val(initial=0.0, duration=float(edges[-1]))
    phase.set_state_val("mass", [float(data["mass"]), float(data["mass"]) - float(data["fuel_guess"])])
    for k, name in enumerate(("omega", "twist")):
        phase.set_control_val(name, [float(data["nominal"][k])] * 2)
    return problem


def main() -> None:
    """Solve and print."""
    folder, optimiser = Path(sys.argv[1]), sys.argv[2]
    data, function = np.load(folder / "problem.npz"), ca.Function.load(str(folder / "node.casadi"))
    make = IpoptDriver if optimiser == "IPOPT" else om.ScipyOptimizeDriver
    driver = make(optimizer="SLSQP", maxiter=MAX_ITERATIONS, tol=1e-7, disp=False)
    begin = time.process_time()
    problem = problem_of(data, function, driver)
    problem.final_setup()
    built = time.process_time()
    result = problem.run_driver()
    solved = time.process_time()
    series = "trajectory.phase.timeseries"
    values = {name: problem.get_val(f"{series}.{name}").ravel() for name in ("time", "mass", "omega", "twist")}
    print(
        json.dumps(
            {
                "optimiser": optimiser,
                "build_s": built - begin,
                "solve_s": solved - built,
                "iterations": int(driver.iter_count),
                "success": bool(result.success),
                "message": str(result.exit_status),
                "nlp_fuel_kg": float(data["mass"] - values["mass"][-1]),
                **{name: value.tolist() for name, value in values.items()},
            }
        )
    )


if __name__ == "__main__":
    main()
