"""Files of flown tracks: text tables (CSV) and GPX."""

from __future__ import annotations

import re
from pathlib import Path

from vrsopt.errors import InputError
from vrsopt.mission.track_csv import parse_csv
from vrsopt.mission.track_data import Track
from vrsopt.mission.track_gpx import parse_gpx

LARGEST = 200_000_000  # bytes
TABLES = (".csv", ".txt", ".tsv")
SUFFIXES = (*TABLES, ".gpx")
NOT_TEXT = re.compile(r"[^\t\n\v\f\r\x20-\U0010ffff]")
MARKS = ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))


def read_track(path: str | Path) -> Track:
    """The track in a file: GPX, or a table with the columns time, latitude, longitude and altitude.

    Ground speed, course, and whether it stood on the ground are read where the table has them. Units are taken from the
    names of the columns; :attr:`Track.notes` say what was assumed where they name none, and what was left out. Heights
    are taken as pressure altitude, whatever the receiver meant.

    Raises :class:`InputError` (file, line or field, value, what is allowed) for what can not be used.
    """
    path = Path(path)
    content = read_bytes(path)
    text = _decoded(content, str(path))
    if path.suffix.lower() == ".gpx" or (path.suffix.lower() not in TABLES and text.lstrip().startswith("<")):
        return parse_gpx(text, where=str(path), name=path.stem)
    if text.lstrip().startswith("<"):
        raise InputError(f"{path}: line 1: '<': allowed: a table; an XML file has to be GPX and be called .gpx")
    return parse_csv(text, where=str(path), name=path.stem)


def read_text(path: str | Path) -> str:
    """The text of a file as this program reads it, whatever its encoding; raises :class:`InputError`."""
    return _decoded(read_bytes(Path(path)), str(path))


def read_bytes(path: Path) -> bytes:
    """The content of a file that is there, is not empty and not too large; raises :class:`InputError`."""
    problem, content = "", b""
    try:
        size = path.stat().st_size
        if path.is_dir():
            problem = "can not be read: it is a folder"
        elif size > LARGEST:
            problem = f"{size} bytes: allowed: at most {LARGEST}"
        else:
            content = path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: can not be read: {getattr(error, 'strerror', None) or error}") from None
    if problem:
        raise InputError(f"{path}: {problem}")
    if not content.strip():
        raise InputError(f"{path}: empty: allowed: a flown track, CSV or GPX")
    return content


def _decoded(content: bytes, where: str) -> str:
    """The text: by its mark, as UTF-8, or as Latin-1, which loggers write in names."""
    encodings = [encoding for mark, encoding in MARKS if content.startswith(mark)] or ["utf-8", "latin-1"]
    for encoding in encodings:
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        if found := NOT_TEXT.search(text):
            line = text.count("\n", 0, found.start()) + 1
            raise InputError(f"{where}: line {line}: {found[0]!r}: not text, allowed: CSV or GPX")
        return text
    raise InputError(f"{where}: not text in {encodings[0]}: allowed: CSV or GPX")
