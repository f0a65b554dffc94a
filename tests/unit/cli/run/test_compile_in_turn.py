"""Processes that compile side by side do not compile the same kernel twice."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

_KERNELS = """
from numba import njit
from vistel_cli.run.compile_in_turn import compile_in_turn

@njit(cache=True)
def called(x):
    return x + 1

@njit(cache=True)
def calling(x):
    return called(x) * 2
"""
_PROGRAM = "import kernels; kernels.compile_in_turn(lambda: print('compiled')); kernels.calling({}); assert kernels.calling(3) == 8"


def test_each_signature_of_a_kernel_is_compiled_by_one_process(tmp_path: Path) -> None:
    (tmp_path / "kernels.py").write_text(_KERNELS)
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}

    def begun(argument: str) -> subprocess.Popen[str]:
        program = (sys.executable, "-c", _PROGRAM.format(argument))
        return subprocess.Popen(program, env=environment, stdout=subprocess.PIPE, text=True)

    side_by_side = [begun("3"), begun("3"), begun("3.0")]
    said = "".join(process.communicate()[0] for process in side_by_side)
    assert [process.returncode for process in side_by_side] == [0, 0, 0]
    assert said.count("compiled") == 4  # two kernels, for whole and for other numbers
    again = begun("3.0")
    assert again.communicate()[0] == ""
