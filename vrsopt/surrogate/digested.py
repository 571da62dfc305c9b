"""NetCDF files (classic format, 64-bit offsets) with a digest of all their bytes but its own.

The digest tells damage, not intent: whatever is read is to be checked as if a stranger had written it.
"""

from __future__ import annotations

import hashlib
import os
import stat
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import xarray as xr

from vrsopt.errors import InputError
from vrsopt.surrogate import classic_netcdf

NO_DIGEST = "0" * 64  # in place of the digest, while it is computed
MOST_BYTES = 64 * 2**20


@dataclass(frozen=True)
class Format:
    """A kind of file: ``noun`` names it in complaints, ``advice`` says what to do with one of another version."""

    name: str
    version: int
    noun: str
    advice: str


def save(path: Path | str, variables: Mapping[str, Any], attributes: Mapping[str, Any], *, form: Format) -> None:
    """Write variables and attributes as xarray takes them; an existing file is replaced at once or, on an error, not.

    Raises :class:`InputError` if ``path`` can not be written.
    """
    attributes = {"format": form.name, "format_version": form.version, **attributes, "digest": NO_DIGEST}
    content = bytes(xr.Dataset(variables, attrs=attributes).to_netcdf(None, engine="scipy", format="NETCDF3_64BIT"))
    content = content.replace(NO_DIGEST.encode(), hashlib.sha256(content).hexdigest().encode(), 1)
    target = Path(path)
    try:
        descriptor, temporary = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
        try:
            with os.fdopen(descriptor, "wb") as stream:
                stream.write(content)
            os.chmod(temporary, 0o644)
            os.replace(temporary, target)
        finally:
            Path(temporary).unlink(missing_ok=True)
    except OSError as error:
        raise InputError(f"{target}: can not be written: {error.strerror}") from None


def load(
    path: Path, *, form: Format, shown: str
) -> tuple[classic_netcdf.Attributes, dict[str, classic_netcdf.Variable]]:
    """Attributes and variables of the file ``path``, called ``shown`` in complaints.

    Raises :class:`InputError` for a file that is missing, foreign, larger than 64 MiB, damaged or of another version.
    """
    content = _content(path, form)
    try:
        attributes, variables = classic_netcdf.read(content)
    except classic_netcdf.UnreadableError as error:
        raise InputError(f"{shown}: not a {form.noun}, or damaged: {error}") from None
    if str(attributes.get("format")) != form.name:
        raise InputError(f"{shown}: not a {form.noun}: no attribute format = {form.name!r}")
    version = attributes.get("format_version")
    if not isinstance(version, float) or version != form.version:
        found = f"{version:g}" if isinstance(version, float) else "unknown"
        raise InputError(f"{shown}: format version {found}: this program reads {form.version}; {form.advice}")
    digest = str(attributes.get("digest")).encode()
    if hashlib.sha256(content.replace(digest, NO_DIGEST.encode(), 1)).hexdigest().encode() != digest:
        raise InputError(f"{shown}: damaged: its content does not match its digest")
    return attributes, variables


def _content(path: Path, form: Format) -> bytes:
    """The bytes of a file of bounded size; raises :class:`InputError`."""
    try:
        found = path.stat()
        if not stat.S_ISREG(found.st_mode):
            raise InputError(f"{path}: not a {form.noun}: not a file")
        if found.st_size > MOST_BYTES:
            raise InputError(f"{path}: not a {form.noun}: longer than {MOST_BYTES // 2**20} MiB")
        with path.open("rb") as stream:
            return stream.read(found.st_size)
    except OSError as error:
        raise InputError(f"{path}: can not be read: {error.strerror}") from None
