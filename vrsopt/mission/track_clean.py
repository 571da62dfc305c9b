"""What is wrong with a recorded track put right before it is smoothed, and said.

Times out of order are sorted, fixes of one moment become one, positions and altitudes that no helicopter can have been
at are left out, long gaps are bridged.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vrsopt.errors import InputError
from vrsopt.mission.route import WGS84
from vrsopt.mission.track_data import Track

Array = NDArray[Any]
# m/s over the ground: a change of position is improbable above the first, an error of the receiver above the second
POSITION_RATES = (80.0, 120.0)
POSITION_NOISE = 50.0  # m, on top of it
ALTITUDE_RATES = (7.5, 15.0)  # m/s, the same up and down
ALTITUDE_NOISE = 40.0  # m: some receivers round to 100 ft
IMPROBABLE = 3.0  # fixes, that an improbable change has to win for a chain
EARTH = 6_371_000.0  # m, radius
STALE = 30.0  # m, the least step after a repeated position that shows that it was not standing
LOOK_BACK = 100  # fixes, from a fix to the one before it in a chain
MOST_DROPPED = 0.2  # of the fixes
CLOSEST = 0.5  # s, fixes closer together than this are averaged
SHORT_GAP = 60.0  # s, up to here the smoothing filter bridges alone
LONGEST_GAP = 600.0  # s
BRIDGE_STEP = 10.0  # s, between the positions put into a long gap
SHORTEST, LONGEST = 60.0, 12 * 3600.0  # s, duration of a track
FEWEST = 10  # fixes


@dataclass(frozen=True)
class Fixes:
    """Fixes (N,) in the order of time, from time 0, at least half a second apart."""

    time: Array  # s
    latitude_deg: Array
    longitude_deg: Array
    altitude: Array  # m, nan where unknown
    on_ground: Array | None  # share of the fixes averaged here that say so
    notes: tuple[str, ...]


def cleaned(track: Track) -> Fixes:
    """The track put right, every change counted in the notes.

    Raises :class:`InputError` for a track too short, with gaps too long, or of which too much had to be left out.
    """
    notes: list[str] = []
    columns = [track.time, track.latitude_deg, track.longitude_deg, track.altitude]
    ground = np.zeros(len(track)) if track.on_ground is None else track.on_ground
    table = np.array([*columns, ground], dtype=float)
    table = _in_order(table, notes)
    table = _merged(table, 1e-3, notes, "fixes of the same time as another: averaged with it")
    _check_length(track, table)
    table = table[:, ~_stale(table, notes)]
    table = table[:, _possible_positions(track, table, notes)]
    table = _merged(table, CLOSEST, notes, f"fixes less than {CLOSEST:g} s after another: averaged with it")
    table[3, ~_possible_altitudes(track, table, notes)] = np.nan
    _check_length(track, table)
    table[3] = _ground_altitudes(table, notes)
    table = _bridged(track, table, notes)
    table[3], held = _ends_held(table[3], np.isfinite(table[3]))
    if held:
        notes.append(f"{held} fixes at the ends of the track have no altitude: the first or last known one is kept")
    table[0] -= table[0, 0]
    time, latitude, longitude, altitude, ground = table
    return Fixes(time, latitude, longitude, altitude, None if track.on_ground is None else ground, tuple(notes))


def _in_order(table: Array, notes: list[str]) -> Array:
    back = int(np.sum(np.diff(table[0]) < 0.0))
    if back:
        notes.append(f"{back} times go back: fixes sorted by time")
    return table[:, np.argsort(table[0], kind="stable")]


def _merged(table: Array, within: float, notes: list[str], words: str) -> Array:
    """Fixes that begin less than ``within`` [s] after the first of their group, as the group's mean."""
    start, first = np.ones(table.shape[1], dtype=bool), table[0, 0]
    for k, time in enumerate(table[0]):
        if k and time - first < within - 1e-9:
            start[k] = False
        else:
            first = time
    if start.all():
        return table
    notes.append(f"{int(np.sum(~start))} {words}")
    group = np.cumsum(start) - 1
    known = np.isfinite(table)
    total = np.array([np.bincount(group, weights=row) for row in np.where(known, table, 0.0)])
    count = np.array([np.bincount(group, weights=row) for row in known])
    return np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0)


