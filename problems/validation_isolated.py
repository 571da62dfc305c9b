"""Rotors and sections alone against tests: numbers and tables for problems/validation.md.

Imported by validation.py, and by tests/test_validation_page.py, which holds the numbers to their bounds; nothing here
is fitted to what it is compared with.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache, partial
from math import pi, radians
from pathlib import Path
from typing import NamedTuple

import dynamic_stall
import numpy as np
from page_table import table
from vortex_lattice import CHORD, MEASURED, ROOT, SPEED_OF_SOUND, TIP_MACH, Lattice

from vrsopt.aircraft import MainRotor, load_aircraft
from vrsopt.rotor.airfoil import Airfoil, load_section
from vrsopt.rotor.fidelity import Fidelity
from vrsopt.rotor.isolated import conditions, isolated_system, model_rotor

hover_rotor = partial(model_rotor, load_aircraft().main_rotor, load_section("naca_0012"))
DISC, PASSAGE = (Fidelity(blade_passage=passage, dynamic_stall=False) for passage in (False, True))
SLENDER = 0.25  # of the chord of Caradonna and Tung's blades


def hover_outputs(rotor: MainRotor, collectives_deg: list[float], fidelity: Fidelity) -> list[dict[str, float]]:
    """Outputs in hover at each collective, all of which must be solved."""
    system = isolated_system(rotor, fidelity)
    found = []
    for angle in collectives_deg:
        solution = system.solve(conditions(rotor, collective=radians(angle)), method="newton")
        if not solution.success:
            raise RuntimeError(f"hover at {angle:g} deg of collective: {solution.message}")
        found.append(solution.outputs)
    return found


# -- Caradonna and Tung, Harrington ------------------------------------------------------------------------------------


class Thrust(NamedTuple):
    """Thrust coefficient of the rotor of Caradonna and Tung at a collective [deg]: test, and three models."""

    collective: float
    test: float
    disc: float
    passage: float
    lattice: float

    def excess_percent(self) -> tuple[float, float, float]:
        """Of disc, blade passage and lattice over the test."""
        disc, passage, lattice = (100.0 * (c / self.test - 1.0) for c in self[2:])
        return disc, passage, lattice


@cache
def caradonna_tung() -> list[Thrust]:
    """With the inflow of a disc, with states at the blade passage, and with a vortex lattice on a rigid helix."""
    rotor = hover_rotor(radius=1.143, chord=1.143 * CHORD, tip_speed=TIP_MACH * SPEED_OF_SOUND, root_cutout=ROOT)
    disc, passage = (
        [out["thrust_coefficient"] for out in hover_outputs(rotor, list(MEASURED), inflow)]
        for inflow in (DISC, PASSAGE)
    )
    lattice = [Lattice(radians(angle), CHORD).thrust() for angle in MEASURED]
    return [Thrust(*row) for row in zip(MEASURED, MEASURED.values(), disc, passage, lattice, strict=True)]


@cache
def slender_thrust(collective_deg: float, share: float) -> float:
    """Thrust coefficient with that share of the chord, with states at the blade passage.

    The rotor is four times as large, for the chord's lower bound.
    """
    radius = 4 * 1.143
    rotor = hover_rotor(
        radius=radius, chord=share * CHORD * radius, tip_speed=TIP_MACH * SPEED_OF_SOUND, root_cutout=ROOT
    )
    coarse = replace(PASSAGE, harmonics=1, azimuths=16, highest_shape=5)
    return hover_outputs(rotor, [collective_deg], coarse)[0]["thrust_coefficient"]


@cache
def slender_percent() -> float:
    """Thrust of slender blades at 8 deg, with states at the blade passage, over that of the lattice."""
    return 100.0 * (slender_thrust(8.0, SLENDER) / Lattice(radians(8.0), SLENDER * CHORD).thrust() - 1.0)


@cache
def harrington() -> dict[str, list[float]]:
    """Figure of merit of R. D. Harrington's rotor 1 (NACA TN-2318) at 5 to 15 deg of collective, by inflow."""
    rotor = hover_rotor(radius=3.81, chord=0.027 * pi * 3.81 / 2, tip_speed=152.4, root_cutout=0.16)
    angles = np.arange(5.0, 16.0).tolist()
    return {
        words: [out["figure_of_merit"] for out in hover_outputs(rotor, angles, inflow)]
        for words, inflow in (("disc", DISC), ("blade passage", PASSAGE))
    }


def isolated_tables() -> Iterator[str]:
    """Two rotors in hover, with and without the states of the finite number of blades."""
    slope = float(load_section("naca_0012").attached_lift(TIP_MACH)[0])
    yield (
        "Thrust coefficient of the rotor of Caradonna and Tung (two blades, aspect ratio 6, tip Mach number "
        f"{TIP_MACH}), section NACA 0012 as shipped ({radians(slope):.3f} per degree there); a disc, states at the "
        "blade passage, and a vortex lattice on a rigid helix with the same section. The aim of 5 % is missed. For "
        f"slender blades lattice and blade passage agree ({slender_percent():+.1f} % at a chord of R/24), so that what "
        "parts them here is the finite chord, which a disc does not know. What remains is not explained: contraction "
        "and roll-up of the wake, section or test. Nothing is fitted to the measurement:\n"
    )
    rows = [
        (
            t.collective,
            t.test,
            *(f"{c:.5f} | {excess:+.0f} %" for c, excess in zip(t[2:], t.excess_percent(), strict=True)),
        )
        for t in caradonna_tung()
    ]
    header = ("collective deg", "test", "disc", "difference", "blade passage", "difference", "lattice", "difference")
    yield from table(header, rows)
    yield "Largest figure of merit of Harrington's rotor 1 (two blades, solidity 0.027, 152.4 m/s):\n"
    rows = [(words, f"{max(merit):.3f}", "0.62 to 0.75") for words, merit in harrington().items()]
    yield from table(("inflow", "model", "test"), rows)


