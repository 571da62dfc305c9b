"""A solution of the whole-mission problem on one mesh as the warm start of the problem on another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vrsopt.schedule.labels import Labels
from vrsopt.schedule.mesh import Mesh
from vrsopt.schedule.trajectory import TrajectoryProblem
from vrsopt.schedule.trajectory_solution import Trajectory

INWARD = 1e-3  # of an interval: tells its own rows from its neighbours' at the same time
APART = 1e7  # s, between segments, so that the nearest is one of the same segment


def carried_over(trajectory: Trajectory, old: TrajectoryProblem, new: TrajectoryProblem) -> Trajectory:
    """``trajectory`` of ``old`` with the multipliers that ``new``, the same problem on another mesh, may expect.

    Every row and column takes the multiplier of the nearest one of its kind in its segment; those that weigh an
    interval (all but defects) in proportion to the steps.
    """
    return replace(
        trajectory,
        mesh=new.mesh,
        x=np.zeros(len(new.columns)),
        lam_x=_nearest(trajectory.lam_x, old.columns, new.columns, old.mesh, new.mesh),
        lam_g=_nearest(trajectory.lam_g, old.rows, new.rows, old.mesh, new.mesh),
    )


def _nearest(values: np.ndarray, old: Labels, new: Labels, old_mesh: Mesh, new_mesh: Mesh) -> np.ndarray:
    found = np.zeros(len(new))
    before, after = _keys(old, old_mesh), _keys(new, new_mesh)
    for kind in new.kinds:
        have, want = old.where(kind.family, kind.name), new.where(kind.family, kind.name)
        order = have[np.argsort(before[have])]
        right = np.clip(np.searchsorted(before[order], after[want]), 1, max(len(order) - 1, 1))
        left, right = order[right - 1], order[np.minimum(right, len(order) - 1)]
        nearer = np.abs(before[left] - after[want]) <= np.abs(before[right] - after[want])
        chosen = np.where(nearer, left, right)
        found[want] = values[chosen]
        if kind.family not in ("defect", "integral"):
            found[want] *= new_mesh.step[new.interval[want]] / old_mesh.step[old.interval[chosen]]
    return found


def _keys(labels: Labels, mesh: Mesh) -> np.ndarray:
    """What is near if the labels are: time, moved into the label's interval, with segments far apart."""
    middle = mesh.start[labels.interval] + 0.5 * mesh.step[labels.interval]
    time = np.where(labels.segment < 0, 0.0, labels.time)
    return np.asarray(labels.segment * APART + time + np.where(labels.segment < 0, 0.0, INWARD * (middle - time)))
