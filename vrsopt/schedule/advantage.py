"""What the whole-mission problem gains over the pointwise search that an aircraft could fly, and whether that is known.

Both are flown on the same grids. A difference that is smaller than what surrogate and physics differ by, or than the
error of the integration, establishes nothing; nor does one between schedules that begin or end with another rotor speed
or twist, which free and periodic ends allow: it may be no more than the rotor's energy.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from vrsopt.schedule.comparison import ScheduleResult
    from vrsopt.schedule.schedule import Schedule

OWN, OTHER = "trajectory", "pointwise_rate_limited"
SAME_END = 1e-4  # relative: two rotor speeds or twists that count as one


@dataclass(frozen=True)
class Advantage:
    """Fuel that the trajectory saves against the pointwise schedule, rate limited, per cent of the latter's.

    ``surrogate_physics``: how far surrogate and physics are apart in the trajectory's fuel; ``quadrature``: the error
    of the integration, the larger one of the two flights on surrogate and physics; per cent too. ``same_ends``: whether
    both begin and end with the same rotor speed and twist.
    """

    surrogate: float
    physics: float
    surrogate_physics: float
    quadrature: float
    same_ends: bool = True

    @property
    def established(self) -> bool:
        """Between the same ends and larger than both errors, on the surrogate and on the physics."""
        return self.same_ends and min(self.surrogate, self.physics) > max(self.surrogate_physics, self.quadrature)

    def __str__(self) -> str:
        words = f"trajectory against pointwise, rate limited: advantage {self.surrogate:.3f} %"
        words += f" of the fuel (physics {self.physics:.3f} %)"
        if not self.same_ends:
            return f"{words}, but they begin or end with another rotor speed or twist: not established"
        errors = {
            "the difference of surrogate and physics": self.surrogate_physics,
            "the quadrature error": self.quadrature,
        }
        least = min(self.surrogate, self.physics)
        above = [f"{name} ({error:.3f} %)" for name, error in errors.items() if not least > error]
        if above:
            return f"{words} is below {' and '.join(above)}: not established"
        return f"{words}, above the errors of model and integration (at most {max(errors.values()):.3f} %)"

    def as_dict(self) -> dict[str, Any]:
        """The same for ``summary.json``."""
        return {
            "surrogate_percent": self.surrogate,
            "physics_percent": self.physics,
            "surrogate_physics_difference_percent": self.surrogate_physics,
            "quadrature_error_percent": self.quadrature,
            "same_ends": self.same_ends,
            "established": self.established,
            "words": str(self),
        }


def advantage(results: Mapping[str, ScheduleResult]) -> Advantage | None:
    """The advantage, where both schedules are there and flyable."""
    if not (OWN in results and OTHER in results and results[OWN].success and results[OTHER].success):
        return None
    own, other = results[OWN], results[OTHER]
    saved = [100.0 * (1.0 - a.fuel / b.fuel) for a, b in ((own.flight, other.flight), (own.physics, other.physics))]
    errors = [
        flight.quadrature_error / flight.fuel for flight in (own.flight, own.physics, other.flight, other.physics)
    ]
    if not all(map(math.isfinite, (*saved, *errors))):
        return None
    apart = 100.0 * abs(own.flight.fuel / own.physics.fuel - 1.0)
    same = np.allclose(_ends(own.schedule), _ends(other.schedule), rtol=SAME_END, atol=0.0)
    return Advantage(saved[0], saved[1], apart, 100.0 * max(errors), bool(same))


def _ends(schedule: Schedule) -> np.ndarray:
    """First and last rotor speed and twist (2, 2)."""
    return np.array([schedule.rotor_speed[[0, -1]], schedule.twist[[0, -1]]])