# -- sections ----------------------------------------------------------------------------------------------------------


class SectionError(NamedTuple):
    """Rms error of lift and drag coefficient at a Mach number, each attached (-4 to 10 deg) and over a wide range."""

    mach: float
    lift_attached: float
    lift: float
    drag_attached: float
    drag: float


def section_errors(deck: Path) -> list[SectionError]:
    """The shipped section against the deck that it was fitted to."""
    section = load_aircraft().main_rotor.section
    with np.load(deck) as data:
        content = {name: data[name] for name in data.files if name.startswith("c81_")}
    return [
        SectionError(
            mach,
            _rms(section, content, "cl", mach, (-4.0, 10.0)),
            _rms(section, content, "cl", mach, (-15.0, 19.0)),
            _rms(section, content, "cd", mach, (-4.0, 10.0)),
            _rms(section, content, "cd", mach, (-8.0, 19.0)),
        )
        for mach in (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
    ]


def _rms(
    section: Airfoil, content: dict[str, np.ndarray], name: str, mach: float, angles_deg: tuple[float, float]
) -> float:
    alpha = content[f"c81_alpha_{name}"]
    column = int(np.argmin(np.abs(content[f"c81_mach_{name}"] - mach)))
    chosen = (alpha >= angles_deg[0]) & (alpha <= angles_deg[1])
    k = ("cl", "cd").index(name)
    model = [
        float(section.coefficients(np.sin(a), np.cos(a), mach, section.drag_reference)[k])
        for a in np.radians(alpha[chosen])
    ]
    return float(np.sqrt(np.mean((np.array(model) - content[f"c81_{name}"][chosen, column]) ** 2)))


def section_table(deck: Path) -> Iterator[str]:
    yield "Section against the deck it was fitted to, rms error (attached: -4 to 10 deg):\n"
    rows = [(e.mach, *(f"{value:.4f}" for value in e[1:])) for e in section_errors(deck)]
    yield from table(("Mach", "lift, attached", "lift, -15 to 19 deg", "drag, attached", "drag, -8 to 19 deg"), rows)


class Loop(NamedTuple):
    """An oscillating section: frame, Mach number, mean angle and amplitude [deg], reduced frequency, and errors."""

    frame: int
    mach: float
    mean: float
    amplitude: float
    frequency: float
    errors: dict[str, float]

    @property
    def lift_difference(self) -> float:
        """Of the largest lift coefficient from the test."""
        return self.errors["cl_max"] - self.errors["cl_max_test"]

    @property
    def moment_difference(self) -> float:
        """Of the least moment coefficient from the test."""
        return self.errors["cm_min"] - self.errors["cm_min_test"]


@cache
def stall_loops(path: Path) -> list[Loop]:
    """Loops of oscillating sections; ``path`` holds the measured frames."""
    with np.load(path) as data:
        return [
            Loop(number, *data[f"f{number}_meta_M_a0_a1_k"].tolist(), dynamic_stall.errors(f"f{number}", data))
            for number in dynamic_stall.FRAMES
        ]


def stall_errors(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Absolute differences of largest lift and of least moment coefficient from the test, by frame."""
    loops = stall_loops(path)
    return np.abs([loop.lift_difference for loop in loops]), np.abs([loop.moment_difference for loop in loops])


def stall_table(path: Path) -> Iterator[str]:
    lift, moment = stall_errors(path)
    yield (
        "Dynamic stall of an oscillating NACA 0012 (McAlister and others, NASA TM 84245), one set of constants for all "
        f"frames; largest lift {lift.mean():.2f} and least moment {moment.mean():.2f} off on average; loops in "
        "figures/dynamic_stall.png:\n"
    )
    rows = [
        (
            loop.frame,
            f"{loop.mach:.3f}",
            f"{loop.mean:.1f} ± {loop.amplitude:.1f}",
            f"{loop.frequency:.3f}",
            f"{loop.errors['cl_max']:.2f}",
            f"{loop.lift_difference:+.2f}",
            f"{loop.errors['cm_min']:.3f}",
            f"{loop.moment_difference:+.3f}",
            *(f"{loop.errors[f'rms_{quantity}']:.3f}" for quantity in dynamic_stall.QUANTITIES),
        )
        for loop in stall_loops(path)
    ]
    header = ("frame", "Mach", "angle deg", "k", "largest lift", "difference", "least moment", "difference")
    yield from table((*header, "rms lift", "rms drag", "rms moment"), rows)
