"""Speech of synthetic voices with the times of its visemes: what the net is made from, and what it is judged by.

The synthesiser tells the times where it can; elsewhere the nets that understand commands find them (`vistel/speech/data`), which
hear far more of the sound than a mouth can wait for. Three sets, disjoint by voice and sentence: the net is made on `tune`, its
settings are chosen by `choose`, and `report` is scored once.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.hearing import sets
from scripts.speech_model import corpus, english, japanese
from scripts.speech_model.align import aligned
from scripts.speech_model.corpus import Corpus, seeded
from scripts.speech_model.texts import training_texts
from scripts.speech_model.voices import Spoken, drawn, espeak, flite_timed, hts_voices, open_jtalk
from vistel.speech.acoustic import packaged

_PHONES = {
    "sil": "pau cl",
    "PP": "P B M p b m by py my",
    "FF": "F V",
    "TH": "TH DH",
    "DD": "T D t d r ry",
    "kk": "K G HH NG k g h ky gy",
    "CH": "CH JH SH ZH sh j ch",
    "SS": "S Z s z ts",
    "nn": "N L n ny",
    "RR": "R ER",
    "aa": "AA AH AY AW a",
    "E": "EH AE EY e",
    "ih": "IH IY Y i y hy",
    "oh": "AO OW OY o",
    "ou": "UW UH W u w f",
}
"""Of English in capitals, as CMU's dictionary has them, of Japanese in small letters. "N" is the nasal of both."""
_VISEME = {phone: viseme for viseme, phones in _PHONES.items() for phone in phones.split()}
_PACKS = {
    english.ENGLISH: (("rms", 2), ("kal16", 1), ("pico_us", 1), ("pico_gb", 1), ("espeak", 4)),
    japanese.JAPANESE: (("espeak", 4),),
}
"""How many packs of a hundred sentences of each voice `tune` has."""
_FLITE = {"choose": "awb", "report": "slt"}
_SENTENCES = 40
"""Of a language in `choose` and in `report`."""


def visemes_of(spoken: Spoken) -> Spoken:
    """The same sound with visemes for phones."""
    return replace(spoken, phones=tuple(_VISEME[phone] for phone in spoken.phones))


def tune(folder: Path, seed: int) -> dict[str, list[Spoken]]:
    """By voice and pack, kept in `folder`; without what no net finds the times of."""
    said: dict[str, list[Spoken]] = {}
    for language, voices in _PACKS.items():
        for voice, count in voices:
            for number in range(count):
                name = f"{language.name}.{voice}.{number}"
                said[name] = [visemes_of(each) for each in _pack(language, voice, number, seed, folder / f"{name}.npz")]
                print(f"{name}: {len(said[name])} sentences", flush=True)
    return said


def _pack(language: Corpus, voice: str, number: int, seed: int, kept: Path) -> list[Spoken]:
    if not kept.is_file():
        corpus.save_pack(kept, language.say(voice, number, seed, kept.parent), language.phones)
    said = corpus.load_pack(kept, language.phones)
    model = packaged(language.name)
    return [each for s in said if (each := s if s.ends_s is not None else aligned(model, s)) is not None]


def held_out(name: str) -> Iterator[tuple[str, Spoken]]:
    """The voice and what it says, of the set `choose` or `report`: everyday English by a voice of flite, Japanese by one of
    espeak-ng or, for `report`, by Open JTalk's "mei". No sentence of English is in another set."""
    random = seeded("visemes", name)
    talk = {"choose": sets.choose, "report": sets.report}[name]().talk["en"]
    for _ in range(_SENTENCES):
        sound, ends = flite_timed(talk.sentence(random).lower(), _FLITE[name], float(random.uniform(0.85, 1.2)))
        phones = tuple(english.FLITE_NAMES.get(phone, phone.upper()) for phone, _ in ends)
        yield f"flite {_FLITE[name]}", visemes_of(Spoken(sound, phones, np.array([end for _, end in ends])))
    texts = training_texts(random)
    for k in range(_SENTENCES):
        text = next(texts)
        if name == "report":
            yield "Open JTalk mei", visemes_of(open_jtalk(text, hts_voices()["mei_normal"], drawn(random)))
            continue
        phones, kana = japanese.reading_of(text)
        voice = japanese.ESPEAK_TEST[k % len(japanese.ESPEAK_TEST)]
        found = aligned(packaged("japanese"), Spoken(espeak(kana, f"ja+{voice}", 150, 50), phones, None))
        if found is not None:
            yield f"espeak-ng {voice}", visemes_of(found)
