"""The command that maps the flight envelope. Models load inside, as in the others."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from vrsopt.console import NO_SOLUTION, PERCENT, check_folder, complain, converted, print_files, print_json, told
from vrsopt.errors import InputError
from vrsopt.options import AsJson, IsaOffset, Quiet, count, examples, number
from vrsopt.progress import telling

ENVELOPE_EXAMPLES = examples(
    ("the maps of the study", "vrsopt envelope --out results/envelope"),
    (
        "the rotor speed alone, with no manoeuvre margin",
        "vrsopt envelope --variables speed --manoeuvre-margin 1 --out results/no_margin",
    ),
)


def envelope(
    out: Annotated[Path, typer.Option(help="Folder for the maps; made if it does not exist.")],
    variables: Annotated[str, typer.Option(help="What is free: both, speed or twist.")] = "both",
    points: Annotated[int, count("Operating points in all, or a few more.")] = 56_000,
    masses: Annotated[str, typer.Option(help="Gross masses, kg, with commas.")] = "1600,2000,2400",
    rotor_speed_percent: Annotated[str, typer.Option(help="Least and largest rotor speed, % of nominal.")] = "75,115",
    manoeuvre_margin: Annotated[
        float | None, number("Thrust available over thrust flown.", show_default="the aircraft's")
    ] = None,
    isa_offset: IsaOffset = 0.0,
    surrogate: Annotated[
        Path | None, typer.Option(help="Surrogate, written by vrsopt fit.", show_default="the shipped one")
    ] = None,
    workers: Annotated[int, count("Processes; the maps do not depend on it.")] = 2,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> int:
    """Map the best rotor speed and twist over the flight envelope.

    Level flight from 0 to 70 m/s and 0 to 2000 m at some masses: the rotor speed and twist of least fuel flow, what
    they save, the rotor speeds within 0.5 % of the least fuel, and the limits that the optimum rests on.
    """
    if variables not in ("both", "speed", "twist"):
        raise InputError(f"envelope: variables = {variables!r}: one of both, speed, twist")
    low, high = _numbers("rotor_speed_percent", rotor_speed_percent, 2)
    if not low <= 100.0 <= high:
        allowed = "the least and the largest, with 100 between them"
        raise InputError(f"envelope: rotor_speed_percent = {rotor_speed_percent!r}: {allowed}")
    mass = _numbers("masses", masses)
    check_folder(out)
    with telling("envelope: loading the program", wanted=told(quiet)):
        from vrsopt.aircraft import load_aircraft
        from vrsopt.envelope_map import envelope as mapped
        from vrsopt.helicopter import ALLOWED

    nominal = load_aircraft("bo105").main_rotor.nominal_rotor_speed
    bounds = [
        nominal * converted("envelope: rotor_speed_percent", end, per=PERCENT, allowed=ALLOWED["rotor_speed"])
        for end in (low, high)
    ]
    found = mapped(
        surrogate,
        variables=variables,  # type: ignore[arg-type]
        points=points,
        masses=mass,
        rotor_speed_bounds=(bounds[0], bounds[1]),
        manoeuvre_margin=manoeuvre_margin,
        isa_offset=isa_offset,
        workers=workers,
        progress=told(quiet),
    )
    with telling("envelope: figures", wanted=told(quiet)):
        from vrsopt.report.files import write_envelope

        files = write_envelope(found, out)
    if as_json:
        print_json(found.summary())
    else:
        print(found)
        print_files(out, files, quiet=quiet)
    if not found.success:
        complain(f"envelope: {found.message}")
    return 0 if found.success else NO_SOLUTION


def _numbers(field: str, text: str, wanted: int | None = None) -> list[float]:
    """The numbers in ``text``, with commas between them."""
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if not numbers or wanted not in (None, len(numbers)):
        allowed = "numbers with commas between them" if wanted is None else f"{wanted} numbers with a comma"
        raise InputError(f"envelope: {field} = {text!r}: {allowed}")
    return numbers
