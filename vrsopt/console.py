"""How the command line talks: exit codes, one line for a failure, one JSON object, checks before a long computation."""

from __future__ import annotations

import json
import math
import os
import sys
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from vrsopt.errors import InputError, NoSolutionError
from vrsopt.report.json_value import json_value

if TYPE_CHECKING:
    from vrsopt.operating_point import OperatingPoint
    from vrsopt.schedule.comparison import Comparison
    from vrsopt.turboshaft.performance import EngineResult

BROKEN, BAD_INPUT, NO_SOLUTION, INTERRUPTED = 1, 2, 3, 130
PERCENT, DEGREES, KILO, GRAM = 100.0, 180.0 / math.pi, 1e-3, 1e3  # typed units per unit of the library
NOT_FIGURES = ("status", "message", "residual_norm")  # of an engine: said where it failed
ENGINE_SETTINGS = {  # what is typed: argument of the verb and units per unit of the library
    "power_kw": ("power", KILO),
    "gas_generator_speed_percent": ("gas_generator_speed", PERCENT),
    "turbine_temperature_k": ("inter_turbine_temperature", 1.0),
    "power_turbine_speed_percent": ("power_turbine_speed", PERCENT),
    "humidity_g_kg": ("humidity", GRAM),
    "bleed_percent": ("bleed_fraction", PERCENT),
    "power_offtake_kw": ("power_offtake", KILO),
}
# The parser's error for a wrong option or argument: the base of the one that typer exports.
UsageError: Any = typer.BadParameter.__mro__[1]
REPLACED = "A worker stopped while some jobs"  # said by joblib when it replaces a process that has grown or was idle


def run(app: typer.Typer, words: Sequence[str]) -> int:
    """Exit code of the command line ``words``; whatever a user can cause ends in one line on standard error."""
    warnings.filterwarnings("ignore", REPLACED, UserWarning)  # nothing is lost, and nothing is to be done about it
    try:
        if hasattr(sys.stdout, "reconfigure"):
            sys.stdout.reconfigure(errors="backslashreplace")  # a file name need not be printable
        code = _dispatched(app, words)
        if sys.stdout is not None:
            sys.stdout.flush()
        return code
    except OSError as error:  # standard output can not be written: nothing may be left to write when the process ends
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if isinstance(error, BrokenPipeError):
            return BROKEN  # nobody reads any more: as other programs, without a word
        complain(f"standard output: {error.strerror}")
        return BAD_INPUT


def _dispatched(app: typer.Typer, words: Sequence[str]) -> int:
    try:
        code = typer.main.get_command(app).main(args=list(words), prog_name="vrsopt", standalone_mode=False)
    except UsageError as error:
        command = error.ctx.command_path if error.ctx is not None else "vrsopt"
        where = command.removeprefix("vrsopt").strip()
        said = error.format_message().rstrip(".")
        message = f"{where + ': ' if where else ''}{said}{' See' if said.endswith('?') else '; see'} {command} --help"
        return _failed(BAD_INPUT, message, words)
    except InputError as error:
        return _failed(BAD_INPUT, str(error), words)
    except NoSolutionError as error:
        return _failed(NO_SOLUTION, str(error), words)
    except ImportError as error:  # an incomplete installation, or an interrupt while a compiled module loads
        complain(f"{error.name or 'a module'} can not be loaded: {error}")
        return BROKEN
    except OSError as error:
        if error.filename is None:
            raise
        return _failed(BAD_INPUT, f"{error.filename}: {error.strerror}", words)
    except (KeyboardInterrupt, typer.Abort):
        code = INTERRUPTED
    except SystemError as error:
        if not isinstance(error.__cause__, KeyboardInterrupt):  # so do older versions of CasADi pass an interrupt on
            raise
        code = INTERRUPTED
    except SystemExit as end:  # typer's way to end after completion
        code = end.code
    if code == INTERRUPTED:  # typer may have turned the interrupt into this code
        complain("interrupted")
    return int(code or 0)


def _failed(code: int, message: str, words: Sequence[str]) -> int:
    if "--json" in words:
        print_json({"success": False, "message": " ".join(message.splitlines())})
    complain(message)
    return code


def complain(message: str) -> None:
    """Print ``message`` as one line on standard error."""
    print("vrsopt: " + " ".join(message.splitlines()), file=sys.stderr)


