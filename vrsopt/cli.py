"""The command line: one sub-command per public verb, percent and degrees at this boundary only.

Exit codes: 0 success; 2 bad input; 3 no solution; 130 interrupted. A failure is one line on standard error. With
``--json`` standard output holds exactly one JSON object, on a failure too. Models load inside the commands, so that
help and complaints about options are instant.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from vrsopt.console import (
    DEGREES,
    NO_SOLUTION,
    PERCENT,
    broken,
    check_asked,
    check_folder,
    complain,
    converted,
    engine_demand,
    engine_figures,
    engine_settings,
    given,
    point_figures,
    print_json,
    print_version,
    run,
    weights,
)
from vrsopt.design_commands import add_points, export, fit, sample
from vrsopt.envelope_command import envelope
from vrsopt.options import Altitude, AsJson, IsaOffset, count, number

app = typer.Typer(add_completion=False, rich_markup_mode=None, context_settings={"help_option_names": ["-h", "--help"]})


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line with ``arguments`` (default: those of the process); returns the exit code."""
    return run(app, sys.argv[1:] if arguments is None else arguments)


@app.callback()
def _root(
    version: Annotated[
        bool,
        typer.Option("--version", callback=print_version, is_eager=True, help="Version of program, model and data."),
    ] = False,
) -> None:
    """Rotor speed and blade twist of a helicopter, scheduled over a mission for least fuel.

    Exit codes: 0 success, 2 bad input, 3 no solution; what is wrong is one line on standard error.
    """


@app.command()
def trim(
    mass: Annotated[float, number("Gross mass, kg.")],
    speed: Annotated[float, number("True airspeed, m/s.")],
    altitude: Altitude = 0.0,
    rotor_speed_percent: Annotated[float, number("Rotor speed, % of nominal.")] = 100.0,
    twist_deg: Annotated[
        float | None, number("Blade twist, deg, washout positive.", show_default="the aircraft's")
    ] = None,
    climb_angle_deg: Annotated[float, number("Flight-path angle, deg.")] = 0.0,
    load_factor: Annotated[float, number("Load factor of a coordinated turn.")] = 1.0,
    isa_offset: IsaOffset = 0.0,
    hub_height: Annotated[
        float | None, number("Height of the hub above the ground, m.", show_default="far away")
    ] = None,
    cg_shift: Annotated[
        float,
        number("Centre of gravity forward of the aircraft data's, m; vrsopt.balance computes it from the loads."),
    ] = 0.0,
    engines_operating: Annotated[
        int | None, count("Engines that operate; the others have failed.", show_default="all")
    ] = None,
    aircraft: Annotated[str, typer.Option(help="Shipped aircraft or TOML file.")] = "bo105",
    out: Annotated[Path | None, typer.Option(help="Folder for figures and maps of the rotor.")] = None,
    as_json: AsJson = False,
) -> int:
    """Trim the aircraft with its engines at one operating point.

    A point that is solved but may not be flown is no failure: it says which limit is broken. With --out the maps of
    the rotor over radius and azimuth, the motion of a blade, powers and margins are drawn into a folder.

    \b
    Example: slow flight with the rotor at 90 %; flight with one engine failed
      vrsopt trim --mass 2200 --altitude 500 --speed 20 --rotor-speed-percent 90 --out results/slow
      vrsopt trim --mass 2000 --speed 30 --engines-operating 1
    """
    if out is not None:
        check_folder(out)
    from vrsopt.aircraft import load_aircraft
    from vrsopt.helicopter import ALLOWED
    from vrsopt.helicopter import trim as trimmed

    data = load_aircraft(aircraft)
    ratio = converted("trim: rotor_speed_percent", rotor_speed_percent, per=PERCENT, allowed=ALLOWED["rotor_speed"])
    slope = converted("trim: climb_angle_deg", climb_angle_deg, per=DEGREES, allowed=ALLOWED["climb_angle"])
    twist = (
        None if twist_deg is None else converted("trim: twist_deg", twist_deg, per=DEGREES, allowed=ALLOWED["twist"])
    )
    point = trimmed(
        mass,
        speed,
        altitude=altitude,
        rotor_speed=ratio * data.main_rotor.nominal_rotor_speed,
        twist=twist,
        climb_angle=slope,
        load_factor=load_factor,
        isa_offset=isa_offset,
        hub_height=hub_height,
        cg_shift=cg_shift,
        engines_operating=engines_operating,
        aircraft=data,
    )
    files: list[Path] = []
    if out is not None and point.success:
        from vrsopt.report.files import write_point

        files = write_point(point, out)
    if as_json:
        print_json(point_figures(point))
    elif point.success:
        print(point)
        if files:
            print(f"{out}: {', '.join(sorted(file.name for file in files))}")
    if not point.success:
        place = f"{mass:g} kg, {speed:g} m/s, {altitude:g} m, rotor speed {rotor_speed_percent:g} %"
        complain(f"trim: no solution at {place}: {point.reason or point.message}")
    return 0 if point.success else NO_SOLUTION


