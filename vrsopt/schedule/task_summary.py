"""Shares of a mission's kinds of task: time, distance over the ground, and fuel of every schedule."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from vrsopt.mission.flight_path import ground_distances
from vrsopt.mission.segment import KINDS

if TYPE_CHECKING:
    from vrsopt.mission.profile import Profile
    from vrsopt.schedule.comparison import ScheduleResult


@dataclass(frozen=True)
class KindShare:
    """All tasks of one kind together."""

    kind: str
    duration: float  # s
    share: float  # of the mission's time
    distance: float  # m, over the ground
    fuel: Mapping[str, float]  # kg, by schedule


def kind_shares(profile: Profile, results: Mapping[str, ScheduleResult]) -> list[KindShare]:
    """The kinds of task that occur, in the order of KINDS; their sums are those of the mission."""
    kinds = np.array([segment.kind for segment in profile.segments])
    durations = np.array([segment.duration for segment in profile.segments])
    distances = ground_distances(profile)
    shares = []
    for kind in KINDS:
        here = kinds == kind
        if here.any():
            duration = float(np.sum(durations[here]))
            fuel = {name: float(np.sum(result.flight.fuel_per_segment[here])) for name, result in results.items()}
            distance = float(np.sum(distances[here]))
            shares.append(KindShare(kind, duration, duration / profile.duration, distance, fuel))
    return shares


def task_figures(profile: Profile, results: Mapping[str, ScheduleResult]) -> list[dict[str, Any]]:
    """The same for ``summary.json``."""
    return [
        {
            "kind": one.kind,
            "duration_s": one.duration,
            "share_percent": 100.0 * one.share,
            "distance_m": one.distance,
            "fuel_kg": dict(one.fuel),
        }
        for one in kind_shares(profile, results)
    ]