def print_version(wanted: bool) -> None:
    """Print the version of program, model and data, and end, if ``wanted``."""
    if wanted:
        from vrsopt import __version__
        from vrsopt.helicopter import MODEL_VERSION, helicopter

        print(f"vrsopt {__version__}, model {MODEL_VERSION}, data {helicopter().data_hash}")
        raise typer.Exit()


def told(quiet: bool) -> bool:
    """Whether progress is shown: to a reader at a terminal who has not asked for ``quiet``."""
    return not quiet and sys.stderr.isatty()


def print_files(folder: Path | None, files: Sequence[Path], *, quiet: bool) -> None:
    """Print which ``files`` were written into ``folder``, unless none or ``quiet``."""
    if folder is not None and files and not quiet:
        print(f"{folder}: {', '.join(sorted(str(file.relative_to(folder)) for file in files))}")


def print_json(content: Mapping[str, Any]) -> None:
    """Print ``content`` as one JSON object on standard output."""
    print(json.dumps(json_value(content), allow_nan=False))


def point_figures(point: OperatingPoint) -> dict[str, Any]:
    """What ``trim --json`` prints; the keys are the same whether or not the point was solved."""
    from vrsopt.limits import LIMIT_NAMES

    powers, margins = point.powers, point.margins
    controls = ("collective", "lateral_cyclic", "longitudinal_cyclic", "tail_collective", "pitch", "roll")
    hover = point.advance_ratio < 0.01  # elsewhere the figure of merit means nothing
    return {
        "success": point.success,
        "status": str(point.status),
        "message": point.message,
        "residual_norm": point.residual_norm,
        "main_rotor_power_w": point.main_rotor_power,
        "tail_rotor_power_w": point.tail_rotor_power,
        "shaft_power_per_engine_w": point.shaft_power_per_engine,
        "engines_operating": point.engines_operating,
        "fuel_flow_kg_s": point.fuel_flow,
        **{f"{name}_kg_s": getattr(point, name) for name in ("nox", "co2", "co")},
        "nox_range_kg_s": point.nox_range,
        **{f"{name}_index_g_kg": 1e3 * getattr(point, f"{name}_index") for name in ("nox", "co", "co2")},
        **{f"{name}_deg": math.degrees(getattr(point, name)) for name in controls},
        "gas_generator_speed_percent": 100.0 * point.gas_generator_speed,
        "turbine_inlet_temperature_k": point.turbine_inlet_temperature,
        "blade_loading": point.blade_loading,
        "figure_of_merit": point.figure_of_merit if hover else math.nan,
        "feasible": point.feasible,
        "reason": point.reason,
        **{f"{name}_power_w": powers.get(name, math.nan) for name in ("induced", "profile", "parasite", "climb")},
        **{f"margin_{_snake(name)}_percent": 100.0 * margins.get(name, math.nan) for name in LIMIT_NAMES},
        "hub_roll_moment_n_m": point.hub_roll_moment,
        "hub_pitch_moment_n_m": point.hub_pitch_moment,
        "advancing_tip_mach": point.advancing_tip_mach,
        "one_engine_inoperative_margin_w": point.one_engine_inoperative_margin,
        "autorotative_energy_j": point.autorotative_energy,
        "found_by": point.trim.stage if point.trim.success else None,
        "coexisting": point.trim.coexisting,
        "smallest_singular_value": point.trim.smallest_singular_value,
    }


def _snake(words: str) -> str:
    return words.replace(" ", "_")


def engine_figures(result: EngineResult) -> dict[str, Any]:
    """What ``engine --json`` prints."""
    figures = {each.name: getattr(result, each.name) for each in fields(result) if each.name not in NOT_FIGURES}
    return figures if result.success else figures | {"message": result.message}


def engine_demand(
    power_kw: float | None, speed_percent: float | None, temperature_k: float | None, rating: str | None
) -> dict[str, Any]:
    """The one demand on an engine that was typed, in the units of the library, by the name of the verb's argument.

    ``power_kw``, ``speed_percent`` of the gas generator, ``temperature_k`` between the turbines, ``rating`` by name;
    None where nothing was typed. Raises :class:`InputError` for none or several.
    """
    typed = {"power_kw": power_kw, "gas_generator_speed_percent": speed_percent, "turbine_temperature_k": temperature_k}
    given = {name: value for name, value in {**typed, "rating": rating}.items() if value is not None}
    if len(given) != 1:
        options = [f"--{name.replace('_', '-')}" for name in (*typed, "rating")]
        found = " and ".join(f"--{name.replace('_', '-')}" for name in given) or "none"
        raise InputError(f"engine: {found} given: exactly one of {', '.join(options)}; see vrsopt engine --help")
    ((name, value),) = given.items()
    return {name: value} if isinstance(value, str) else engine_settings(**{name: value})