def _check_length(track: Track, table: Array) -> None:
    time = table[0]
    if len(time) < FEWEST:
        raise InputError(f"{track.name}: {len(time)} fixes of different times: allowed: at least {FEWEST}")
    length = time[-1] - time[0]
    if not SHORTEST <= length <= LONGEST:
        raise InputError(
            f"{track.name}: time: {length:.6g} s from first to last: allowed: {SHORTEST:g} to {LONGEST:g} s"
        )
    known = int(np.sum(np.isfinite(table[3])))
    if known < FEWEST:
        raise InputError(f"{track.name}: altitude: {known} fixes have one: allowed: at least {FEWEST}")


def _points(table: Array) -> Array:
    """Positions (N, 3) [m] on a sphere, good enough for distances to half a per cent."""
    latitude, longitude = np.radians(table[1]), np.radians(table[2])
    equator = np.cos(latitude)
    return EARTH * np.stack([equator * np.cos(longitude), equator * np.sin(longitude), np.sin(latitude)], axis=1)


def _stale(table: Array, notes: list[str]) -> Array:
    """Which positions are the one before once more, although the next one shows that it moved."""
    same = np.append(False, np.all(np.diff(table[1:3], axis=1) == 0.0, axis=0))
    stale = np.zeros(len(same), dtype=bool)
    point = _points(table)
    for first in np.flatnonzero(same & ~np.append(False, same[:-1])):
        last = first + int(np.argmin(np.append(same[first:], False))) - 1
        if last + 1 == len(same) or table[0, last] - table[0, first - 1] > SHORT_GAP:
            continue  # it stands
        if np.linalg.norm(point[last + 1] - point[last]) > STALE:
            stale[first : last + 1] = True
    if stale.any():
        notes.append(f"{int(stale.sum())} positions repeat the one before although it moved on: left out")
    return stale


def _possible_positions(track: Track, table: Array, notes: list[str]) -> Array:
    """Which fixes belong to the longest chain that a helicopter can have flown."""
    point = _points(table)

    def cost(before: Any, after: Any) -> Array:
        apart = np.linalg.norm(point[after] - point[before], axis=-1)
        return _cost(apart - POSITION_NOISE, table[0, after] - table[0, before], POSITION_RATES)

    kept = best_chain(table.shape[1], cost)
    _say_dropped(track, table[0], kept, notes, "positions", f"{POSITION_RATES[1]:g} m/s over the ground")
    return kept


def _possible_altitudes(track: Track, table: Array, notes: list[str]) -> Array:
    """The same for altitudes: which of all fixes have one to keep."""
    known = np.flatnonzero(np.isfinite(table[3]))
    time, altitude = table[0, known], table[3, known]

    def cost(before: Any, after: Any) -> Array:
        apart = np.abs(altitude[after] - altitude[before])
        return _cost(apart - ALTITUDE_NOISE, time[after] - time[before], ALTITUDE_RATES)

    kept = best_chain(len(known), cost)
    _say_dropped(track, time, kept, notes, "altitudes", f"{ALTITUDE_RATES[1]:g} m/s up or down")
    inside = slice(known[0], known[-1]) if len(known) else slice(0)
    if missing := int(np.sum(~np.isfinite(table[3, inside]) & (table[4, inside] <= 0.5))):
        notes.append(f"{missing} fixes have no altitude: taken from the smoothed altitudes around them")
    use = np.zeros(table.shape[1], dtype=bool)
    use[known[kept]] = True
    return use


def _ground_altitudes(table: Array, notes: list[str]) -> Array:
    """Altitudes, with one for each stay on the ground where the receiver gives none.

    That of other fixes of the same stay, else the lower one of the flight just before and after.
    """
    time, altitude, down = table[0], table[3].copy(), table[4] > 0.5
    known = np.flatnonzero(np.isfinite(table[3]))
    breaks = np.flatnonzero((np.diff(down.astype(int)) != 0) | (np.diff(time) > SHORT_GAP)) + 1
    given = []
    for stay in np.split(np.arange(len(time)), breaks):
        missing = stay[~np.isfinite(altitude[stay])]
        if not down[stay[0]] or not len(missing):
            continue
        within = known[(known >= stay[0]) & (known <= stay[-1])]
        if not len(within):
            beside = np.concatenate([known[known < stay[0]][-1:], known[known > stay[-1]][:1]])
            apart = np.maximum(time[stay[0]] - time[beside], time[beside] - time[stay[-1]])
            within = beside[apart <= max(SHORT_GAP, float(np.min(apart)))]
            altitude[missing] = np.min(table[3, within])
        else:
            altitude[missing] = np.median(table[3, within])
        given += [*missing]
    if given:
        notes.append(
            f"{len(given)} fixes on the ground have no altitude, the first at {time[given[0]] - time[0]:.0f} s: "
            "taken as those of the nearest fixes, the lower of two"
        )
    return altitude


