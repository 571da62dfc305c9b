"""What is measured on a profile from outside: gaps at the edges, sums, and the flight as its positions show it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from vrsopt.mission.file import Mission
from vrsopt.mission.profile import Profile, Segment
from vrsopt.mission.route import WGS84
from vrsopt.mission.wind import Wind

GRAVITY = 9.80665  # m/s2
AXIS, SQUARE = 6378137.0, 0.0066943799901413165  # WGS 84: equatorial radius [m], eccentricity squared
GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(96)
STENCIL = np.arange(-2, 3)
FIRST, SECOND = np.array([1, -8, 0, 8, -1]) / 12, np.array([-1, 16, -30, 16, -1]) / 12


def distance(a, b) -> float:
    """Length [m] of the geodesic between two (latitude, longitude)."""
    return WGS84.Inverse(*a, *b)["s12"]


def state(segment: Segment, time: float) -> dict[str, float]:
    """Motion at one time of a segment, its own."""
    found = segment.motion.kinematics(np.array([time]))
    latitude, longitude, course = segment.motion.track(np.array([time]))
    return {name: float(value[0]) for name, value in vars(found).items()} | {
        "latitude": float(latitude[0]),
        "longitude": float(longitude[0]),
        "course": float(course[0]),
    }


def gaps(profile: Profile) -> dict[str, float]:
    """Largest jumps from one segment to the next: position [m], course [deg] where it moves, and the rest in SI."""
    largest: dict[str, float] = Counter()
    for before, after in pairwise(profile.segments):
        one, two = state(before, before.duration), state(after, 0.0)
        jumps = {name: abs(two[name] - one[name]) for name in vars(before.motion.kinematics(np.zeros(1)))}
        jumps["position"] = distance((one["latitude"], one["longitude"]), (two["latitude"], two["longitude"]))
        if one["ground_speed"] > 0.1:
            jumps["course"] = abs((two["course"] - one["course"] + 180.0) % 360.0 - 180.0)
        for name, value in jumps.items():
            largest[name] = max(largest[name], value)
    return largest


@dataclass
class Book:
    """What a segment covers, by integration over it and by its ends."""

    flown: float  # m, integral of the ground speed
    covered: float  # m, along its piece of the way
    climbed: float  # m, integral of the climb rate
    risen: float  # m, between its ends


def book(segment: Segment) -> Book:
    """Bookkeeping of a segment, by Gauss' quadrature of its speeds."""
    times = 0.5 * segment.duration * (GAUSS_NODES + 1.0)
    weights = 0.5 * segment.duration * GAUSS_WEIGHTS
    inside = segment.motion.kinematics(times)
    ends = np.array([0.0, segment.duration])
    covered = np.diff(segment.motion.distance(ends))[0]
    risen = np.diff(segment.motion.kinematics(ends).altitude)[0]
    return Book(weights @ inside.ground_speed, covered, weights @ inside.climb_rate, risen)


def time_by_kind(profile: Profile) -> Counter:
    """Time [s] spent in the segments of each kind."""
    times: Counter = Counter()
    for segment in profile.segments:
        times[segment.kind] += segment.duration
    return times


def stated_by_kind(mission: Mission) -> Counter:
    """Time [s] that the tasks of a mission state, by kind."""
    times: Counter = Counter()
    for task in mission.tasks:
        times[task.kind] += getattr(task, "duration_s", None) or 0.0
    return times


def surface(latitude, longitude) -> np.ndarray:
    """Earth-fixed coordinates [m] of points on the ellipsoid, (..., 3)."""
    phi, lam = np.radians(latitude), np.radians(longitude)
    normal = AXIS / np.sqrt(1.0 - SQUARE * np.sin(phi) ** 2)
    across = normal * np.cos(phi)
    return np.stack([across * np.cos(lam), across * np.sin(lam), normal * (1.0 - SQUARE) * np.sin(phi)], -1)


@dataclass
class Seen:
    """The flight as positions and altitudes show it: vectors toward east, north and up, (N, 3)."""

    time: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    altitude: np.ndarray


def seen(segment: Segment, times: np.ndarray, step: float) -> Seen:
    """Velocity and acceleration over the ground by differences of positions, at own ``times`` of a segment.

    On the surface of the ellipsoid, in the tangent plane; up by differences of the altitude.
    """
    around = times[:, None] + step * STENCIL
    latitude, longitude, _ = (part.reshape(around.shape) for part in segment.motion.track(around.ravel()))
    altitude = segment.motion.kinematics(around.ravel()).altitude.reshape(around.shape)
    points = surface(latitude, longitude)
    points -= points[:, 2:3]
    phi, lam = np.radians(latitude[:, 2]), np.radians(longitude[:, 2])
    east = np.stack([-np.sin(lam), np.cos(lam), 0.0 * lam], -1)
    north = np.stack([-np.sin(phi) * np.cos(lam), -np.sin(phi) * np.sin(lam), np.cos(phi)], -1)

    def local(weights, unit):
        vector = np.einsum("s,nsk->nk", weights, points) / unit
        up = ((altitude - altitude[:, 2:3]) @ weights) / unit
        return np.stack([(vector * east).sum(-1), (vector * north).sum(-1), up], -1)

    return Seen(times, local(FIRST, step), local(SECOND, step**2), altitude[:, 2])


def felt(flight: Seen, wind: Wind) -> dict[str, np.ndarray]:
    """Flight conditions of what is seen, by vectors: velocity through the air, specific force, its components."""
    blowing = np.stack([*wind.at(flight.altitude), np.zeros(len(flight.altitude))], -1)
    velocity = flight.velocity - blowing
    speed = np.linalg.norm(velocity, axis=-1)
    force = flight.acceleration + np.array([0.0, 0.0, GRAVITY])
    right = np.cross(velocity, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right, axis=-1, keepdims=True)
    aside = (force * right).sum(-1)
    plane = force - aside[:, None] * right
    in_plane = np.linalg.norm(plane, axis=-1)
    return {
        "speed": speed,
        "altitude": flight.altitude,
        "climb_angle": np.arcsin(velocity[:, 2] / speed),
        "load_factor": np.linalg.norm(force, axis=-1) / GRAVITY,
        "turn_load_factor": np.linalg.norm(force, axis=-1) / in_plane,
        "aside": aside,
        "equivalent_climb_angle": np.arcsin((plane * velocity).sum(-1) / (in_plane * speed)),
    }
