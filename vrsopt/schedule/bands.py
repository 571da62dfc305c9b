"""Rotor speeds at which the rotor must not stay: it may cross such a band within a stated time, no more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from vrsopt.errors import InputError
from vrsopt.quantity import is_number


@dataclass(frozen=True)
class ForbiddenBand:
    """Between ``lower`` and ``upper`` [rad/s], exclusive, the rotor stays at most ``crossing_time`` [s] at a time.

    With a crossing time of zero the rotor stays on the side on which it begins.
    """

    lower: float
    upper: float
    crossing_time: float

    def __post_init__(self) -> None:
        for name in ("lower", "upper", "crossing_time"):
            if not is_number(getattr(self, name)):
                raise InputError(f"forbidden band: {name} = {getattr(self, name)!r}: must be a number")
        if not 0.0 <= self.lower < self.upper:
            raise InputError(f"forbidden band: {self}: lower must be below upper")
        if not 0.0 <= self.crossing_time:
            raise InputError(f"forbidden band: crossing_time = {self.crossing_time!r} s: must not be negative")

    def __str__(self) -> str:
        return f"{self.lower:g} to {self.upper:g} rad/s"


def allowed_regions(bands: Sequence[ForbiddenBand], low: float, high: float) -> tuple[tuple[float, float], ...]:
    """What ``bands`` leave of the rotor speeds ``low`` to ``high`` [rad/s], from below; its bands lie in between.

    Raises :class:`InputError` for bands that overlap or leave nothing.
    """
    ordered = sorted(bands, key=lambda band: band.lower)
    for one, other in pairwise(ordered):
        if other.lower <= one.upper:
            raise InputError(f"forbidden bands {one} and {other}: must not touch: state them as one")
    regions, bottom = [], low
    for band in ordered:
        if bottom > high:
            break
        regions.append((bottom, min(band.lower, high)))
        bottom = max(bottom, band.upper)
    regions.append((bottom, high))
    kept = tuple(region for region in regions if region[0] < region[1] or (low == high and region == (low, high)))
    if not kept:
        raise InputError(f"forbidden bands {', '.join(map(str, ordered))}: leave none of {low:g} to {high:g} rad/s")
    return kept


def check_bands(
    bands: Sequence[ForbiddenBand], *, bounds: tuple[float, float], rate: float | None, held: float | None
) -> None:
    """Raises :class:`InputError` for bands that contradict the other settings.

    ``bounds`` [rad/s] and ``rate`` [rad/s2] of the rotor speed; ``held``: a rotor speed [rad/s] that the mission needs.
    """
    regions = allowed_regions(bands, *bounds)
    for band in bands:
        if held is not None and band.lower < held < band.upper:
            raise InputError(
                f"forbidden band {band}: contains the rotor speed {held:g} rad/s, at which the rotor is held in idle "
                "or at the ends of the mission"
            )
        if rate is None or not 0.0 < band.crossing_time or len(regions) == 1:
            continue
        needed = (band.upper - band.lower) / rate if rate > 0.0 else float("inf")
        if bounds[0] < band.lower and band.upper < bounds[1] and band.crossing_time < needed:
            raise InputError(
                f"forbidden band {band}: crossing_time = {band.crossing_time:g} s: at {rate:g} rad/s2 it takes "
                f"{needed:.3g} s to cross"
            )
