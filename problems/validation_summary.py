"""The validation in one table, which the README shows too: each quantity with the command that produces its numbers.

Imported by validation.py. Numbers of the benchmarks, which take long or need other programs, are read from what those
printed: `python tests/benchmarks/NAME.py > tests/benchmarks/NAME.json`.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from calibrate_combustor import FITTED, burnt, operating_line, over_foca
from page_table import table
from validation_engine import consumption, emissions
from validation_gas import all_differences
from validation_isolated import caradonna_tung, stall_errors
from validation_rotor import flight_test_power, frequencies, pitch_errors

from vrsopt.turboshaft.data import load_engine

BENCHMARKS = Path(__file__).parents[1] / "tests" / "benchmarks"
HERE, TESTS = "`python problems/validation.py`", "`python tests/benchmarks/{}.py`"
FRAMES = "`python problems/dynamic_stall.py dynstall.npz`"
HEADER = ("quantity", "model", "reference", "command")
NOT_FITTED = (0.05, 0.07, 0.13)  # of the take-off rating: below the powers that the combustor was fitted at

Row = tuple[str, str, str, str]


def printed(benchmark: str) -> Any:
    """What a benchmark printed when it ran last."""
    return json.loads((BENCHMARKS / f"{benchmark}.json").read_text(encoding="utf-8"))


def span(values: Iterable[float], form: str = "+.0f") -> str:
    """Least and largest of ``values``."""
    found = list(values)
    return f"{min(found):{form}} to {max(found):{form}}".replace("-0 to", "0 to")


def rotor() -> Iterator[Row]:
    marched = printed("time_march")["cases"].values()
    power = max(abs(case["power_difference_percent"]) for case in marched)
    angle = max(abs(difference) for case in marched for difference in case["control_differences_deg"])
    times = span((case["time_ratio"] for case in marched), ".0f")
    yield (
        "time march of the same rotor, power and controls",
        f"within {power:.2f} %, {angle:.3f} deg; the march takes {times} times as long",
        "the same equations marched in time",
        TESTS.format("time_march"),
    )
    main, both, _ = zip(*(flown.differences_percent() for flown in flight_test_power()), strict=True)
    yield (
        "power of both rotors in flight test, 2200 kg",
        f"{span(both)} %; main rotor alone {span(main)} %",
        "the source does not say which power it is",
        HERE,
    )
    pitch = pitch_errors()
    off = f"{pitch.mean():.1f} deg off on average, {pitch.max():.1f} at most"
    yield "pitch attitude, 2200 kg", off, "flight test", HERE
    modes = max(abs(mode.difference_percent) for mode in frequencies())
    yield "blade frequencies at 100 and 85 % speed", f"within {modes:.2f} %", "finite elements", HERE
    excess = [thrust.excess_percent() for thrust in caradonna_tung()]
    disc, passage, _ = zip(*excess, strict=True)
    yield (
        "thrust of an untwisted two-bladed rotor at given collective",
        f"**{span(disc)} %**, with blade passage {span(passage)} %",
        "Caradonna and Tung",
        HERE,
    )


def stall(loops: Path) -> Iterator[Row]:
    lift, moment = stall_errors(loops)
    yield (
        f"oscillating NACA 0012, {len(lift)} frames",
        f"largest lift {lift.mean():.2f}, least moment {moment.mean():.2f} off on average",
        "McAlister and others",
        FRAMES,
    )


def engine() -> Iterator[Row]:
    fuel = next(figure for figure in consumption() if figure.quantity.startswith("fuel at 257 kW"))
    yield (
        "fuel flow at 257 kW, 131.5 kt",
        f"**{fuel.value:.1f} kg/h**",
        "102 kg/h, flight manual ([why](problems/engine.md))",
        HERE,
    )
    maps = printed("pycycle_comparison")
    above, below = (
        abs(maps["largest_difference_percent"][f"{side}_120_kw"]["fuel_flow"]) for side in ("above", "below")
    )
    least = min(ratio for name, ratio in maps["time_ratios"].items() if name.startswith("same_maps"))
    yield (
        f"gas path with pyCycle's own maps, {len(maps['points'])} points",
        f"fuel within {above:.2f} % above 120 kW, {below:.2f} % below; over {100 * int(least / 100)} times its speed",
        f"pyCycle {maps['pycycle_versions']['pycycle']}",
        TESTS.format("pycycle_comparison"),
    )
    kelvin = max(max(found.enthalpy, found.entropy) for found in all_differences())
    yield "gas properties, dry and humid air and products", f"within {kelvin:.2f} K", "Cantera", HERE


def combustor() -> Iterator[Row]:
    points = printed("cantera_comparison")["network"]

    def over(ours: str, theirs: str) -> str:
        return span(100.0 * (point[ours]["nox_index"] / point[theirs]["nox_index"] - 1.0) for point in points)

    yield (
        f"NOx of the combustor network, {span((100 * point['power'] for point in points), '.0f')} % power",
        f"{over('ours_full', 'full')} % with ethylene's prompt NO, {over('ours_no_prompt', 'broken')} % without; as "
        f"shipped **{over('ours', 'full')} %** ([why](problems/emissions.md))",
        "Cantera, GRI-Mech 3.0",
        TESTS.format("cantera_comparison"),
    )
    shipped = [index for index in emissions() if index.fit == "shipped"]
    fitted = ", ".join(f"{100 * power:.0f}" for power in FITTED)
    yield (
        f"NOx at {span((100 * index.power for index in shipped), '.0f')} % power, fitted at {fitted} %",
        f"{span(index.nox_percent for index in shipped)} %; CO {span(index.co_percent for index in shipped)} %",
        "FOCA, factor 2",
        HERE,
    )
    nox, co = idle()
    yield (
        f"NOx at {', '.join(f'{100 * power:.0f}' for power in NOT_FITTED)} % power, not fitted",
        f"{', '.join(f'{x:+.0f}' for x in nox)} %; CO {', '.join(f'{x:+.0f}' for x in co)} %",
        "FOCA, factor 2",
        HERE,
    )


def idle() -> tuple[list[float], list[float]]:
    """NOx and CO over FOCA's at the powers of NOT_FITTED, less one, in per cent."""
    shipped = load_engine()
    power, *states = operating_line(shipped, NOT_FITTED)
    nox, co = over_foca(burnt(shipped, *states), power)
    return nox.tolist(), co.tolist()


def rows(loops: Path | None) -> list[Row]:
    return [*rotor(), *(stall(loops) if loops else ()), *engine(), *combustor()]


def summary(loops: Path | None) -> Iterator[str]:
    """The table, with links as they hold in this folder."""
    yield from (line.replace("](problems/", "](") for line in table(HEADER, rows(loops)))
