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
    check_folder,
    complain,
    converted,
    engine_demand,
    engine_figures,
    engine_settings,
    point_figures,
    print_files,
    print_json,
    print_version,
    run,
    told,
)
from vrsopt.design_commands import DESIGN_COMMANDS
from vrsopt.envelope_command import ENVELOPE_EXAMPLES, envelope
from vrsopt.mission_commands import MISSION_COMMANDS
from vrsopt.options import Altitude, AsJson, IsaOffset, Quiet, count, examples, number
from vrsopt.progress import telling

EXAMPLES = examples(
    ("one operating point", "vrsopt trim --mass 2200 --speed 30"),
    ("a mission of your own", "vrsopt new mission.toml"),
    ("its schedules of least fuel, with report and figures", "vrsopt solve mission.toml --out results/mission"),
    ("what a command takes", "vrsopt solve --help"),
)
TRIM_EXAMPLES = examples(
    ("level flight", "vrsopt trim --mass 2200 --speed 30"),
    (
        "slow flight with the rotor at 90 %, with maps of the rotor",
        "vrsopt trim --mass 2200 --altitude 500 --speed 20 --rotor-speed-percent 90 --out results/slow",
    ),
    ("flight with one engine failed", "vrsopt trim --mass 2000 --speed 30 --engines-operating 1"),
)
ENGINE_EXAMPLES = examples(
    ("cruise power on a hot day", "vrsopt engine --power-kw 200 --altitude 1000 --isa-offset 20"),
    ("take-off rating in humid air", "vrsopt engine --rating take_off --humidity-g-kg 10"),
)

app = typer.Typer(rich_markup_mode=None, context_settings={"help_option_names": ["-h", "--help"]})


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line with ``arguments`` (default: those of the process); returns the exit code."""
    return run(app, sys.argv[1:] if arguments is None else arguments)


@app.callback(epilog=EXAMPLES)
def _root(
    version: Annotated[
        bool,
        typer.Option("--version", callback=print_version, is_eager=True, help="Version of program, model and data."),
    ] = False,
) -> None:
    """Rotor speed and blade twist of a helicopter, scheduled over a mission for least fuel.

    Exit codes: 0 success, 2 bad input, 3 no solution; what is wrong is one line on standard error.
    """


@app.command(epilog=TRIM_EXAMPLES)
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
    quiet: Quiet = False,
) -> int:
    """Trim the aircraft with its engines at one operating point.

    A point that is solved but may not be flown is no failure: it says which limit is broken. With --out the maps of
    the rotor over radius and azimuth, the motion of a blade, powers and margins are drawn into a folder.
    """
    if out is not None:
        check_folder(out)
    files: list[Path] = []
    with telling("trim", wanted=told(quiet)) as say:
        from vrsopt.aircraft import load_aircraft
        from vrsopt.helicopter import ALLOWED
        from vrsopt.helicopter import trim as trimmed

        data = load_aircraft(aircraft)
        ratio = converted("trim: rotor_speed_percent", rotor_speed_percent, per=PERCENT, allowed=ALLOWED["rotor_speed"])
        slope = converted("trim: climb_angle_deg", climb_angle_deg, per=DEGREES, allowed=ALLOWED["climb_angle"])
        twist = None
        if twist_deg is not None:
            twist = converted("trim: twist_deg", twist_deg, per=DEGREES, allowed=ALLOWED["twist"])
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
        if out is not None and point.success:
            say("figures and maps of the rotor")
            from vrsopt.report.files import write_point

            files = write_point(point, out)
    if as_json:
        print_json(point_figures(point))
    elif point.success:
        print(point)
        print_files(out, files, quiet=quiet)
    if not point.success:
        place = f"{mass:g} kg, {speed:g} m/s, {altitude:g} m, rotor speed {rotor_speed_percent:g} %"
        complain(f"trim: no solution at {place}: {point.reason or point.message}")
    return 0 if point.success else NO_SOLUTION


@app.command(epilog=ENGINE_EXAMPLES)
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
    quiet: Quiet = False,
) -> int:
    """Run one engine at one demand.

    The demand is a shaft power, a gas-generator speed, a turbine temperature or a rating. Fuel flow and emissions are
    those of one engine; hydrocarbons by FOCA's correlation; NOx and CO at idle are indicative.
    """
    demand = engine_demand(power_kw, gas_generator_speed_percent, turbine_temperature_k, rating)
    with telling("engine", wanted=told(quiet)):
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


for command, typed in {**DESIGN_COMMANDS, envelope: ENVELOPE_EXAMPLES, **MISSION_COMMANDS}.items():
    app.command(epilog=typed)(command)
