"""Docstrings: all that is public has one; what users call says what each argument is, with its unit.

Of the other functions every argument is named in the docstring of the function or of its module, unless the glossary of
the package's docstring has it, its type is a class that says what it is, or it is an option of the command line.
"""

import dataclasses
import importlib
import inspect
import pkgutil
import re
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import pytest
from pydantic import BaseModel

import vrsopt

pytestmark = pytest.mark.slow
MODULES = [name for _, name, _ in pkgutil.walk_packages(vrsopt.__path__, "vrsopt.") if not name.endswith("__main__")]
# Names that mean the same everywhere, from the package's docstring: ``name`` (meaning [unit])
GLOSSARY = dict(re.findall(r"``(\w+)``\s\(([^)]*)\)", vrsopt.__doc__))
UNIT_IN_NAME = re.compile(r"_(w|k|s|m|m_s|kg|kg_s|g_kg|kg_kwh|deg|percent)$")
CONTAINERS = {
    "Any",
    "Array",
    "ArrayLike",
    "Callable",
    "Collection",
    "Iterable",
    "Mapping",
    "NDArray",
    "None",
    "Sequence",
}
OPTION = re.compile(r"help=|number\(|count\(|^(AsJson|Quiet|Altitude|IsaOffset)$")
RESULT = {"success", "status", "message"}  # of every result, says the package's docstring


def own(module: ModuleType) -> Iterator[tuple[str, Any]]:
    """Public functions and classes that ``module`` defines."""
    for name, found in vars(module).items():
        ours = inspect.isclass(found) or inspect.isfunction(found)
        if ours and not name.startswith("_") and found.__module__ == module.__name__:
            yield name, found


def methods(kind: type) -> Iterator[tuple[str, Any]]:
    """Public methods and properties that a class defines, as functions."""
    for name, found in vars(kind).items():
        function = getattr(found, "__func__", found)
        function = getattr(function, "fget", None) or getattr(function, "func", function)
        if not name.startswith("_") and inspect.isfunction(function) and function.__module__ == kind.__module__:
            yield name, function


@pytest.mark.parametrize("name", MODULES)
def test_all_that_is_public_has_a_docstring(name):
    bare = []
    for word, found in own(importlib.import_module(name)):
        made_up = dataclasses.is_dataclass(found) and (found.__doc__ or "").startswith(f"{word}(")
        if not found.__doc__ or made_up:
            bare.append(word)
        if inspect.isclass(found):
            bare += [f"{word}.{one}" for one, _ in methods(found) if not inspect.getdoc(getattr(found, one, None))]
    assert not bare


@pytest.mark.parametrize("name", MODULES)
def test_functions_name_the_arguments_that_their_types_do_not_explain(name):
    module = importlib.import_module(name)
    unnamed = [
        f"{word}({argument})"
        for word, found in own(module)
        if inspect.isfunction(found)
        for argument, kind in arguments(found).items()
        if not (named(argument, f"{found.__doc__} {module.__doc__}") or typed(kind) or OPTION.search(kind))
    ]
    assert not unnamed


def named(argument: str, text: str) -> bool:
    """Whether ``text`` has the words of an argument's name, in the plural too: "lower and upper bound"."""
    words = re.sub(r"[^a-z0-9]+", " ", text.lower())
    return re.search(rf"\b{argument.lower().replace('_', ' ').strip()}(s|es)?\b", words) is not None


def typed(kind: str) -> bool:
    """Whether a type names a class, which has a docstring of its own, or the words that are allowed."""
    return "Literal[" in kind or bool(set(re.findall(r"\b[A-Z][a-z]\w+", kind)) - CONTAINERS)


def callables(name: str) -> dict[str, tuple[Any, str]]:
    """A public function, or the methods of a public class and what makes it, each with its text."""
    one = getattr(vrsopt, name)
    if inspect.isfunction(one):
        return {name: (one, one.__doc__)}
    about = " ".join(kind.__doc__ or "" for kind in one.__mro__ if kind.__module__.startswith("vrsopt"))
    found = {word: (method, f"{about} {inspect.getdoc(getattr(one, word))}") for word, method in methods(one)}
    if not issubclass(one, BaseModel | Exception | vrsopt.Status):
        found[name] = one, f"{about} {one.__init__.__doc__ if '__init__' in vars(one) else ''}"
    return found


@pytest.mark.parametrize("name", vrsopt.__all__)
def test_every_argument_is_explained(name):
    for word, (found, text) in callables(name).items():
        missing = [one for one in arguments(found) if not re.search(rf"\b{re.escape(one)}\b", text)]
        assert not missing, word


@pytest.mark.parametrize("name", vrsopt.__all__)
def test_every_quantity_has_its_unit(name):
    for word, (found, text) in callables(name).items():
        numbers = [one for one, kind in arguments(found).items() if re.search(r"\bfloat\b|Array|ndarray", kind)]
        named_with_unit = [one for one in numbers if re.search(rf"\b{one}\b[^\[]{{0,200}}\[", text)]
        assert not [one for one in numbers if one not in named_with_unit and not UNIT_IN_NAME.search(one)], word


def arguments(found: Any) -> dict[str, str]:
    """Names of what is given to a function, or makes a class, and their types; without those of the glossary."""
    given = {word: str(one.annotation) for word, one in inspect.signature(found).parameters.items()}
    return {
        word: kind
        for word, kind in given.items()
        if word not in GLOSSARY and word not in ("self", "cls") and not (inspect.isclass(found) and word in RESULT)
    }


def test_overview_has_every_public_name_and_names_modules_that_exist():
    assert not [name for name in vrsopt.__all__ if f"``{name}``" not in vrsopt.__doc__]
    for name in re.findall(r"``(vrsopt\.[\w.]+)``", vrsopt.__doc__):
        importlib.import_module(name)


def test_glossary_has_units():
    assert len(GLOSSARY) > 10
    assert [name for name, meaning in GLOSSARY.items() if "[" not in meaning] == ["workers", "progress"]
