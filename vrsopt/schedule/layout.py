"""The unknowns of the whole-mission problem and where each of them stands in the vector x."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vrsopt.schedule.mesh import Mesh
from vrsopt.schedule.schedule import ScheduleSettings

FUEL_SCALE = 100.0  # kg
TYPICAL_RATES = (0.01, 0.1)  # of rotor speed and twist, of the nominal value per s: scale where no limit gives one


@dataclass(frozen=True)
class Control:
    """A scheduled variable and its rate: their places in x and the scales of both, in units of the variable."""

    name: str
    unit: str
    row: int  # of the node inputs
    start: np.ndarray  # (N,) place of its value at the start of each interval
    end: np.ndarray  # (N,)
    rate: np.ndarray  # (N,) place of its rate
    scale: float
    rate_scale: float  # per s


@dataclass(frozen=True)
class Layout:
    """Places in the vector x of the unknowns, all of order one.

    ``fuel`` (N, s): fuel burned at ``shares`` (s,) of each interval, from 0 to 1; the end of one interval is the start
    of the next. ``charged`` (N,): the rotor speed rate that is charged to the engines, where that is one of its own.
    """

    shares: np.ndarray
    fuel: np.ndarray
    controls: tuple[Control, Control]
    charged: np.ndarray | None
    size: int

    @property
    def charged_rate(self) -> np.ndarray:
        """Places (N,) of the rotor speed rate whose power the engines feel."""
        return self.controls[0].rate if self.charged is None else self.charged


def make_layout(mesh: Mesh, settings: ScheduleSettings, shares: np.ndarray) -> Layout:
    """Unknowns on ``mesh`` with the fuel known at ``shares`` of every interval.

    Nodes of rotor speed and twist are shared between segments, unless their rate is unlimited: then each segment has
    its own. With periodic ends the last node is the first.
    """
    count, inner = len(mesh), len(shares) - 2
    k = np.arange(count)
    fuel = np.column_stack([k, count + 1 + inner * k[:, None] + np.arange(inner), k + 1])
    size = int(fuel.max()) + 1
    controls = []
    for row, (name, unit, nominal, rate_bound) in enumerate(
        (
            ("rotor speed", "rad/s", settings.nominal_rotor_speed, settings.rotor_speed_rate),
            ("twist", "rad", settings.nominal_twist, settings.twist_rate),
        )
    ):
        start = k + (mesh.segment - mesh.segment[0] if rate_bound is None else 0)
        end = start + 1
        nodes = int(end[-1]) + 1
        if settings.ends == "periodic":
            nodes -= 1
            end[-1] = 0
        scale = rate_bound or TYPICAL_RATES[row] * nominal
        controls.append(
            Control(name, unit, 1 + row, size + start, size + end, size + nodes + k, scale=nominal, rate_scale=scale)
        )
        size += nodes + count
    charged = None
    if not settings.spin_down_credit:
        charged, size = size + k, size + count
    return Layout(shares, fuel, (controls[0], controls[1]), charged, size)