@app.command()
def engine(
    power_kw: Annotated[float | None, number("Demand: shaft power of the engine, kW.")] = None,
    gas_generator_speed_percent: Annotated[float | None, number("Demand: gas-generator speed, % of design.")] = None,
    turbine_temperature_k: Annotated[float | None, number("Demand: temperature between the turbines, K.")] = None,
    rating: Annotated[str | None, typer.Option(help="Demand: a rating of the engine's file, as take_off.")] = None,
    power_turbine_speed_percent: Annotated[
        float | None, number("Power-turbine speed, % of nominal.", show_default="100, or the rating's own")
    ] = None,
    altitude: Altitude = 0.0,
    isa_offset: IsaOffset = 0.0,
    mach: Annotated[float, number("Flight Mach number.")] = 0.0,
    humidity_g_kg: Annotated[float, number("Water vapour of the air, g per kg of dry air.")] = 0.0,
    bleed_percent: Annotated[float, number("Air bled behind the compressor, % of its flow.")] = 0.0,
    power_offtake_kw: Annotated[float, number("Power taken from the gas generator, kW.")] = 0.0,
    engine_file: Annotated[str, typer.Option("--engine", help="Shipped engine or TOML file.")] = "allison_250_c20b",
    as_json: AsJson = False,
) -> int:
    """One engine at one demand: shaft power, gas-generator speed, turbine temperature or a rating.

    Fuel flow and emissions of one engine; hydrocarbons by FOCA's correlation; NOx and CO at idle are indicative.

    \b
    Example: cruise power on a hot day; take-off rating in humid air
      vrsopt engine --power-kw 200 --altitude 1000 --isa-offset 20
      vrsopt engine --rating take_off --humidity-g-kg 10
    """
    demand = engine_demand(power_kw, gas_generator_speed_percent, turbine_temperature_k, rating)
    from vrsopt.turboshaft.data import load_engine
    from vrsopt.turboshaft.performance import engine as solved

    result = solved(
        **demand,
        **engine_settings(
            power_turbine_speed_percent=power_turbine_speed_percent,
            humidity_g_kg=humidity_g_kg,
            bleed_percent=bleed_percent,
            power_offtake_kw=power_offtake_kw,
        ),
        altitude=altitude,
        isa_offset=isa_offset,
        mach=mach,
        engine_data=load_engine(engine_file),
    )
    if as_json:
        print_json(engine_figures(result))
    elif result.success:
        print(result)
    if not result.success:
        complain(f"engine: {result.message}")
    return 0 if result.success else NO_SOLUTION


for command in (sample, export, add_points, fit, envelope):
    app.command()(command)


@app.command()
def solve(
    out: Annotated[Path, typer.Option(help="Folder for the results; made if it does not exist.")],
    mission: Annotated[
        Path | None, typer.Argument(help="Mission file (TOML) or flown track (CSV, GPX).", show_default="needed")
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
        str | None, typer.Option(help="What is free: both, speed, twist, or all three cases.", show_default="both")
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
    mass: Annotated[float | None, number("Take-off mass of a flown track, kg.", show_default="needed with it")] = None,
    isa_offset: Annotated[
        float | None, number("Temperature above the standard atmosphere, K.", show_default="0, or the mission's")
    ] = None,
    wind_from_deg: Annotated[
        float | None, number("Where the wind blows from, deg true.", show_default="still air, or the mission's")
    ] = None,
    wind_speed: Annotated[float | None, number("Speed of the wind, m/s.", show_default="with --wind-from-deg")] = None,
    as_json: AsJson = False,
) -> int:
    """Schedule rotor speed and twist over a mission.

    Compares the schedules and writes the results. Every schedule is flown on the surrogate and on the full physics.
    One that breaks a limit ends with exit code 3; the results are written all the same. A result.nc knows what was
    asked for: with --from it is made again, to the same figures on the same program and surrogate.

    \b
    Example: the search and rescue mission; the same on a hot day; a flown track; the study's climb and descent beside;
    a result made again
      vrsopt solve problems/sarm.toml --out results/sarm
      vrsopt solve problems/sarm.toml --isa-offset 20 --out results/hot
      vrsopt solve track.gpx --mass 2000 --out results/track
      vrsopt solve problems/patm.toml --schedules nominal,pointwise,prescribed --out results/patm
      vrsopt solve --from results/hot/result.nc --out results/again
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
    from vrsopt.report.request import Request, repeat
    from vrsopt.report.request import run as carried_out

    if mission is None:
        assert repeated is not None  # as checked above
        done = repeat(repeated, surrogate=surrogate, progress=sys.stderr.isatty())
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
        done = carried_out(mission, request, progress=sys.stderr.isatty())
    from vrsopt.report.files import write_results

    comparison = done.comparison
    files = write_results(comparison, out, mission_text=done.mission_text)
    if as_json:
        print_json(comparison.summary())
    else:
        from rich.console import Console

        from vrsopt.report.tables import summary_table

        Console(width=None if sys.stdout.isatty() else 120).print(summary_table(comparison))
        print(f"{out}: {', '.join(sorted(str(file.relative_to(out)) for file in files))}")
    if not comparison.success:
        complain(f"{comparison.mission.name}: {broken(comparison)}")
    return 0 if comparison.success else NO_SOLUTION
