"""What the whole-mission optimum is worth over the pointwise one: against actuators and agility; writes the page.

Run: python problems/agility.py (about ten minutes on one core)
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from agility_runs import ACCELERATION, NAP, RATES, SHIPPED, SPEEDS, Run, flights, nap_of_the_earth
from page_table import table

from vrsopt.mission.profile import Profile
from vrsopt.report.plots import png
from vrsopt.report.style import BLUE, GREEN, GREY, NORMAL, ORANGE, PURPLE, VERMILION, new_figure, tidy

HERE = Path(__file__).parent
PAGE, PICTURE = HERE / "agility.md", HERE / "figures" / "agility.png"
SMALL = 0.1  # %, below which an advantage is lost in the error of the surrogate
LOW = f"{NAP} changes of speed"  # name of the nap-of-the-earth flight
SMALL_PRINT = 8
FLOWN = ("nominal", "constant", "rate_limited", "pointwise")


def of(results: list[Run], **wanted: object) -> list[Run]:
    """Runs with these values of their fields, in order of the rate and the changes."""
    found = [run for run in results if all(getattr(run, name) == value for name, value in wanted.items())]
    return sorted(found, key=lambda run: (run.changes, run.rate))


def run_table(results: list[Run]) -> Iterator[str]:
    """Fuels of the trajectory, and what the other schedules burn more."""
    rows = []
    for run in results:
        broken = ", ".join(name for name, fine in run.flyable.items() if not fine)
        over = (f"{run.over(name):+.3f}" for name in FLOWN)
        credit = "yes" if run.credit else "no"
        rows.append(
            (
                run.profile,
                f"{run.rate:g}",
                f"{run.twist_rate:g}",
                credit,
                f"{run.trajectory:.3f}",
                *over,
                f"{run.look_ahead:g}",
                broken or "-",
            )
        )
    header = (
        "flight",
        "%/s",
        "deg/s",
        "credit",
        "trajectory kg",
        "nominal %",
        "constant %",
        "rate limited %",
        "raw %",
    )
    yield from table((*header, "look-ahead s", "not flyable"), rows)


def verdict(results: list[Run]) -> Iterator[str]:
    """Whether the trajectory is worth it, in words and numbers."""
    shipped = span(of(results, changes=SHIPPED, rate=1.0), "rate_limited", 3)
    same = [run for run in of(results, profile=LOW, credit=True) if run.twist_rate == run.rate]
    nap = {run.rate: run.over("rate_limited") for run in same}
    slow, most = min(nap), max(results, key=lambda run: run.over("rate_limited"))
    slowed = [run for run in results if run.twist_rate < run.rate]
    yield (
        f"**The advantage is small.** With actuators of 1 %/s and 1 deg/s the pointwise schedule behind a causal rate "
        f"limiter burns {shipped} % more than the best trajectory on the three shipped missions, and {nap[1.0]:.3f} % "
        f"more in the nap-of-the-earth flight: less than the surrogate's own error. It grows as actuators slow down, "
        f"to {nap[slow]:.2f} % at {slow:g} %/s in the nap-of-the-earth flight, and is no larger where twist is ten "
        f"times slower ({span(slowed, 'rate_limited', 2)} %). The most found is {most.over('rate_limited'):.2f} % "
        f"({most.profile}, {most.rate:g} %/s, {most.twist_rate:g} deg/s)."
    )
    yield ""
    eager = [run.look_ahead for run in results if run.look_ahead > 0.0]
    yield (
        f"In {len(eager)} of {len(results)} flights the rate limiter has to look ahead, up to {max(eager):g} s, to "
        "keep the limits: it then needs the plan of the flight, as the trajectory does. In the others it does without."
    )
    yield ""
    yield (
        f"The best constant rotor, set once for the flight, burns {span(results, 'constant', 2)} % more than the "
        f"trajectory, the nominal rotor {span(results, 'nominal', 1)} %. The raw pointwise schedule jumps and no "
        f"actuator can fly it; what it burns less ({span(results, 'pointwise', 2)} %) is the price of the rates."
    )
    yield ""


def span(results: list[Run], name: str, digits: int) -> str:
    """Least and largest excess of a schedule over the trajectory, as text."""
    values = [run.over(name) for run in results]
    return f"{min(values):.{digits}f} to {max(values):.{digits}f}"


def draw(results: list[Run]) -> bytes:
    """Speeds of the nap-of-the-earth flight, and what other schedules burn more than the trajectory."""
    figure = new_figure(10.0, 6.4)
    (speeds, rates), (changes, constant) = figure.subplots(2, 2)
    nap = Profile.of(nap_of_the_earth(NAP)).grid(1.0)
    speeds.plot(nap.time / 60.0, nap.speed, color=BLUE)
    speeds.set(xlabel="time, min", ylabel="true airspeed, m/s", title=f"nap of the earth, {NAP} changes of speed")
    for credit, style in ((True, "o-"), (False, "o--")):
        line = of(results, profile=LOW, credit=credit)
        line = [run for run in line if run.twist_rate == run.rate]
        name = "nap of the earth" + ("" if credit else ", no credit")
        rates.plot(*excess(line, "rate_limited"), style, color=VERMILION, label=name)
    others = ("PATM", "LEM", "SARM", f"{LOW}, heavy")
    for colour, mark, name in zip((BLUE, GREEN, PURPLE, ORANGE), "s^vD", others, strict=True):
        rates.plot(
            *excess(of(results, profile=name), "rate_limited"),
            f"{mark}-",
            color=colour,
            label=name.replace(LOW, "nap of the earth"),
        )
    rates.axhline(SMALL, color=GREY, lw=1.2, ls=":", label="about the error of the surrogate")
    rates.set(xscale="log", xlabel="actuator rate, %/s and deg/s", title="rate-limited pointwise, by actuator rate")
    rates.set_ylabel("fuel over the trajectory's, %")
    rates.set_xticks(RATES, [f"{rate:g}" for rate in RATES])
    rates.minorticks_off()
    rates.legend(fontsize=SMALL_PRINT, frameon=False)
    for axes, name in ((changes, "rate_limited"), (constant, "constant")):
        for colour, mark, rate in zip((VERMILION, ORANGE, BLUE), "os^", (0.1, 0.2, 1.0), strict=True):
            line = [
                run
                for run in of(results, rate=rate, twist_rate=rate, credit=True)
                if run.changes != SHIPPED and "heavy" not in run.profile
            ]
            where = [run.changes for run in line]
            axes.plot(where, excess(line, name)[1], f"{mark}-", color=colour, label=f"{rate:g} %/s and deg/s")
        axes.set(xlabel="changes of speed in the flight", ylabel="fuel over the trajectory's, %")
    changes.set(title="rate-limited pointwise, nap of the earth by changes of speed")
    constant.set(title="best constant rotor, nap of the earth by changes of speed")
    for axes in (changes, constant):
        axes.legend(fontsize=SMALL_PRINT, frameon=False)
    for axes in (speeds, rates, changes, constant):
        for words in (axes.title, axes.xaxis.label, axes.yaxis.label):
            words.set_size(NORMAL)
        tidy(axes)
    return png(figure)


def excess(line: list[Run], name: str) -> tuple[list[float], np.ndarray]:
    """Rates and excess of fuel."""
    return [run.rate for run in line], np.array([run.over(name) for run in line])


def page(results: list[Run]) -> str:
    """The page."""
    lines = [
        "# Agility: when does the whole-mission optimum pay?",
        "",
        "This page is written by `python problems/agility.py`.",
        "",
        "Every schedule starts and ends with the nominal rotor, charges the rotor's kinetic energy to the engines, and",
        "is flown on the same 1 s grid. *Rate limited*: the pointwise optimum behind a causal rate limiter. *Raw*: the",
        "pointwise optimum itself. *Constant*: the best rotor speed and twist held all along. Percentages: fuel over",
        "that of the trajectory. *Credit*: whether a rotor that slows down drives. The nap-of-the-earth flight lasts",
        f"about 860 s at {SPEEDS[0]:g} to {SPEEDS[1]:g} m/s, 50 m above the ground, with {NAP} changes of speed at no",
        f"more than {ACCELERATION:g} m/s2; the others of its kind have fewer or more of them in the same time.",
        "",
        *verdict(results),
        "![Advantage against actuator rate and changes of speed](figures/agility.png)",
        "",
        "Dotted line: 0.1 %, about the error of the surrogate.",
        "",
        *run_table(results),
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the page and its figure."""
    results = list(flights())
    PICTURE.write_bytes(draw(results))
    PAGE.write_text(page(results), encoding="utf-8")


if __name__ == "__main__":
    main()
