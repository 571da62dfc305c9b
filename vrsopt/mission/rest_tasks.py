"""Tasks that stand over a place: on the ground, in a hover, straight up."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import BeforeValidator

from vrsopt.mission.field import MAX_ALTITUDE, tenths_up, within
from vrsopt.mission.pilot import SAME_HEIGHT
from vrsopt.mission.tasks import Duration, MassChange, Task

if TYPE_CHECKING:
    from vrsopt.mission.pilot import Pilot

LIFT_OFF_HEIGHT = 5.0  # m, the most a hover may be above the ground when an idle task comes before or after it
LIFT_OFF_RATE = 1.0  # m/s, (assumed) at most, of lift-off and touch-down

Height = Annotated[float, BeforeValidator(within(0.0, 500.0))]


class _OnTheGround(Task):
    """On the ground at a place. A mass change happens at the start."""

    at_rest: ClassVar[bool] = True

    kind: Literal["idle", "ground_idle"]
    duration_s: Duration
    mass_change_kg: MassChange = 0.0

    def fly(self, pilot: Pilot) -> None:
        pilot.here(self.kind)
        if pilot.before not in ("", "idle", "ground_idle", "hover"):
            pilot.refuse("kind", self.kind, "allowed: as the first task or after a hover")
        pilot.begin(f"{self.kind.replace('_', ' ')} at {pilot.place}", self.kind, mass_change=self.mass_change_kg)
        pilot.stay(self.duration_s)


class Idle(_OnTheGround):
    """On the ground, rotor at nominal speed and flat pitch. A mass change happens at its start."""

    kind: Literal["idle"]


class GroundIdle(_OnTheGround):
    """On the ground, the engines at their ground idle, the rotor turning slowly with them."""

    kind: Literal["ground_idle"]


class Hover(Task):
    """Still over a place, skids ``height_m`` above its elevation: near the ground in its effect.

    Lift-off from an idle task before it and touch-down for one after it are part of it. A mass change happens at its
    start.
    """

    at_rest: ClassVar[bool] = True

    kind: Literal["hover"]
    duration_s: Duration
    height_m: Height = 2.0
    mass_change_kg: MassChange = 0.0

    def fly(self, pilot: Pilot) -> None:
        place = pilot.here("hover")
        altitude = place.elevation_m + self.height_m
        if altitude > MAX_ALTITUDE:
            allowed = f"allowed: an altitude of at most {MAX_ALTITUDE:g} m, not {altitude:g} m"
            pilot.refuse("height_m", self.height_m, allowed)
        grounded = pilot.before in ("idle", "ground_idle")
        lands = isinstance(pilot.next_task, Idle | GroundIdle)
        if (grounded or lands) and self.height_m > LIFT_OFF_HEIGHT:
            side = "after" if grounded else "before"
            pilot.refuse("height_m", self.height_m, f"allowed {side} an idle task: at most {LIFT_OFF_HEIGHT:g}")
        if not pilot.segments:
            pilot.altitude = altitude
        elif not grounded and abs(altitude - pilot.altitude) > SAME_HEIGHT:
            height = pilot.altitude - place.elevation_m
            pilot.refuse("height_m", self.height_m, f"allowed here: {height:g}, the height the aircraft has")
        lifting = pilot.lift_time(self.height_m, LIFT_OFF_RATE)
        still = self.duration_s - lifting * (grounded + lands)
        if still < 1.0:
            least = tenths_up(self.duration_s - still + 1.0)
            allowed = f"allowed: at least {least}, the time to lift off and to touch down and a second more"
            pilot.refuse("duration_s", self.duration_s, allowed)
        pilot.begin(f"hover at {pilot.place}", "hover", mass_change=self.mass_change_kg)
        if grounded:
            pilot.lift(altitude, LIFT_OFF_RATE)
        pilot.stay(still)
        if lands:
            pilot.lift(place.elevation_m, LIFT_OFF_RATE)


class VerticalClimb(Task):
    """Straight up from a hover to ``height_m`` above the place, at up to ``climb_rate_m_s``."""

    at_rest: ClassVar[bool] = True

    kind: Literal["vertical_climb"]
    height_m: Height
    climb_rate_m_s: Annotated[float, BeforeValidator(within(0.1, 6.0))] = 2.5

    def fly(self, pilot: Pilot) -> None:
        place = pilot.here("vertical_climb")
        if pilot.before not in ("hover", "vertical_climb"):
            pilot.refuse("kind", self.kind, "allowed: after a hover")
        altitude, height = place.elevation_m + self.height_m, pilot.altitude - place.elevation_m
        if altitude > MAX_ALTITUDE or self.height_m <= height + SAME_HEIGHT:
            highest = MAX_ALTITUDE - place.elevation_m
            allowed = f"allowed: above {height:g}, where it begins, and at most {highest:g}"
            pilot.refuse("height_m", self.height_m, allowed)
        pilot.begin(f"vertical climb at {pilot.place}", "vertical_climb")
        pilot.lift(altitude, self.climb_rate_m_s)