def engine_settings(**typed: float | None) -> dict[str, Any]:
    """Numbers typed for an engine (None: not typed), in the units of the library, by the verb's arguments."""
    from vrsopt.turboshaft.performance import ALLOWED

    settings = {}
    for field, value in typed.items():
        if value is not None:
            name, per = ENGINE_SETTINGS[field]
            settings[name] = converted(f"engine: {field}", value, per=per, allowed=ALLOWED[name])
    return settings


def broken(comparison: Comparison) -> str:
    """The first schedule that failed, why, and the names of the others, and of those that did not."""
    cases = {"": comparison, **{f" ({name})": case for name, case in comparison.variants.items()}}
    failed = {
        f"{name}{case}": result.message
        for case, compared in cases.items()
        for name, result in compared.results.items()
        if not result.success
    }
    (first, message), *others = failed.items()
    also = f"; also not flyable: {', '.join(name for name, _ in others)}" if others else ""
    flyable = [name for name, result in comparison.results.items() if result.success and name != "nominal"]
    return f"{first}: {message}{also}" + (f"; flyable: {', '.join(flyable)}" if flyable else "")


def converted(field: str, value: float, *, per: float, allowed: tuple[float, float]) -> float:
    """``value``, typed in a unit of which ``per`` make one of the library's, in the library's unit.

    ``field``: how the message calls it. Raises :class:`InputError` outside ``allowed`` (library's unit), with the range
    in the unit that was typed, rounded inward to 0.1.
    """
    low, high = (round(bound * per, 9) for bound in allowed)
    low = math.ceil(10 * low) / 10
    words = f"a number of at least {low:g}"
    if math.isfinite(high):
        high = math.floor(10 * high) / 10
        words = f"a number from {low:g} to {high:g}"
    if not (math.isfinite(value) and low <= value <= high):
        raise InputError(f"{field} = {value:g}: {words}")
    return value / per


def check_file(path: Path) -> None:
    """Raises :class:`InputError` unless a file can be written at ``path``."""
    if path.is_dir():
        raise InputError(f"{path}: can not be written: it is a folder")
    if not path.parent.is_dir():
        raise InputError(f"{path}: can not be written: no folder {path.parent}")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise InputError(f"{path}: can not be written: no permission")


def check_asked(mission: Path | None, repeated: Path | None, options: Mapping[str, object]) -> None:
    """Raises InputError unless ``vrsopt solve`` was given a mission, or a result to repeat and none of ``options``."""
    if repeated is None:
        if mission is None:
            raise InputError("solve: mission: missing: a mission file, a flown track, or --from with a result.nc")
        if options["wind_from_deg"] is None and options["wind_speed"] is not None:
            raise InputError(
                f"solve: wind_speed = {options['wind_speed']:g}: allowed with wind_from_deg, where the wind blows from"
            )
        return
    for name, value in {"mission": mission, **options}.items():
        if value is not None:
            raise InputError(f"solve: {name} = {value}: not allowed with --from, the result has its own")


def given(value: str | None, default: str) -> str:
    """An option as typed, empty too, or its default.

    ``value``: None where it was not typed.
    """
    return default if value is None else value


def weights(text: str) -> dict[str, float]:
    """Weights typed as ``fuel=1,nox=30``; raises InputError for what is not of this form.

    ``text``: what was typed.
    """
    found: dict[str, float] = {}
    for part in text.split(","):
        name, _, value = (piece.strip() for piece in part.partition("="))
        try:
            found[name] = float(value)
        except ValueError:
            found[name] = math.nan
        if not math.isfinite(found[name]):
            raise InputError(f"solve: objective = {text!r}: weights like fuel=1,nox=30")
    return found


def check_folder(path: Path) -> None:
    """Raises :class:`InputError` unless ``path`` is a folder that can be written to, or one that can be made."""
    there = next(folder for folder in (path, *path.absolute().parents) if folder.exists())
    if not there.is_dir():
        raise InputError(f"{path}: can not be written: {there} is not a folder")
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError(f"{path}: can not be written: no permission in {there}")
