"""What is wrong with a mission file, in one line: field, value, what is allowed."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from typing import Any, TypeAlias

from pydantic import ValidationError

from vrsopt.mission.field import Table
from vrsopt.mission.task_types import KINDS, PATTERNS

Location: TypeAlias = "tuple[int | str, ...]"  # of pydantic's


def first_line(error: ValidationError, model_at: Callable[[Location], type[Table]]) -> str:
    """The first complaint as ``field = value: what is allowed``; ``model_at``: the model of the table at a location."""
    item, *others = error.errors(include_url=False)
    where = tuple(part for part in item["loc"] if part != "[key]")  # pydantic's mark of a bad name
    kind, context = item["type"], item.get("ctx", {})
    model = model_at(where[:-1] if kind in ("missing", "extra_forbidden") else where)
    if kind == "missing":
        unknown = [other["loc"] for other in others if other["type"] == "extra_forbidden"]
        beside = [at[-1] for at in unknown if at[:-1] == item["loc"][:-1]]  # it may be misspelled
        return f"{_field(where)}: missing" + (f"; unknown key beside it: {_shown(beside[0])}" if beside else "")
    if kind == "extra_forbidden":
        return f"{_field(where)} = {_shown(item['input'])}: unknown key, allowed: {', '.join(model.model_fields)}"
    if kind in ("union_tag_not_found", "union_tag_invalid"):
        return f"{_field(where)}{_untyped(item['input'])}"
    if kind == "complaint":
        field, value = ".".join(filter(None, (_field(where), context["field"]))), context["value"]
        return f"{field}: missing, {item['msg']}" if value is None else f"{field} = {_shown(value)}: {item['msg']}"
    return f"{_field(where)} = {_shown(item['input'])}: {_allowed(kind, item['msg'])}"


def _untyped(value: Any) -> str:
    """What is wrong with a task whose type is not known."""
    if not isinstance(value, dict):
        return f" = {_shown(value)}: allowed: a table"
    if "kind" not in value:
        return f".kind: missing, allowed: {', '.join(KINDS)}"
    if value["kind"] not in KINDS:
        return f".kind = {_shown(value['kind'])}: allowed: {', '.join(KINDS)}"
    return f".pattern = {_shown(value.get('pattern'))}: allowed: {', '.join(PATTERNS[value['kind']])}"


def _allowed(kind: str, message: str) -> str:
    """What pydantic's own complaints mean to someone who writes a TOML file."""
    words = {
        "model_type": "allowed: a table",
        "model_attributes_type": "allowed: a table",
        "dict_type": "allowed: a table",
        "tuple_type": "allowed: a list",
        "string_type": "allowed: a text",
        "string_too_short": "allowed: a text that is not empty",
        "too_short": "allowed: at least one entry",
        "too_long": "allowed: two numbers, [lower, upper]",
    }
    return words.get(kind, message.removeprefix("Value error, ").replace("Input should be", "allowed:"))


def _field(where: Location) -> str:
    """A location as a reader of the file would write it: ``tasks[3].speed_m_s``."""
    if where[:1] == ("tasks",):
        where = where[:2] + where[3:]  # pydantic puts the kind of the task after its index
    text = ""
    for part in where:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            bare = part if re.fullmatch(r"[A-Za-z0-9_-]+", part) else json.dumps(part)
            text += f".{bare}" if text else bare
    return text


def _shown(value: Any) -> str:
    """A value in a message: one line, not too long."""
    try:
        text = repr(value)
    except ValueError:  # an integer too long to print in decimal
        text = "(a number of thousands of digits)"
    return text if len(text) <= 60 else text[:57] + "..."
