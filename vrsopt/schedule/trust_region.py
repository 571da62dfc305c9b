"""How far a search may go from the schedule it holds: not far, and never to the other side of a forbidden band."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vrsopt.schedule.bands import ForbiddenBand, allowed_regions
from vrsopt.schedule.bounds import Corridor
from vrsopt.schedule.refly import even_grid
from vrsopt.schedule.schedule import ON_LIMIT, Schedule, ScheduleSettings
from vrsopt.schedule.violation import Stay, too_long_stays

if TYPE_CHECKING:
    from vrsopt.mission.profile import Profile

FLOWN_STEP = 1.0  # s, as in the flights of a comparison


@dataclass(frozen=True)
class TrustRegion:
    """Bounds at the nodes of a schedule, whatever is searched within them.

    ``sides``: lower and upper rotor speed, each (n,) [rad/s], see :func:`kept_sides`; ``twist``: bounds [rad];
    ``nominal_rotor_speed`` [rad/s].
    """

    sides: tuple[np.ndarray, np.ndarray]
    twist: tuple[float, float]
    nominal_rotor_speed: float

    @classmethod
    def about(
        cls, schedule: Schedule, settings: ScheduleSettings, bounds: Mapping[str, tuple[float, float]]
    ) -> TrustRegion:
        """That of ``schedule`` under ``settings``, with the ``bounds`` of a path model."""
        box = settings.box(bounds)
        low, high = box[:, 0].tolist()
        sides = kept_sides(schedule.rotor_speed, settings.forbidden_bands, low, high)
        return cls(sides, (float(box[0, 1]), float(box[1, 1])), settings.nominal_rotor_speed)

    @property
    def widest(self) -> Corridor:
        """Wherever the rotor keeps to its sides."""
        return Corridor(rotor_speed=self.sides)

    def around(self, schedule: Schedule, region: np.ndarray) -> Corridor:
        """Within ``region`` (2,), of the nominal rotor speed and rad, of ``schedule``."""
        speed, twist = region[0] * self.nominal_rotor_speed, region[1]
        below, above = schedule.rotor_speed - speed, schedule.rotor_speed + speed
        return Corridor(
            rotor_speed=(np.clip(below, *self.sides), np.clip(above, *self.sides)),
            twist=(np.clip(schedule.twist - twist, *self.twist), np.clip(schedule.twist + twist, *self.twist)),
        )


def kept_sides(
    rotor_speed: np.ndarray, bands: Sequence[ForbiddenBand], low: float, high: float
) -> tuple[np.ndarray, np.ndarray]:
    """Bounds (n,) within ``low`` and ``high`` [rad/s] that keep a ``rotor_speed`` (n,) on its side of ``bands``.

    A node inside a band, where the rotor crosses it, may be on either side; the nodes before and after it may not, so
    that no crossing takes longer than from the one to the other.
    """
    bottom, top = np.array(allowed_regions(bands, low, high)).T
    slack = ON_LIMIT * min((band.upper - band.lower for band in bands), default=0.0)
    not_below = np.searchsorted(top + slack, rotor_speed)  # the first region that is not all below the node
    not_above = np.searchsorted(bottom - slack, rotor_speed, side="right") - 1  # the last that is not all above
    first, last = np.minimum(not_below, not_above), np.maximum(not_below, not_above)
    return bottom[np.maximum(first, 0)], top[np.minimum(last, len(top) - 1)]


def flown_stays(profile: Profile, schedule: Schedule, settings: ScheduleSettings) -> tuple[Stay, ...]:
    """The stays in forbidden bands that a flight of ``schedule`` is told off for."""
    if not settings.forbidden_bands:
        return ()
    nodes = even_grid(profile, FLOWN_STEP)
    segment, time = np.asarray(nodes.segment), np.asarray(nodes.time)
    return too_long_stays(
        settings.forbidden_bands,
        nominal=settings.nominal_rotor_speed,
        tasks=[profile.segments[index].task for index in segment],
        time=time,
        rotor_speed=schedule.at(segment, time)[0],
    )
