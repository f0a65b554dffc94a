"""Spoken commands in Japanese and English: how many are understood, false ones, how soon, and at what cost."""

from collections.abc import Iterator

from benchmarks.row import Row
from benchmarks.voices import speech_english, speech_japanese


def run() -> Iterator[Row]:
    """Rows as they come; each language where its synthesisers and its model are here."""
    yield from speech_japanese.rows()
    yield from speech_english.rows()
