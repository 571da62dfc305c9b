"""A mission file to begin with: every key explained, ready to be solved as it is."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from vrsopt.errors import InputError

TEMPLATE = "mission_template.toml"


def write_template(path: Path) -> None:
    """Write the template of a mission to ``path``, a name that ends in .toml.

    Raises :class:`InputError` for another name, a file that is there already, and a place that can not be written to.
    """
    if path.suffix != ".toml":
        raise InputError(f"{path}: a name that ends in .toml")
    text = (resources.files("vrsopt") / "data" / TEMPLATE).read_text(encoding="utf-8")
    try:
        with path.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise InputError(f"{path}: exists already: name another file") from None
    except OSError as error:
        raise InputError(f"{path}: can not be written: {error.strerror}") from None
