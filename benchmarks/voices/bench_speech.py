"""Spoken commands: right, believed, false accepts, how soon, and what listening costs; Japanese and English."""

from collections.abc import Iterator

from benchmarks.row import Row
from benchmarks.voices import speech_english, speech_japanese


def run() -> Iterator[Row]:
    """Rows as they come; each language where its synthesisers and its model are here."""
    yield from speech_japanese.rows()
    yield from speech_english.rows()
