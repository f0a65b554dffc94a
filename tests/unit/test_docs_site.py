"""The documentation becomes a site: every page is in it, every link leads somewhere, and nothing comes from elsewhere."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("material", reason="mkdocs_material is not installed")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--site-dir", str(folder)]
    done = subprocess.run(
        command, cwd=ROOT, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"}, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    return folder


def test_every_page_is_in_the_site_and_in_its_navigation(site: Path) -> None:
    start = (site / "index.html").read_text("utf-8")
    for page in (ROOT / "docs").rglob("*.md"):
        path = page.relative_to(ROOT / "docs").with_suffix(".html").as_posix().replace("README", "index")
        assert (site / path).is_file(), path
        assert f'href="{path}"' in start or path == "index.html", path


def test_files_beside_the_docs_that_pages_link_to_are_in_the_site(site: Path) -> None:
    reference = (site / "reference/python.html").read_text("utf-8")
    assert 'href="../source/examples/01_open_a_log.py.txt"' in reference
    assert (site / "source/examples/01_open_a_log.py.txt").read_bytes() == (ROOT / "examples/01_open_a_log.py").read_bytes()


def test_no_page_of_the_site_fetches_anything_from_elsewhere(site: Path) -> None:
    for page in site.rglob("*.html"):
        fetched = re.findall(
            r"<(?:script|img|iframe|link)[^>]* (?:src|href)=\"?https?:[^ >]+|https?://[^/ \"]*(?:unpkg|jsdelivr)",
            page.read_text("utf-8"),
        )
        assert fetched == [], page
