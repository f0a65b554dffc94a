"""A compiled kernel is current only as long as nothing that it is made of has changed."""

import os
import pickle
import subprocess
import sys
from pathlib import Path

from vistel.jit.kernel_jit import imported_files, stamp_of


def project(root: Path, **files: str) -> None:
    for name, text in files.items():
        path = root.joinpath(*name.split("__")).with_suffix(".py")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


def test_imports_of_modules_of_names_and_over_several_lines_are_found(tmp_path):
    project(tmp_path, vistel__a="", vistel__b__c="", vistel__b__d="", vistel__e="", vistel__b__f="")
    source = "import numpy\nimport vistel.a\nfrom vistel.b import c as see, d\nfrom vistel.e import (\n    one,\n)\n# vistel.b.f\n"
    assert imported_files(source, tmp_path) == {tmp_path / f"vistel/{name}.py" for name in ("a", "b/c", "b/d", "e")}


def test_a_change_behind_two_imports_changes_the_stamp_and_any_other_does_not(tmp_path):
    def stamp(version: str, other: str) -> str:
        root = tmp_path / f"{version}{other}"
        project(
            root,
            vistel__kernel="from vistel.between import x\n",
            vistel__between="from vistel.leaf import x\n",
            vistel__leaf=f"x = {version}\n",
            vistel__other=f"y = {other}\n",
        )
        return stamp_of(root / "vistel/kernel.py", root)

    assert stamp("1", "1") == stamp("1", "2")
    assert stamp("1", "1") != stamp("2", "1")


def test_files_that_import_each_other_have_a_stamp(tmp_path):
    project(tmp_path, vistel__a="from vistel.b import y\n", vistel__b="from vistel.a import x\n")
    assert stamp_of(tmp_path / "vistel/a.py", tmp_path) == stamp_of(tmp_path / "vistel/b.py", tmp_path)


def test_a_cache_that_cannot_be_read_any_more_is_compiled_anew(tmp_path):
    (tmp_path / "kept.py").write_text(
        "from vistel.jit.kernel_jit import compiled\n\n\n@compiled\ndef twice(x):\n    return 2 * x\n"
    )
    run = [sys.executable, "-c", "import kept; print(kept.twice(21), sum(kept.twice.stats.cache_hits.values()))"]
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}

    def answer() -> str:
        return subprocess.run(run, cwd=tmp_path, env=environment, check=True, capture_output=True, text=True).stdout.strip()

    assert [answer(), answer()] == ["42 0", "42 1"]
    (index,) = tmp_path.rglob("*.nbi")
    whole = index.read_bytes()
    version = pickle.dumps(pickle.loads(whole), protocol=-1)
    for damaged in (whole[:-9], version + b"cvistel.gone\nthing\n.", version + b"\x93"):
        index.write_bytes(damaged)
        assert answer() == "42 0", damaged
    assert answer() == "42 1"
