"""Commands on designs of experiments: sample, export, add to and fit them. Models load inside, as in the others."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from vrsopt.console import check_file, print_json
from vrsopt.errors import InputError
from vrsopt.options import AsJson, count


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
) -> None:
    """Sample the physics into a design of experiments.

    Points are spread over mass, altitude, airspeed, rotor speed and twist, and in the space flight over climb angle
    and load factor, until enough of them are flyable. A killed run loses the points in flight; --resume continues it.

    \b
    Example: the shipped design once more; a longer one from it; seven variables on a cluster
      vrsopt sample --samples 1500 --out doe.db --workers 2
      vrsopt sample --samples 3000 --out doe.db --resume
      vrsopt sample --space flight --out flight.db --dask tcp://head:8786
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
        progress=sys.stderr.isatty(),
    )
    print(summary)


def export(
    design: Annotated[Path, typer.Argument(help="Design of experiments, written by vrsopt sample.")],
    out: Annotated[Path, typer.Option(help="Table to write, .nc (NetCDF) or .csv.")],
) -> None:
    """Write a design of experiments as a table for other programs.

    Inputs, outputs and derivatives of every point, SI units, which the NetCDF file states.

    \b
    Example:
      vrsopt export doe.db --out doe.csv
    """
    if out.suffix not in (".nc", ".csv"):
        raise InputError(f"{out}: a name that ends in .nc or .csv")
    check_file(out)
    from vrsopt.surrogate.database import Database

    with Database.open(design) as database:
        if out.suffix == ".nc":
            database.to_netcdf(out)
        else:
            database.to_csv(out)
        print(f"{out}: {len(database.status())} points")


def add_points(
    design: Annotated[Path, typer.Argument(help="Design of experiments, written by vrsopt sample; it is added to.")],
    points: Annotated[Path, typer.Argument(help="Points (CSV): a column for each input, SI units, as vrsopt export.")],
    workers: Annotated[int, count("Processes; the points do not depend on it.")] = 2,
) -> None:
    """Compute points of your own and add them to a design of experiments.

    Other columns of an export are left aside, and points that are there already are skipped, so an export with lines
    added to it can be fed back.

    \b
    Example: a file points.csv with the line mass,altitude,speed,rotor_speed,twist and one line for each point
      vrsopt add-points doe.db points.csv
    """
    from vrsopt.surrogate.database import Database
    from vrsopt.surrogate.design import add_points as added
    from vrsopt.surrogate.design_table import read_points

    with Database.open(design) as database:
        inputs = read_points(points, database.meta)
    print(added(design, inputs, workers=workers, progress=sys.stderr.isatty()))


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
) -> None:
    """Fit a surrogate to a design of experiments.

    A Kriging of every output on the flyable points; prints the leave-one-out figures, beside those of fits on all
    converged points.

    \b
    Example: the shipped surrogate once more; one with gradients
      vrsopt fit doe.db --out surrogate.nc
      vrsopt fit doe.db --out surrogate.nc --gradient-enhanced --samples 300
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
        progress=sys.stderr.isatty(),
    )
    if as_json:
        print_json(result.as_dict())
    else:
        print(result)
