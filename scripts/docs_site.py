"""What `mkdocs` asks while it makes the documentation into a site (`hooks` in mkdocs.yml).

The pages are written to be read in the repository too: docs/README.md and docs/ja/README.md list them, and some link to files
beside docs/. The site's navigation is read from these lists, and each file that a page links to becomes part of the site.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

SOURCE = "source"
"""Files from beside docs/ are there, as plain text."""
_ROOT = Path(__file__).resolve().parents[1]
_LINK = re.compile(r"\[(?P<title>[^\]]+)\]\((?P<target>[^)#\s]+\.md)\)")
_OUTSIDE = re.compile(r"\]\((?P<target>\.\./[^)#\s]+)(?P<anchor>#[^)\s]*)?\)")


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """The navigation: what the two lists of pages say, part by part."""
    docs = Path(config.docs_dir)
    _, *parts = (docs / "README.md").read_text("utf-8").split("\n## ")
    english = [{part.partition("\n")[0]: _groups(part, Path())} for part in parts]
    japanese = _groups((docs / "ja/README.md").read_text("utf-8"), Path("ja"))
    config.nav = [{"English": [{"VISTEL": "README.md"}, *english]}, {"日本語": [{"VISTEL": "ja/README.md"}, *japanese]}]
    return config


def _groups(part: str, folder: Path) -> list[Any]:
    """The rows of its table with the pages that each names; where there is one, its pages alone."""
    groups = [group for row in part.splitlines() if row.startswith("|") and (group := _group(row, folder))]
    return groups if len(groups) > 1 else [page for group in groups for page in next(iter(group.values()))]


def _group(row: str, folder: Path) -> dict[str, Any]:
    """The pages that a row names, under the row's name; empty where there is none."""
    name, *_, links = (cell.strip("* ") for cell in row.strip("|").split("|"))
    pages = [
        {_first_large(m["title"]): (folder / m["target"]).as_posix()} for m in _LINK.finditer(links) if m["target"][:3] != "../"
    ]
    return {_first_large(name): pages} if pages else {}


def _first_large(text: str) -> str:
    return text[:1].upper() + text[1:]


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Adds what pages link to outside docs/."""
    linked = {path for file in files.documentation_pages() for path in _outside(Path(file.abs_src_path or ""))}
    for path in sorted(linked):
        files.append(File.generated(config, f"{SOURCE}/{path.relative_to(_ROOT).as_posix()}.txt", abs_src_path=str(path)))
    return files


def _outside(page: Path) -> list[Path]:
    """The files outside docs/ that a page links to; of a folder, its page."""
    found = [(page.parent / link["target"]).resolve() for link in _OUTSIDE.finditer(page.read_text("utf-8"))]
    found = [path / "README.md" if path.is_dir() else path for path in found]
    return [path for path in found if path.is_file() and not path.is_relative_to(_ROOT / "docs")]


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Links to files outside docs/ lead to their copies."""
    here = Path(page.file.abs_src_path or "").parent

    def to_copy(link: re.Match[str]) -> str:
        path = (here / link["target"]).resolve()
        path = path / "README.md" if path.is_dir() else path
        if path.is_relative_to(_ROOT / "docs"):
            return link[0]
        up = "../" * (len(Path(page.file.src_uri).parts) - 1)
        return f"]({up}{SOURCE}/{path.relative_to(_ROOT).as_posix()}.txt)"

    return _OUTSIDE.sub(to_copy, markdown)
