"""RNNoise takes noise out of a stream however it is cut; where it is not installed, English is heard as without it."""

from __future__ import annotations

import logging
from collections.abc import Iterator

import numpy as np
import pytest

from vistel.speech.engines import rnnoise
from vistel.speech.engines.engine import EngineError
from vistel.speech.engines.rnnoise import FRAME, RnNoise
from vistel.speech.english import EnglishRecogniser
from vistel.speech.grammar_file import load_grammar
from vistel.speech.recognition import SAMPLE_RATE


def _installed() -> bool:
    try:
        rnnoise.library()
    except EngineError:
        return False
    return True


@pytest.fixture
def missing(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    rnnoise.library.cache_clear()
    find = rnnoise.importlib.util.find_spec
    monkeypatch.setattr(rnnoise.importlib.util, "find_spec", lambda name: None if name == "pyrnnoise" else find(name))
    yield
    rnnoise.library.cache_clear()


@pytest.mark.skipif(not _installed(), reason=f"pip install --no-deps {rnnoise.PACKAGE}")
def test_noise_goes_and_what_comes_out_does_not_depend_on_how_the_stream_is_cut() -> None:
    noise = (0.02 * np.random.default_rng(1).standard_normal(300 * FRAME)).astype(np.float32)
    whole = RnNoise().feed(noise)
    assert whole.shape == noise.shape
    stream = RnNoise()
    parts = [stream.feed(noise[at : at + 3 * FRAME]) for at in range(0, len(noise), 3 * FRAME)]
    np.testing.assert_array_equal(np.concatenate(parts), whole)
    assert whole[SAMPLE_RATE:].std() < 0.2 * noise.std()


def test_where_it_is_missing_one_line_says_so_and_english_is_heard_all_the_same(
    missing: None, caplog: pytest.LogCaptureFixture
) -> None:
    pytest.importorskip("pocketsphinx")
    with pytest.raises(EngineError, match=r"^RNNoise is not installed; .* pip install --no-deps pyrnnoise==\d"):
        RnNoise()
    with caplog.at_level(logging.INFO, "vistel.speech"):
        hears = EnglishRecogniser(load_grammar()[0])
    assert [r.getMessage() for r in caplog.records if "no_rnnoise" in r.getMessage()] != []
    assert hears.feed(np.zeros(SAMPLE_RATE, np.float32)) == []
