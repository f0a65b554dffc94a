"""Spoken commands: a small acoustic model, a decoder over a finite grammar, and what was meant. No bus, no device."""
