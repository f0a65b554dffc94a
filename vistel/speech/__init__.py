"""Spoken commands: a small acoustic model, a decoder over a finite grammar, and the meaning of sentences. No bus, no device."""
