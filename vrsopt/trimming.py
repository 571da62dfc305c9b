"""The cascade that finds a trim: which start is tried after which, and which trim is taken where several exist.

A neighbour's trim; momentum theory; the trim with a tail rotor that never stalls; the trim of a light aircraft,
followed to the mass asked for; the trim of a light aircraft in easy flight, followed to the flight asked for. A way of
trims may fold: it turns back at a largest mass, where a rotor stalls, and comes forward again on trims of deep stall.
Between the folds several trims exist for one mass; the one of least power, met first on the way from a light aircraft,
is the one that an aircraft would fly.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

from vrsopt.residual import ResidualSystem
from vrsopt.solution import Branch, Solution
from vrsopt.solvers.status import Status

Stage = Literal["guess", "momentum", "tail rotor", "homotopy", "arclength"]
SUSPICIOUS = 0.03  # smallest singular value of the scaled Jacobian; 0.1 to 0.2 in ordinary flight
ROUGH = 1.3  # the value from Newton's last Jacobian may be too large by this factor
SAME_POWER = 1e-5  # relative difference within which two trims are one
HEAVIER = 1.1  # how far beyond its mass a suspicious trim is followed to see whether its way turns back
LARGEST_EFFORT = 80  # Jacobians of one continuation


@dataclass(frozen=True)
class Trim:
    """A trim, how it was found and what is known of other trims at the same parameters.

    ``stage``: the start that led to it; a way of trims counts as "homotopy" without folds and "arclength" with them.
    ``folds``: at which parts of the way (0..1) it turned back before this trim. ``coexisting``: another trim was met
    at the same parameters. ``replaced``: it had more power than this one, and was found first.
    ``smallest_singular_value`` of the scaled Jacobian: near zero close to a fold, where derivatives lose their meaning;
    nan without a trim. ``jacobians``: effort of the continuations. ``reason``: why there is no trim.
    """

    solution: Solution
    stage: Stage
    folds: tuple[float, ...] = ()
    coexisting: bool = False
    replaced: bool = False
    smallest_singular_value: float = math.nan
    jacobians: int = 0
    reason: str = ""

    @property
    def success(self) -> bool:
        return self.solution.success

    @property
    def power(self) -> float:
        """Power of both rotors [W]."""
        return self.solution.outputs["main_rotor_power"] + self.solution.outputs["tail_rotor_power"]


def find_trim(
    system: ResidualSystem,
    parameters: Mapping[str, float],
    *,
    easy: Mapping[str, float],
    easier: Callable[[], ResidualSystem] | None = None,
    guess: Solution | None = None,
    method: Literal["ipopt", "newton"] = "newton",
) -> Trim:
    """Trim ``system`` at ``parameters`` (by name, SI units), by the first way that succeeds.

    easy: those parameters, "mass" among them, that make any flight easy: a light aircraft, level, straight, at
    moderate speed. easier: builds the same system with a tail rotor that never stalls. guess: a neighbouring trim;
    without it the result depends on the parameters alone. Nothing is raised for a point without trim: test
    ``success``; ``reason`` tells the mass or the part of the way beyond which there is none.
    """
    search = _Search(system, parameters, easy)
    if guess is not None:
        solution = system.solve(parameters, guess, method=method)
        if solution.success:
            return search.settled(Trim(solution, "guess"))
    first = solution = system.solve(parameters, method=method)
    if solution.success:
        return search.settled(Trim(solution, "momentum"))
    if easier is not None:
        attached = easier().solve(parameters, method="newton")
        if attached.success:
            solution = system.solve(parameters, attached.values, method=method)
            if solution.success:
                return search.settled(Trim(solution, "tail rotor"))
    return search.followed(first)


@dataclass(frozen=True)
class _Search:
    """Continuation towards one point."""

    system: ResidualSystem
    parameters: Mapping[str, float]
    easy: Mapping[str, float]

    def way(self, easy: Mapping[str, float]) -> Trim | None:
        """Trim at the end of the way from the ``easy`` parameters; None if even those have no trim."""
        start = self.system.solve({**self.parameters, **easy}, method="newton")
        if not start.success:
            return None
        branch = self.system.follow(start, self.parameters, max_jacobians=LARGEST_EFFORT)
        return Trim(
            branch.solution,
            "arclength" if branch.folds else "homotopy",
            folds=branch.folds,
            jacobians=branch.jacobians,
            reason="" if branch.solution.success else _reason(branch, easy, self.parameters),
        )

    @property
    def light(self) -> dict[str, float]:
        return {"mass": min(self.easy["mass"], self.parameters["mass"])}

    def followed(self, failed: Solution) -> Trim:
        """Trim by continuation in mass, then in all parameters at once; else ``failed`` with the reason."""
        reasons, effort = [], 0
        for easy in (self.light, {**self.easy, **self.light}):
            trim = self.way(easy)
            if trim is None:
                reasons.append(f"no trim at {easy['mass']:.0f} kg")
                continue
            effort += trim.jacobians
            if trim.success:
                return self.settled(replace(trim, jacobians=effort))
            reasons.append(trim.reason)
        return Trim(failed, "arclength", jacobians=effort, reason="; ".join(reasons))

    def settled(self, trim: Trim) -> Trim:
        """The trim with its smallest singular value; near a fold, the one of least power."""
        value = self.system.smallest_singular_value(trim.solution, exact=False)
        if value < ROUGH * SUSPICIOUS:
            value = self.system.smallest_singular_value(trim.solution)
        if value > SUSPICIOUS:
            return replace(trim, smallest_singular_value=value)
        if trim.stage not in ("homotopy", "arclength"):
            trim = self._lowest(trim)
        value = self.system.smallest_singular_value(trim.solution)
        return replace(trim, smallest_singular_value=value, coexisting=trim.coexisting or self._turns_back(trim))

    def _lowest(self, trim: Trim) -> Trim:
        """The trim met first on the way from a light aircraft, if it takes less power than ``trim``."""
        other = self.way(self.light)
        if other is None:
            return trim
        effort = trim.jacobians + other.jacobians
        if not other.success or abs(other.power - trim.power) <= SAME_POWER * abs(trim.power):
            return replace(trim, jacobians=effort)
        if other.power > trim.power:
            return replace(trim, jacobians=effort, coexisting=True)
        return replace(other, jacobians=effort, coexisting=True, replaced=True)

    def _turns_back(self, trim: Trim) -> bool:
        """Whether the way of trims to a heavier aircraft comes back to this mass: another trim exists here."""
        heavier = {**self.parameters, "mass": HEAVIER * self.parameters["mass"]}
        branch = self.system.follow(trim.solution, heavier, max_jacobians=LARGEST_EFFORT // 3)
        return branch.solution.status is Status.INFEASIBLE


def _reason(branch: Branch, easy: Mapping[str, float], parameters: Mapping[str, float]) -> str:
    """Where the trims that were followed from ``easy`` end."""
    turns = f" after {len(branch.folds)} folds" if branch.folds else ""
    if set(easy) == {"mass"}:
        heaviest = easy["mass"] + branch.furthest * (parameters["mass"] - easy["mass"])
        return f"trims followed from {easy['mass']:.0f} kg reach {heaviest:.0f} kg and end{turns}"
    return f"trims followed from easy flight reach {100 * branch.furthest:.0f} % of the way and end{turns}"
