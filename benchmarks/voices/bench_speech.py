"""Spoken commands in Japanese and English: how many are understood, false ones, how soon, and at what cost."""

from collections.abc import Iterator

from benchmarks.hearing import rows as hearing
from benchmarks.row import Row
from benchmarks.voices import speech_enrolment


def run() -> Iterator[Row]:
    """Rows as they come; each language where its synthesisers and its model are here."""
    yield from hearing.rows("ja")
    yield from hearing.rows("en")
    yield from speech_enrolment.rows()
