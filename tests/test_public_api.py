"""The public names: complete, documented, loaded when used, and not hidden by a module of the same name."""

import importlib
import inspect
import pkgutil
import re
import subprocess
import sys

import pytest

import vrsopt

VERBS = ("trim", "physics_optimum", "engine", "sample", "add_points", "fit", "solve", "envelope")
FUNCTIONS = (*VERBS, "load_aircraft", "load_engine", "load_surrogate", "load_trajectory", "read_mission")


def modules() -> list[str]:
    return [module.name for module in pkgutil.walk_packages(vrsopt.__path__, "vrsopt.")]


def python(code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout


def test_importing_loads_nothing_heavy():
    shown = python("import vrsopt, sys; print(*sys.modules)").split()
    assert not {"casadi", "numpy", "matplotlib", "pymoo", "sklearn", "xarray", "rich", "typer"} & set(shown)


def test_importing_takes_less_than_half_a_second():
    code = "import time; begin = time.perf_counter(); import vrsopt; print(time.perf_counter() - begin)"
    assert min(float(python(code)) for _ in range(2)) < 0.5


def test_the_physics_verbs_need_neither_plots_nor_searches():
    shown = python("import vrsopt, sys; vrsopt.engine(2e5); vrsopt.trim; print(*sys.modules)").split()
    assert not {"matplotlib", "pymoo", "sklearn", "xarray"} & set(shown)


def test_verbs_survive_the_import_of_every_module():
    code = (
        "import importlib, inspect, pkgutil, vrsopt\n"
        "for found in pkgutil.walk_packages(vrsopt.__path__, 'vrsopt.'): importlib.import_module(found.name)\n"
        f"print(*(inspect.isfunction(getattr(vrsopt, name)) for name in {FUNCTIONS!r}))"
    )
    assert set(python(code).split()) == {"True"}


def test_no_module_has_a_public_name():
    names = [name.rpartition(".")[2] for name in modules()]
    assert "operating_point" in names
    assert not set(names) & set(vrsopt.__all__)


@pytest.mark.parametrize("name", modules())
def test_every_module_says_what_it_is(name):
    assert importlib.import_module(name).__doc__.strip()


def test_every_public_name_is_there_and_listed():
    assert set(vrsopt.__all__) <= set(dir(vrsopt))
    assert vrsopt.__all__ == sorted(vrsopt.__all__)
    for name in vrsopt.__all__:
        assert inspect.getdoc(getattr(vrsopt, name)), name


def test_star_import_gives_the_verbs():
    namespace: dict[str, object] = {}
    exec("from vrsopt import *", namespace)  # the statement is what is tested
    assert namespace["trim"] is vrsopt.trim


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'vrsopt' has no attribute 'trimm'"):
        vrsopt.trimm  # noqa: B018


def test_version_is_that_of_the_package():
    from importlib.metadata import version

    assert vrsopt.__version__ == version("vrsopt")
    assert "__version__" in dir(vrsopt)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_unknown_keyword_is_rejected(name):
    with pytest.raises(TypeError, match="unexpected keyword argument 'rotorspeed'"):
        getattr(vrsopt, name)(rotorspeed=40.0)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_at_most_two_positional_arguments(name):
    kinds = [parameter.kind for parameter in inspect.signature(getattr(vrsopt, name)).parameters.values()]
    assert kinds.count(inspect.Parameter.POSITIONAL_OR_KEYWORD) <= 2
    assert set(kinds) <= {inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY}


@pytest.mark.parametrize("name", VERBS)
def test_docstring_names_every_argument(name):
    function = getattr(vrsopt, name)
    text = re.sub(r"[-_\s]+", " ", inspect.getdoc(function)).lower()
    missing = {word for word in inspect.signature(function).parameters if word.replace("_", " ") not in text}
    assert not missing


def test_package_docstring_names_the_verbs():
    for name in VERBS:
        assert f"``{name}``" in vrsopt.__doc__
