"""How far the trajectory's own integration is from its re-flight on the fine grid."""

from __future__ import annotations

import numpy as np

from vrsopt.schedule.refly import Flight
from vrsopt.schedule.trajectory_solution import Trajectory


def resimulation_error(trajectory: Trajectory, flight: Flight) -> float:
    """Fuel of the NLP over fuel of the re-flown schedule, minus one."""
    return trajectory.fuel / flight.fuel - 1.0


def mesh_error(trajectory: Trajectory, flight: Flight) -> np.ndarray:
    """Fuel of the NLP minus fuel of the re-flown schedule in each interval of the mesh (N,) [kg].

    Large entries show where the mesh is too coarse; their sum is the whole difference in fuel.
    """
    mesh = trajectory.mesh
    segments = np.unique(mesh.segment)
    errors = []
    for segment in segments:
        inside, known = mesh.segment == segment, trajectory.schedule.segment == segment
        edges = np.append(mesh.start[inside], mesh.end[inside][-1])
        here = flight.segment == segment
        flown = np.interp(edges, flight.time[here], flight.mass[here])
        errors.append(np.diff(flown) - np.diff(trajectory.mass[known]))
    return np.concatenate(errors)
