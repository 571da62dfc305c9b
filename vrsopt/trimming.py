"""The cascade that finds a trim: which start is tried after which, and which trim is taken where several exist.

A neighbour's trim; momentum theory; the trim with a tail rotor that never stalls; the trim of a light aircraft in easy
flight, followed to the flight asked for; the trim of a light aircraft, followed to the mass asked for. A way of trims
may fold: it turns back where a rotor stalls, and comes forward again on trims of deep stall. Between the folds several
trims exist for one flight; the one of least power, met first on the way from a light aircraft, is the one that an
aircraft would fly.

Which one was found is checked only where the smallest singular value of the scaled Jacobian is small, close to a fold:
there the way from a light aircraft is followed, unless the trim comes from there, and of the two trims that of less
power is taken. A trim with an ordinary singular value is taken as it is: that no other takes less power, or exists, is
not looked for.
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
HEAVIER = 1.05  # how far beyond its mass a suspicious trim is followed to see whether its way turns back
LARGEST_EFFORT = 80  # Jacobians of one continuation
FORWARD_EFFORT = 20  # Jacobians of the way to the heavier aircraft
CONCLUSIVE = (Status.OUT_OF_BOUNDS, Status.INFEASIBLE)  # ends of a way that another start does not change


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
        """Whether the equations were solved."""
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

    def way(self, easy: Mapping[str, float]) -> Trim:
        """Trim at the end of the way from the ``easy`` parameters."""
        start = self.system.solve({**self.parameters, **easy}, method="newton")
        if not start.success:
            return Trim(start, "arclength", reason=f"no start: {_named(easy, self.parameters)} has no trim")
        branch = self.system.follow(start, self.parameters, max_jacobians=LARGEST_EFFORT)
        return Trim(
            branch.solution,
            "arclength" if branch.folds else "homotopy",
            folds=branch.folds,
            jacobians=branch.jacobians,
            reason="" if branch.solution.success else _reason(branch, easy, self.parameters),
        )

    @property
    def starts(self) -> tuple[Mapping[str, float], ...]:
        """Easy flight, and the flight asked for with the light aircraft, each by the parameters that it changes.

        Easy flight comes first: a light aircraft is not easy to trim in every flight, its drag may be too much.
        """
        light = {"mass": min(self.easy["mass"], self.parameters["mass"])}
        easy = {name: value for name, value in {**self.easy, **light}.items() if value != self.parameters[name]}
        return (easy,) if set(easy) <= {"mass"} else (easy, light)

    def followed(self, failed: Solution) -> Trim:
        """Trim by continuation from easy flight in all parameters at once, then in mass; else ``failed``.

        Where the first way ends in deep stall, behind folds, the second would end there too.
        """
        reasons, effort = [], 0
        for easy in self.starts:
            trim = self.way(easy)
            effort += trim.jacobians
            if trim.success:
                return self.settled(replace(trim, jacobians=effort))
            reasons.append(trim.reason)
            if trim.folds and trim.solution.status in CONCLUSIVE:
                break
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
        other = self.way(self.starts[0])
        effort = trim.jacobians + other.jacobians
        if not other.success or abs(other.power - trim.power) <= SAME_POWER * abs(trim.power):
            return replace(trim, jacobians=effort)
        if other.power > trim.power:
            return replace(trim, jacobians=effort, coexisting=True)
        return replace(other, jacobians=effort, coexisting=True, replaced=True)

    def _turns_back(self, trim: Trim) -> bool:
        """Whether the way of trims to a heavier aircraft comes back to this mass: another trim exists here."""
        heavier = {**self.parameters, "mass": HEAVIER * self.parameters["mass"]}
        branch = self.system.follow(trim.solution, heavier, max_jacobians=FORWARD_EFFORT)
        return branch.solution.status is Status.INFEASIBLE


def _named(easy: Mapping[str, float], parameters: Mapping[str, float]) -> str:
    return f"{easy.get('mass', parameters['mass']):.0f} kg" if set(easy) <= {"mass"} else "easy flight"


def _reason(branch: Branch, easy: Mapping[str, float], parameters: Mapping[str, float]) -> str:
    """Where the trims that were followed from ``easy`` end."""
    reached = f"{100 * branch.furthest:.0f} % of the way"
    if set(easy) == {"mass"}:
        reached = f"{easy['mass'] + branch.furthest * (parameters['mass'] - easy['mass']):.0f} kg"
    turns = f" after {len(branch.folds)} folds" if branch.folds else ""
    bound = branch.solution.message.partition("; ")[2]
    return f"trims followed from {_named(easy, parameters)} reach {reached} and end{turns}{bound and f' ({bound})'}"
