"""The protocols of devices: bytes in, records out, and commands as bytes. No port is opened here."""