def _ends_held(altitude: Array, known: Array) -> tuple[Array, int]:
    """Altitudes, the first and last ``known`` ones kept to the ends: no curve is carried on; and how many that are."""
    first, *_, last = np.flatnonzero(known)
    held = altitude.copy()
    held[:first], held[last + 1 :] = altitude[first], altitude[last]
    return held, int(first + len(altitude) - 1 - last)


def _say_dropped(track: Track, time: Array, kept: Array, notes: list[str], what: str, limit: str) -> None:
    dropped = int(np.sum(~kept))
    if not dropped:
        return
    first = time[~kept][0]
    if dropped > MOST_DROPPED * len(kept):
        raise InputError(
            f"{track.name}: {dropped} of {len(kept)} {what}, the first at {first:.0f} s, need more than {limit}: "
            f"allowed: {100 * MOST_DROPPED:g} %"
        )
    notes.append(f"{dropped} {what} left out, the first at {first:.0f} s: they need more than {limit}")


def _cost(change: Array, time: Array, rates: tuple[float, float]) -> Array:
    """What a change costs a chain, in fixes."""
    return np.where(change > rates[1] * time, np.inf, np.where(change > rates[0] * time, IMPROBABLE, 0.0))


def best_chain(count: int, cost: Callable[[Any, Any], Array]) -> Array:
    """Which of ``count`` fixes are in the chain with the most fixes less what its links cost, ``cost(before, after)``.

    A jump for a few fixes is left out whole, wherever it is; only chains that skip less than LOOK_BACK fixes are seen.
    """
    order = np.arange(count)
    if not cost(order[:-1], order[1:]).any():
        return np.ones(count, dtype=bool)
    score, link = np.ones(count), np.full(count, -1)
    for k in range(1, count):
        before = order[max(0, k - LOOK_BACK) : k]
        candidates = score[before] - cost(before, k)
        best = len(candidates) - 1 - int(np.argmax(candidates[::-1]))  # of equal ones, the nearest
        if candidates[best] > 0.0:
            score[k], link[k] = candidates[best] + 1.0, before[best]
    kept, k = np.zeros(count, dtype=bool), int(np.argmax(score))
    while k >= 0:
        kept[k] = True
        k = int(link[k])
    return kept


def _bridged(track: Track, table: Array, notes: list[str]) -> Array:
    """Gaps of more than a minute filled with positions at constant ground speed on the geodesic; shorter ones said."""
    time = table[0]
    step = np.diff(time)
    usual = float(np.median(step))
    short = (step > max(3.0 * usual, 10.0)) & (step <= SHORT_GAP)
    if short.any():
        longest = f"{np.max(step[short]):.0f} s at {time[:-1][short][np.argmax(step[short])]:.0f} s"
        notes.append(f"{int(short.sum())} gaps of up to a minute, the longest {longest}: bridged by the filter")
    _check_gaps(track, time, "fix")
    known = np.isfinite(table[3])
    _check_gaps(track, np.concatenate([[time[0]], time[known], [time[-1]]]), "altitude")
    pieces = [table]
    for k in np.flatnonzero(step > SHORT_GAP):
        line = WGS84.Inverse(table[1, k], table[2, k], table[1, k + 1], table[2, k + 1])
        shares = np.linspace(0.0, 1.0, int(np.ceil(step[k] / BRIDGE_STEP)) + 1)[1:-1]
        ends = [WGS84.Direct(table[1, k], table[2, k], line["azi1"], share * line["s12"]) for share in shares]
        inside = time[k] + shares * step[k]
        height = np.interp(inside, time[known], table[3, known])
        ground = np.full(len(shares), min(table[4, k], table[4, k + 1]))
        pieces.append(np.array([inside, [e["lat2"] for e in ends], [e["lon2"] for e in ends], height, ground]))
        speed = line["s12"] / step[k]
        notes.append(f"gap of {step[k]:.0f} s at {time[k]:.0f} s: bridged straight, at a constant {speed:.1f} m/s")
    joined = np.concatenate(pieces, axis=1)
    return joined[:, np.argsort(joined[0], kind="stable")]


def _check_gaps(track: Track, time: Array, what: str) -> None:
    step = np.diff(time)
    worst = int(np.argmax(step))
    if step[worst] > LONGEST_GAP:
        raise InputError(
            f"{track.name}: no {what} from {time[worst]:.0f} to {time[worst + 1]:.0f} s: allowed: gaps of at most "
            f"{LONGEST_GAP:g} s; split the file there"
        )
