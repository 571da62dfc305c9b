"""A smooth stand-in for the physics: shaft power of a light helicopter in closed form, cheap enough for tests."""

import time

import numpy as np

from vrsopt.surrogate.database import PointRecord
from vrsopt.surrogate.space import LEVEL

LOWER, UPPER = np.array(LEVEL.lower), np.array(LEVEL.upper)
RADIUS, SOLIDITY = 4.91, 0.07


def blade_loading(inputs):
    mass, altitude, _, rotor_speed, _ = inputs.T
    density = 1.225 * (1.0 - 2.25577e-5 * altitude) ** 4.2559
    return mass * 9.81 / (density * np.pi * RADIUS**2 * SOLIDITY * (rotor_speed * RADIUS) ** 2)


def shaft_power(inputs):
    """Power [W] at inputs (n, 5): induced (momentum theory, twist), profile (stall and Mach rise), parasite."""
    mass, altitude, speed, rotor_speed, twist = inputs.T
    density = 1.225 * (1.0 - 2.25577e-5 * altitude) ** 4.2559
    area, tip = np.pi * RADIUS**2, rotor_speed * RADIUS
    mu, thrust = speed / tip, mass * 9.81
    hover = thrust / (2 * density * area)
    induced = np.sqrt(np.sqrt(speed**4 / 4 + hover**2) - speed**2 / 2 + 1e-3)
    kappa = 1.10 + 3.0 * (twist - 0.24 + 0.45 * mu) ** 2 + 0.8 * mu**2
    stall = (blade_loading(inputs) / 0.115) ** 5 * (1 + 3 * mu**2)
    mach = np.exp((tip * (1 + mu) / 340.0 - 0.86) / 0.06)
    drag = 0.0090 * (1 + 0.25 * stall + 0.3 * mach)
    profile = density * area * tip**3 * SOLIDITY * drag / 8 * (1 + 4.65 * mu**2)
    return kappa * thrust * induced + profile + 0.5 * density * speed**3 * 1.3


def design(size, *, seed=0):
    """Random inputs (size, 5) in the box of the study."""
    return LOWER + (UPPER - LOWER) * np.random.default_rng(seed).random((size, 5))


def power_slopes(point):
    """Derivatives of the power at one point (5,) by central differences."""
    steps = 1e-6 * (UPPER - LOWER) * np.eye(5)
    rise = shaft_power(point + steps) - shaft_power(point - steps)
    return dict(zip(LEVEL.names, (rise / (2e-6 * (UPPER - LOWER))).tolist(), strict=True))


def evaluate(inputs):
    """One operating point as ``sample`` wants it: points of high blade loading are not flyable."""
    point = np.array([inputs[name] for name in LEVEL.names])
    power, loading = float(shaft_power(point[None])[0]), float(blade_loading(point[None])[0])
    status, reason = ("ok", "") if loading < 0.12 else ("stalled", f"blade loading {loading:.3f} above 0.120")
    slopes = {"power": power_slopes(point)}
    return PointRecord({"power": power, "blade_loading": loading}, status, reason, 7, 1e-9, slopes)


def evaluate_slowly(inputs):
    """As :func:`evaluate`, with time to be interrupted."""
    time.sleep(0.2)
    return evaluate(inputs)
