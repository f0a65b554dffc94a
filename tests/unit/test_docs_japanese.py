"""Japanese pages show the commands of the English pages they were made from; what they say to the room, it understands."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from vistel.speech.grammar_file import load_grammar
from vistel.speech.meaning import asked_for

ROOT = Path(__file__).resolve().parents[2]
JAPANESE = sorted([*ROOT.glob("README.ja.md"), *ROOT.glob("docs/ja/**/*.md")])
SAID = re.compile(r"「([^」]*)」")


def _name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def _english(japanese: Path) -> Path:
    return ROOT / _name(japanese).replace("README.ja.md", "README.md").replace("docs/ja/", "docs/")


def _code(page: Path) -> list[str]:
    """Lines of a page's code blocks, fenced or indented, with the fences."""
    found: list[str] = []
    fenced = False
    for line in page.read_text("utf-8").splitlines():
        fence = line.strip().startswith("```")
        if line.strip() and (fenced or fence or line.startswith("    ")):
            found.append(line.rstrip())
        fenced ^= fence
    return found


def _untranslated(english: str, japanese: str) -> str:
    """The Japanese line with the English comment, or last column, in place of its own, if all before that is the same."""
    column = re.match(r"(.*(?:# |   ))[^\x00-\x7f]", japanese)
    return english if column and english.startswith(column[1]) else japanese


def _commands(page: Path) -> set[str]:
    return set(re.findall(r"`((?:\.venv/bin/)?vistel [^`]*)`", page.read_text("utf-8")))


def _target(page: Path, language: str) -> Path | None:
    """Where the line below the title leads for another language."""
    found = re.search(rf"\[{language}\]\(([^)]+)\)", page.read_text("utf-8").splitlines()[2])
    return (page.parent / found[1]).resolve() if found else None


@pytest.mark.parametrize("page", JAPANESE, ids=_name)
def test_a_japanese_page_and_its_english_page_lead_to_each_other_below_their_titles(page: Path) -> None:
    assert _target(page, "English") == _english(page)
    assert _target(_english(page), "日本語") == page


@pytest.mark.parametrize("page", JAPANESE, ids=_name)
def test_a_japanese_page_has_the_code_of_its_english_page_in_the_same_order(page: Path) -> None:
    english, japanese = _code(_english(page)), _code(page)
    shared = [_untranslated(e, j) for e, j in zip(english, japanese, strict=False)] + japanese[len(english) :]
    assert shared == english


@pytest.mark.parametrize("page", JAPANESE, ids=_name)
def test_a_japanese_page_names_every_command_that_sentences_of_its_english_page_name(page: Path) -> None:
    assert _commands(_english(page)) - _commands(page) == set()


@pytest.mark.parametrize("changed", ["vistel ask undo --as aiko  # 元に戻す", "vistel ask redo  # 元に戻す", "vistel ask 元に戻す"])
def test_only_a_comment_counts_as_translated(changed: str) -> None:
    assert _untranslated("vistel ask undo  # takes it back", changed) == changed
    assert _untranslated("vistel ask undo  # takes it back", "vistel ask undo  # 元に戻す") == "vistel ask undo  # takes it back"


def test_the_room_understands_all_that_the_pages_say_to_it() -> None:
    grammar = load_grammar()[0].awaited()
    said = {text for page in [*JAPANESE, *map(_english, JAPANESE)] for text in SAID.findall(page.read_text("utf-8"))}
    read = {text: grammar.read(text) for text in said}
    assert {text for text, sentence in read.items() if sentence is None} == set()
    meanings = {text: sentence.means for text, sentence in read.items() if sentence is not None}
    assert {text for text, means in meanings.items() if "do" not in means} == {"コンピュータ"}
    for means in meanings.values():
        if "do" in means:
            asked_for(means)


def test_each_word_of_the_table_of_words_stands_in_the_glossary_and_is_used_on_a_japanese_page() -> None:
    index = ROOT / "docs/ja/README.md"
    pairs = re.findall(r"^\| ([a-z ]+) \| (\S+) \|$", index.read_text("utf-8"), re.MULTILINE)
    glossary = (ROOT / "docs/reference/words.md").read_text("utf-8")
    text = "".join(page.read_text("utf-8") for page in JAPANESE if page != index)
    assert len(pairs) == len({english for english, _ in pairs}) == len({japanese for _, japanese in pairs}) > 0
    assert [english for english, _ in pairs if f"\n| {english} |" not in glossary] == []
    assert [japanese for _, japanese in pairs if japanese not in text] == []
