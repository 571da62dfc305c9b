"""Time of the combustor's network beside Cantera's, as JSON: python tests/benchmarks/cantera_network.py [points]

The same zones at the same states, the shipped engine's operating line from 30 to 100 % power: CPU time of one process,
one thread, per state. Ours in bulk (``points`` states, 200) and one by one, without and with its derivatives; Cantera's
reactor by reactor, in two ways: ``direct`` (Cantera's Newton from equilibrium, and from the last pass where gas
recirculates; the quickest way found) and ``march`` (in time until nothing changes: the only way before Cantera 3.2).
Every answer is a checked steady state. Ratios compare one run.
"""

from __future__ import annotations

import json
import platform
import sys
import time
from collections.abc import Callable
from importlib.metadata import version

import numpy as np
from cantera_comparison import State, operating_line
from cantera_reactors import Gas, Nitrogen, Way
from cantera_zones import network

from vrsopt.combustor.bulk import solve_combustor_many
from vrsopt.combustor.network import combustor
from vrsopt.turboshaft.data import EngineData, load_engine

LINE = tuple(np.linspace(0.3, 1.0, 6).tolist())
MECHANISMS: tuple[Nitrogen, ...] = ("full", "thermal")
WAYS: tuple[Way, ...] = ("direct", "march")


def per_state(action: Callable[[], object], count: int) -> float:
    """CPU time of ``action`` over ``count`` states, ms."""
    begin = time.process_time()
    action()
    return 1e3 * (time.process_time() - begin) / count


def ours(engine: EngineData, count: int) -> dict[str, float]:
    """Ours, after one call that builds the functions; ms, and the share that converged."""
    data = engine.combustor
    system = combustor(engine.reactors, data.hydrogen_to_carbon, data.heating_value)
    states = np.array(operating_line(engine, tuple(np.linspace(0.3, 1.0, count).tolist())))
    few = [dict(zip((p.name for p in system.parameters), row, strict=True)) for row in states[:: max(count // 10, 1)]]
    named: dict[str, float] = {}

    def bulk() -> None:
        solved = solve_combustor_many(states, engine.reactors, data.hydrogen_to_carbon, data.heating_value)
        named["ours_bulk_converged"] = float(solved.success.mean())

    solutions = [system.solve(few[0], method="newton")]
    system.sensitivities(solutions[0])
    bulk()
    named["ours_bulk_ms"] = per_state(bulk, count)
    solutions.clear()
    named["ours_single_ms"] = per_state(
        lambda: solutions.extend(system.solve(one, method="newton") for one in few), len(few)
    )
    if not all(solution.success for solution in solutions):
        raise RuntimeError("ours: a single solve failed")
    named["ours_derivatives_ms"] = per_state(lambda: [system.sensitivities(one) for one in solutions], len(few))
    return named


def cantera(engine: EngineData, states: list[State]) -> dict[str, float]:
    """Cantera's by mechanism and way, ms."""
    data, found = engine.combustor, {}
    for nitrogen in MECHANISMS:
        for way in WAYS:
            gas = Gas(nitrogen, way=way, hydrogen_to_carbon=data.hydrogen_to_carbon, heating_value=data.heating_value)
            network(gas, engine.reactors, states[0])
            found[f"cantera_{nitrogen}_{way}_ms"] = per_state(
                lambda gas=gas: [network(gas, engine.reactors, state) for state in states],  # type: ignore[misc]
                len(states),
            )
    return found


def main(count: int) -> dict[str, float | str]:
    engine = load_engine()
    mine, theirs = ours(engine, count), cantera(engine, operating_line(engine, LINE))
    ratios = {name.replace("_ms", "_over_ours_bulk"): value / mine["ours_bulk_ms"] for name, value in theirs.items()}
    figures = {name: round(value, 3) for name, value in (mine | theirs | ratios).items()}
    versions = {name: version(name) for name in ("cantera", "casadi", "numpy")}
    return {**figures, "recirculation": engine.reactors.recirculation, **versions, "python": platform.python_version()}


if __name__ == "__main__":
    print(json.dumps(main(int(sys.argv[1]) if len(sys.argv) > 1 else 200), indent=2))
