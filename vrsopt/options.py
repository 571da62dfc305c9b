"""Options of the command line that several sub-commands have, how a number is typed, how examples are written."""

from __future__ import annotations

import logging
from typing import Annotated, Any

import typer


def number(text: str, **settings: Any) -> Any:
    """An option that takes a number; ``text`` is its help, ``settings`` go to typer."""
    return typer.Option(help=text, parser=_number, metavar="NUMBER", **settings)


def count(text: str, **settings: Any) -> Any:
    """An option that takes a whole number; ``text`` is its help, ``settings`` go to typer."""
    return typer.Option(help=text, parser=_whole_number, metavar="COUNT", **settings)


def examples(*commands: tuple[str, str]) -> str:
    """The end of a help page: each of ``commands`` is what it does and how it is typed, on lines of their own."""
    return "\n".join(["\b", "Examples:", *(f"  {what}:\n    {typed}" for what, typed in commands)])


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


def _silenced(quiet: bool) -> bool:
    if quiet:
        logging.getLogger("vrsopt").setLevel(logging.ERROR)
    return quiet


AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output and nothing else.")]
Quiet = Annotated[
    bool, typer.Option("--quiet", "-q", callback=_silenced, help="Print results and errors only, and no progress.")
]
Altitude = Annotated[float, number("Pressure altitude, m.")]
IsaOffset = Annotated[float, number("Temperature above the standard atmosphere, K.")]
