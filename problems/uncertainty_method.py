"""How the study of uncertainty was computed and how far that can be trusted: the last part of its page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from page_table import table
from uncertainty_effects import label
from uncertainty_numbers import LEFT_OUT, OWN_RANGES


def method(content: Mapping[str, Any]) -> Iterator[str]:
    """How it was computed and how far that can be trusted."""
    representation, schedules = content["representation"], content["schedules"]
    flights = representation["flights"]
    yield "## How"
    yield ""
    yield (
        f"{len(flights)} flights out of the missions stand for all three, each mission with weights of its own: a "
        "quadrature that integrates nominal fuel, least fuel and rotor speed of least fuel, on the surrogate, for five "
        "masses and margins, time on the limits and speed (`uncertainty_points.py`). Idle on the ground is added, and "
        "the optimum carries the fuel that it has not burned. Rates of the actuators are not part of it: the band of "
        "the trajectory is that of the optimum shifted by the difference of the two on the shipped numbers."
    )
    yield ""
    rows = []
    for name, reference in content["reference"].items():
        error = 100.0 * representation["largest_fuel_error"][name]
        pairs = np.array(content["check"][name])
        rows.append(
            [
                name.upper(),
                f"{reference['saving']:.2f}",
                f"{schedules[name]['pointwise']:.2f}",
                f"{schedules[name]['trajectory']:.2f}",
                f"{error:.3f}",
                ", ".join(f"{few:+.2f} ({many:+.2f})" for many, few in pairs),
                f"{np.max(np.abs(pairs[:, 0] - pairs[:, 1])):.2f}",
            ]
        )
    yield from table(
        (
            "mission",
            "saving of the few flights %",
            "pointwise schedule on the physics %",
            "trajectory %",
            "largest error of a fuel integral %",
            "change of the saving in samples (in many flights)",
            "largest difference",
        ),
        rows,
    )
    yield "The flights, and for how many seconds each stands:"
    yield ""
    weights = representation["weights_s"]
    yield from table(
        ("mass kg", "altitude m", "speed m/s", "climb deg", "vertical m/s", "load factor", "skids over ground m")
        + tuple(name.upper() for name in weights),
        (
            [
                f"{one['mass']:.0f}",
                f"{one['altitude']:.0f}",
                f"{one['speed']:.1f}",
                f"{np.degrees(one['climb_angle']):+.1f}",
                f"{one['vertical_speed']:+.1f}",
                f"{one['load_factor']:.2f}",
                "-" if one["height"] < 0 else f"{one['height']:.0f}",
                *(f"{row[k]:.0f}" for row in weights.values()),
            ]
            for k, one in enumerate(flights)
        ),
    )
    yield (
        "Optima are found by a few trims where the rotor turns as slowly as the limits allow, and else by IPOPT with "
        "trim and engine as constraints (`uncertainty_optimum.py`, `vrsopt.point_optimum`). On the shipped aircraft "
        f"and {len(next(iter(content['check'].values())))} samples both ways were taken: least fuel flows differ by at "
        f"most {100.0 * content['disagreement']:.4f} %."
    )
    yield ""
    yield from _samples(content)
    own = ", ".join(f"{label(path)} {low:g} to {high:g}" for path, (low, high) in OWN_RANGES.items())
    yield (
        f"Ranges that no data file has, as factors: {own}. The section's are set beside the constants of NACA 0012, "
        "which have 3 to 17 % less largest lift at Mach 0.3 to 0.5 and 1.4 times the growth of drag with lift; the "
        "masses are those of the missions, which are assumptions."
    )
    yield ""
    yield "Left out:"
    yield ""
    for path, reason in LEFT_OUT.items():
        yield f"- {label(path).rstrip(': ')}: {reason}"
    yield ""
    versions = ", ".join(f"{name} {value}" for name, value in content["versions"].items())
    yield f"Written by `python problems/uncertainty.py`; all figures are in `uncertainty.json`. {versions}."


def _samples(content: Mapping[str, Any]) -> Iterator[str]:
    """What the samples are."""
    unsolved = content["unsolved"]
    count = len(next(iter(content["samples"]["values"]["saving"].values())))
    yield (
        f"{len(content['numbers'])} numbers, independent and uniform over their ranges: {count + len(unsolved)} "
        f"samples by Latin hypercube, seed {content['seed']}. All were flown, each with all optima of its own, with "
        f"the margin drawn and with the shipped one; {len(unsolved)} without a solution"
        + (f" ({'; '.join(sorted({one['message'] for one in unsolved}))})" if unsolved else "")
        + "."
    )
    yield ""
