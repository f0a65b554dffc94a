"""The error of wrinkle files that cannot be used."""

from pydantic import BaseModel, ConfigDict


class WrinkleError(ValueError):
    """A wrinkle, or a file of wrinkles, that cannot be used; one line per fault: file:line: key: what was expected."""


class Entry(BaseModel):
    """A table of a wrinkle file: unknown keys are faults."""

    model_config = ConfigDict(extra="forbid", frozen=True)
