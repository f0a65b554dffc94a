"""Kinds of devices: what the conference file, services, simulators and commands know of each, and where its code is."""
