"""Voices: codec, jitter buffer, concealment, time stretching, drift, levels, spatial mixing. No clock, no device, no bus."""
