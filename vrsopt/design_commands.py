"""Commands on designs of experiments: sample, export, add to and fit them. Models load inside, as in the others."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from vrsopt.console import check_file, print_json, told
from vrsopt.errors import InputError
from vrsopt.options import AsJson, Quiet, count, examples
from vrsopt.progress import telling


def sample(
    out: Annotated[Path, typer.Option(help="Design of experiments to write (SQLite).")],
    samples: Annotated[int, count("Flyable points wanted.")] = 1500,
    space: Annotated[str, typer.Option(help="level: level flight; flight: climb angle and load factor too.")] = "level",
    method: Annotated[str, typer.Option(help="latin_hypercube or sobol.")] = "latin_hypercube",
    seed: Annotated[int, count("Seed of the points.")] = 1,
    workers: Annotated[int, count("Processes; the points do not depend on it.")] = 2,
    dask: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler that has the workers.", show_default="this machine")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Continue a file, by more samples too.")] = False,
    quiet: Quiet = False,
) -> None:
    """Sample the physics into a design of experiments.

    Points are spread over mass, altitude, airspeed, rotor speed and twist, and in the space flight over climb angle
    and load factor, until enough of them are flyable. A killed run loses the points in flight; --resume continues it.
    """
    check_file(out)
    from vrsopt.surrogate.design import sample as sampled

    summary = sampled(
        out,
        space=space,
        method=method,
        samples=samples,
        seed=seed,
        workers=workers,
        resume=resume,
        dask=dask,
        progress=told(quiet),
    )
    print(summary)


def export(
    design: Annotated[Path, typer.Argument(help="Design of experiments, written by vrsopt sample.")],
    out: Annotated[Path, typer.Option(help="Table to write, .nc (NetCDF) or .csv.")],
    quiet: Quiet = False,
) -> None:
    """Write a design of experiments as a table for other programs.

    Inputs, outputs and derivatives of every point, SI units, which the NetCDF file states.
    """
    if out.suffix not in (".nc", ".csv"):
        raise InputError(f"{out}: a name that ends in .nc or .csv")
    check_file(out)
    with telling("export", wanted=told(quiet)):
        from vrsopt.surrogate.database import Database

        with Database.open(design) as database:
            if out.suffix == ".nc":
                database.to_netcdf(out)
            else:
                database.to_csv(out)
            points = len(database.status())
    print(f"{out}: {points} points")


def add_points(
    design: Annotated[Path, typer.Argument(help="Design of experiments, written by vrsopt sample; it is added to.")],
    points: Annotated[Path, typer.Argument(help="Points (CSV): a column for each input, SI units, as vrsopt export.")],
    workers: Annotated[int, count("Processes; the points do not depend on it.")] = 2,
    quiet: Quiet = False,
) -> None:
    """Add points of your own to a design of experiments.

    They are computed first. Other columns of an export are left aside, and points that are there already are skipped,
    so an export with lines added to it can be fed back.
    """
    from vrsopt.surrogate.database import Database
    from vrsopt.surrogate.design import add_points as added
    from vrsopt.surrogate.design_table import read_points

    with Database.open(design) as database:
        inputs = read_points(points, database.meta)
    print(added(design, inputs, workers=workers, progress=told(quiet)))


def fit(
    design: Annotated[Path, typer.Argument(help="Design of experiments, written by vrsopt sample.")],
    out: Annotated[Path, typer.Option(help="Surrogate to write (NetCDF).")],
    correlation: Annotated[
        str,
        typer.Option(help="squared_exponential, matern52, exponential, or best: of each output."),
    ] = "squared_exponential",
    gradient_enhanced: Annotated[
        bool, typer.Option("--gradient-enhanced", help="Fit the stored derivatives too; for a few hundred points.")
    ] = False,
    samples: Annotated[int | None, count("Flyable points to fit, the first of the design.", show_default="all")] = None,
    workers: Annotated[int, count("Processes; the fits do not depend on it.")] = 2,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Fit a surrogate to a design of experiments.

    A Kriging of every output on the flyable points; prints the leave-one-out figures, beside those of fits on all
    converged points.
    """
    check_file(out)
    from vrsopt.surrogate.training import fit as fitted

    result = fitted(
        design,
        out,
        correlation=correlation,
        gradient_enhanced=gradient_enhanced,
        samples=samples,
        workers=workers,
        progress=told(quiet),
    )
    if as_json:
        print_json(result.as_dict())
    else:
        print(result)


DESIGN_COMMANDS: dict[Callable[..., Any], str] = {  # and their examples
    sample: examples(
        ("the shipped design once more", "vrsopt sample --samples 1500 --out doe.db --workers 2"),
        ("a longer one from it, and what a killed run lacks", "vrsopt sample --samples 3000 --out doe.db --resume"),
        ("seven variables, on a cluster", "vrsopt sample --space flight --out flight.db --dask tcp://head:8786"),
    ),
    export: examples(("a table for a spreadsheet", "vrsopt export doe.db --out doe.csv")),
    add_points: examples(
        (
            "points.csv has the line mass,altitude,speed,rotor_speed,twist and one line for each point",
            "vrsopt add-points doe.db points.csv",
        ),
        ("where a mission relies on poor data", "vrsopt add-points doe.db results/sarm/weak_points.csv"),
    ),
    fit: examples(
        ("the shipped surrogate once more", "vrsopt fit doe.db --out surrogate.nc"),
        ("one with gradients", "vrsopt fit doe.db --out surrogate.nc --gradient-enhanced --samples 300"),
    ),
}
