"""The files of a result: ``summary.json``, ``result.nc``, ``report.html``, the flight path, figures; those of a point.

All of them are made in a hidden folder first and moved to their places at the end: whatever fails on the way leaves
nothing half written, and files of other names are never touched.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vrsopt.errors import InputError
from vrsopt.report.dataset import netcdf, read_result, result_dataset
from vrsopt.report.envelope_plots import envelope_figures
from vrsopt.report.geojson import flight_path_geojson
from vrsopt.report.json_value import json_value
from vrsopt.report.kml import flight_path_kml
from vrsopt.report.page import report_page
from vrsopt.report.plots import figures, png
from vrsopt.report.rotor_plots import point_figures
from vrsopt.rotor_fields import rotor_map

if TYPE_CHECKING:
    from vrsopt.envelope_map import Envelope
    from vrsopt.operating_point import OperatingPoint
    from vrsopt.schedule.comparison import Comparison

__all__ = ["read_result", "write_envelope", "write_point", "write_results"]

LONG = "mission_text"  # attribute that the page shows on its own


def write_results(comparison: Comparison, folder: Path | str, *, mission_text: str) -> list[Path]:
    """Write all files of ``comparison`` into ``folder``, made if need be; returns their paths.

    ``mission_text``: the input as the user gave it. The variants' figures, ``result.nc`` and flight paths go into
    folders of the variants' names. Files of a former result are replaced.

    Raises :class:`InputError` (one line) for a folder that can not be used.
    """
    return _write(Path(folder), lambda: _contents(comparison, mission_text))


def write_point(point: OperatingPoint, folder: Path | str) -> list[Path]:
    """Write the figures of a trimmed point and its ``rotor_map.nc`` into ``folder``; returns their paths.

    Raises :class:`InputError` (one line) for a folder that can not be used or a point without trim.
    """

    def contents() -> dict[str, bytes]:
        pictures = {f"{name}.png": png(figure) for name, figure in point_figures(point).items()}
        return pictures | {"rotor_map.nc": netcdf(rotor_map(point))}

    return _write(Path(folder), contents)


def write_envelope(found: Envelope, folder: Path | str) -> list[Path]:
    """Write ``envelope.nc``, the summary and the maps of ``found`` into ``folder``; returns their paths.

    Raises :class:`InputError` (one line) for a folder that can not be used.
    """

    def contents() -> dict[str, bytes]:
        pictures = {f"{name}.png": png(figure) for name, figure in envelope_figures(found.dataset).items()}
        return pictures | {"envelope.nc": netcdf(found.dataset), "summary.json": _json(found.summary(), indent=2)}

    return _write(Path(folder), contents)


def _write(target: Path, make: Callable[[], dict[str, bytes]]) -> list[Path]:
    """Make the files and put them all into the folder ``target``, or none."""
    try:
        target.mkdir(parents=True, exist_ok=True)
        contents = make()
        _check_places(target, contents)
        # inside the folder, not beside it: the same file system even where the folder is a mount
        with tempfile.TemporaryDirectory(dir=target, prefix=".vrsopt-") as temporary:
            for name, content in contents.items():
                made = Path(temporary) / name
                made.parent.mkdir(exist_ok=True)
                made.write_bytes(content)
            for name in contents:
                (target / name).parent.mkdir(exist_ok=True)
                os.replace(Path(temporary) / name, target / name)
    except FileExistsError as error:
        raise InputError(f"{error.filename}: is a file: a folder is needed") from None
    except OSError as error:
        raise InputError(f"{target}: can not be written: {error.strerror}") from None
    return [target / name for name in contents]


def _contents(comparison: Comparison, mission_text: str) -> dict[str, bytes]:
    """Every file by its name in the folder."""
    contents: dict[str, bytes] = {}
    pictures: dict[str, dict[str, bytes]] = {}
    attributes: dict[str, Any] = {}
    for key, case in {"": comparison, **comparison.variants}.items():
        place = f"{key}/" if key else ""
        pictures[key] = {name: png(figure) for name, figure in figures(case).items()}
        contents |= {f"{place}{name}.png": picture for name, picture in pictures[key].items()}
        dataset = result_dataset(case, mission_text=mission_text)
        contents[f"{place}result.nc"] = netcdf(dataset)
        contents[f"{place}flight_path.geojson"] = _json(flight_path_geojson(case), indent=None)
        contents[f"{place}flight_path.kml"] = flight_path_kml(case)
        if points := weak_points(case):
            contents[f"{place}weak_points.csv"] = points
        attributes = attributes or {name: value for name, value in dataset.attrs.items() if name != LONG}
    page = report_page(comparison, pictures=pictures, mission_text=mission_text, record=attributes)
    contents["report.html"] = page.encode()
    contents["summary.json"] = _json(comparison.summary(), indent=2)
    return contents


def weak_points(comparison: Comparison) -> bytes:
    """CSV for ``vrsopt add-points``: the points whose computation would help the surrogate most along the schedules.

    SI units, under the names of the surrogate's inputs; empty if no schedule knows what it relies on.
    """
    reliances = [result.reliance for result in comparison.results.values() if result.reliance is not None]
    rows = {tuple(row): None for reliance in reliances for row in reliance["weak_point"].values.tolist()}
    lines = [",".join(reliances[0]["input"].values)] if reliances else []
    return "".join(f"{line}\n" for line in [*lines, *(",".join(map(repr, row)) for row in rows)]).encode()


def _json(content: dict[str, Any], *, indent: int | None) -> bytes:
    text = json.dumps(json_value(content), indent=indent, allow_nan=False, ensure_ascii=False)
    return f"{text}\n".encode()


def _check_places(target: Path, contents: dict[str, bytes]) -> None:
    """Refuse before anything is moved what would fail half-way: a folder in the place of a file."""
    for name in contents:
        if (target / name).is_dir():
            raise InputError(f"{target / name}: is a folder: the place of a file of the result")
        if (target / name).parent.is_file():
            raise InputError(f"{(target / name).parent}: is a file: a folder is needed")
