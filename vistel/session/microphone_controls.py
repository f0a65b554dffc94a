"""What opens and closes the microphones of a site: its participants, and the host, who can only close them."""

from __future__ import annotations

from vistel.audio.microphone_switches import MicrophoneSwitches
from vistel.wire.bus import Bus
from vistel.wire.topics import BY_NAME


class MicrophoneControls:
    """Sets the switches as the bus says. Lives on the event loop."""

    def __init__(self, bus: Bus, site: str, switches: MicrophoneSwitches) -> None:
        self._switches = switches
        self._own = bus.subscribe(BY_NAME["voice_control"], polled=True, site=site)
        self._host = bus.subscribe(BY_NAME["muting"], polled=True)

    def take(self) -> None:
        """Do what has come since the last call."""
        for sample in self._host.take():
            self._switches.mute(sample.names["participant"], sample.message.header.t_ns)
        for sample in self._own.take():
            self._switches.follow(sample.names["participant"], sample.message)

    def close(self) -> None:
        """Receive no more."""
        self._own.close()
        self._host.close()
