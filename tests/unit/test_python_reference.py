"""The public interface and the page that describes it agree."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module

import pytest

from scripts.python_reference import MODULES, PAGE, page


def test_the_page_is_what_docstrings_and_examples_say() -> None:
    assert PAGE.read_text("utf-8") == page(), "run `python -m scripts.python_reference`"


@pytest.mark.parametrize("module", (*MODULES, "vistel.implicit"))
def test_what_is_public_is_there_and_documented(module: str) -> None:
    public = import_module(module)
    for name in public.__all__:
        value = getattr(public, name)
        assert isinstance(value, (int, float, str, list, tuple, dict)) or value.__doc__, f"{module}.{name}"


def test_importing_the_package_alone_loads_no_mathematics() -> None:
    code = "import sys, vistel; print(sorted({'numpy', 'numba', 'scipy', 'zenoh'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
