"""Spoken commands of a site in a conference file."""

from pathlib import Path
from typing import Literal, Self

from pydantic import Field, model_validator

from vistel.conference.devices import Checked, Name
from vistel.speech.engines.choice import WITHOUT_MODEL, EngineName

Spoken = Literal["ja", "en"]


class Speech(Checked):
    """What the site's people say to the room. Their microphones are those of [sites.audio]."""

    language: Spoken = "ja"
    languages: dict[Name, Spoken] = Field(default={})
    """By participant, for those who speak another one."""
    listen: Literal["open", "push", "wake"] = "open"
    """open: to all speech; push: while the button is held (`vistel voice talk`); wake: after the wake word
    (「コンピュータ」, "computer"), and for 8 s more after each sentence."""
    grammar: list[Path] = Field(default=[])
    """Files of further words and sentences, beside the conference file."""
    accept: float = Field(default=0.5, gt=0.0, lt=1.0)
    """How sure one has to be of a sentence for it to be done at once; from half of that one is asked back."""
    reply: Literal["spoken", "text", "none"] = "text"
    """How sentences are answered: aloud where espeak-ng is installed and in the picture, or in the picture only."""
    voices: Path | None = None
    """Folder with what `vistel speech enrol` learnt, a file NAME.npz for each participant."""

    engine: EngineName = "own"
    """The engine that recognises those who speak `language`; all but "own" and "pocketsphinx" need a model."""
    model: Path | None = None
    """The engine's model: a folder or a file, beside the conference file."""

    @model_validator(mode="after")
    def _engine_has_a_model(self) -> Self:
        if self.engine not in WITHOUT_MODEL and self.model is None:
            raise ValueError(f'engine = "{self.engine}" needs a model; name it: model = "path"')
        return self

    def language_of(self, participant: str) -> Spoken:
        """What `participant` speaks."""
        return self.languages.get(participant, self.language)
