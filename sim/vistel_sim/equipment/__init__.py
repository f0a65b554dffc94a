"""Simulated devices of a room on Modbus: the audio delay unit, and any other device by its registers."""
