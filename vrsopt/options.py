"""Options of the command line that several sub-commands have, and how a number is typed."""

from __future__ import annotations

from typing import Annotated, Any

import typer


def number(text: str, **settings: Any) -> Any:
    """An option that takes a number; ``text`` is its help."""
    return typer.Option(help=text, parser=_number, metavar="NUMBER", **settings)


def count(text: str, **settings: Any) -> Any:
    """An option that takes a whole number; ``text`` is its help."""
    return typer.Option(help=text, parser=_whole_number, metavar="COUNT", **settings)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not a number") from None


def _whole_number(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not a whole number") from None


AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output and nothing else.")]
Altitude = Annotated[float, number("Pressure altitude, m.")]
IsaOffset = Annotated[float, number("Temperature above the standard atmosphere, K.")]
