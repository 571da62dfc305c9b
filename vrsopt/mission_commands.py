"""Commands on missions: begin one, and schedule it. Models load inside, as in the others."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from vrsopt.console import (
    NO_SOLUTION,
    broken,
    check_asked,
    check_file,
    check_folder,
    complain,
    given,
    print_files,
    print_json,
    told,
    weights,
)
from vrsopt.options import AsJson, Quiet, examples, number
from vrsopt.progress import telling


def new(
    mission: Annotated[Path, typer.Argument(help="Mission file to write, .toml.")],
    quiet: Quiet = False,
) -> None:
    """Write a mission file to begin with.

    Every key is explained, with its unit and what is allowed. It can be solved as it is; a file is never overwritten.
    """
    check_file(mission)
    from vrsopt.mission.template import write_template

    write_template(mission)
    if not quiet:
        print(f"{mission}: change it, then run: vrsopt solve {mission} --out results/{mission.stem}")


def solve(
    out: Annotated[Path, typer.Option(help="Folder for the results; made if it does not exist.")],
    mission: Annotated[
        Path | None, typer.Argument(help="Mission file (TOML) or flown track (CSV, GPX).", show_default=False)
    ] = None,
    repeated: Annotated[
        Path | None, typer.Option("--from", help="In place of a mission: a result.nc, to make it again.")
    ] = None,
    surrogate: Annotated[
        Path | None, typer.Option(help="Surrogate, written by vrsopt fit.", show_default="the shipped one")
    ] = None,
    schedules: Annotated[
        str | None,
        typer.Option(
            help="With commas, some of nominal, constant, pointwise, prescribed, trajectory, consistent, "
            "variable_transmission.",
            show_default="nominal,pointwise,trajectory",
        ),
    ] = None,
    variables: Annotated[
        str | None,
        typer.Option(help="What is free: both, speed, twist, or all: these three cases.", show_default="both"),
    ] = None,
    objective: Annotated[
        str | None,
        typer.Option(
            help="What trajectories minimise: weights of fuel, nox, co, co2, as fuel=1,nox=30.", show_default="fuel"
        ),
    ] = None,
    search: Annotated[
        str | None,
        typer.Option(help="Of pointwise: batched, or nsga2, the genetic search, far slower.", show_default="batched"),
    ] = None,
    mass: Annotated[
        float | None, number("Take-off mass of a flown track, kg; needed with one.", show_default=False)
    ] = None,
    isa_offset: Annotated[
        float | None, number("Temperature above the standard atmosphere, K.", show_default="0, or the mission's")
    ] = None,
    wind_from_deg: Annotated[
        float | None, number("Where the wind blows from, deg true.", show_default="still air, or the mission's")
    ] = None,
    wind_speed: Annotated[
        float | None, number("Speed of the wind, m/s; with --wind-from-deg.", show_default=False)
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> int:
    """Schedule rotor speed and twist over a mission.

    Compares the schedules and writes the results. Every schedule is flown on the surrogate and on the full physics.
    One that breaks a limit ends with exit code 3; the results are written all the same. A result.nc knows what was
    asked for: with --from it is made again, to the same figures on the same program and surrogate.
    """
    asked = {
        "schedules": schedules,
        "variables": variables,
        "objective": objective,
        "search": search,
        "mass": mass,
        "isa_offset": isa_offset,
        "wind_from_deg": wind_from_deg,
        "wind_speed": wind_speed,
    }
    check_asked(mission, repeated, asked)
    check_folder(out)
    with telling("solve", wanted=told(quiet)) as say:
        say("loading the program")
        from vrsopt.report.request import Request, repeat
        from vrsopt.report.request import run as carried_out

    if mission is None:
        assert repeated is not None  # as checked above
        done = repeat(repeated, surrogate=surrogate, progress=told(quiet))
    else:
        request = Request(
            file=mission.name,
            schedules=tuple(name.strip() for name in given(schedules, "nominal,pointwise,trajectory").split(",")),
            variables=given(variables, "both"),
            objective=None if objective is None else weights(objective),
            search=given(search, "batched"),
            mass=mass,
            isa_offset=isa_offset,
            wind=None if wind_from_deg is None else (wind_from_deg, wind_speed),
            surrogate=None if surrogate is None else str(surrogate),
        )
        done = carried_out(mission, request, progress=told(quiet))
    comparison = done.comparison
    with telling(comparison.mission.name, wanted=told(quiet)) as say:
        say("report and figures")
        from vrsopt.report.files import write_results

        files = write_results(comparison, out, mission_text=done.mission_text)
    if as_json:
        print_json(comparison.summary())
    else:
        from rich.console import Console

        from vrsopt.report.tables import summary_table

        Console(width=None if sys.stdout.isatty() else 120).print(summary_table(comparison))
        print_files(out, files, quiet=quiet)
    if not comparison.success:
        complain(f"{comparison.mission.name}: {broken(comparison)}; the results are in {out} all the same")
    return 0 if comparison.success else NO_SOLUTION


MISSION_COMMANDS: dict[Callable[..., Any], str] = {  # and their examples
    new: examples(
        ("a mission of your own, to be changed with an editor", "vrsopt new mission.toml"),
        ("and scheduled", "vrsopt solve mission.toml --out results/mission"),
    ),
    solve: examples(
        ("the search and rescue mission", "vrsopt solve problems/sarm.toml --out results/sarm"),
        ("the same on a hot day", "vrsopt solve problems/sarm.toml --isa-offset 20 --out results/hot"),
        ("a flown track", "vrsopt solve track.gpx --mass 2000 --out results/track"),
        (
            "the study's climb and descent beside",
            "vrsopt solve problems/patm.toml --schedules nominal,pointwise,prescribed --out results/patm",
        ),
        ("a result made again", "vrsopt solve --from results/hot/result.nc --out results/again"),
    ),
}
