"""The delay unit of a site, as its audio service uses it."""

from __future__ import annotations

import logging
import math

from vistel.audio.delay_policy import DelayUnitShare
from vistel.v1.audio_pb2 import EquipmentRequest
from vistel.wire.bus import Bus
from vistel.wire.topics import BY_NAME

log = logging.getLogger("vistel.audio")

_STEP_S = 0.005
"""Smaller changes are not requested: each change is an audible ramp [s]."""


class DelayUnit:
    """Follows the status of the unit and requests its delay. acoustic_s: its delay; None: unknown."""

    def __init__(self, bus: Bus, name: str, site: str) -> None:
        self.acoustic_s: float | None = None
        self._name = name
        self._status = bus.subscribe(BY_NAME["equipment_status"], polled=True, site=site, equipment=name)
        self._requests = bus.publish(BY_NAME["equipment_request"], equipment=name)
        self._share = DelayUnitShare()
        self._requested_s: float | None = None
        self._own_s, self._most_s = 0.0, math.inf

    def take(self) -> None:
        """Take its newest status."""
        for sample in self._status.take():
            status = sample.message
            known = status.delay_known
            if known != (self.acoustic_s is not None):
                log.log(logging.INFO if known else logging.WARNING, "event=delay_unit known=%s detail=%r", known, status.detail)
            self.acoustic_s = status.acoustic_s if known else None
            observed = {value.name: value.observed for value in status.values}
            self._own_s = observed.get("own_latency", self._own_s)
            self._most_s = observed.get("max_delay", self._most_s)

    @property
    def latency_s(self) -> float:
        """Its latency at delay 0 [s]; 0 while unknown."""
        return 0.0 if self.acoustic_s is None else self._own_s

    def request(self, spare_s: float | None, now_ns: int) -> None:
        """Request the delay that all voices have had to spare for a while."""
        if spare_s is None or self.acoustic_s is None:
            return
        wanted = self._share.wanted_s(now_ns, min(spare_s, self._most_s))
        if wanted is None or (self._requested_s is not None and abs(wanted - self._requested_s) < _STEP_S):
            return
        self._requested_s = wanted
        message = EquipmentRequest(equipment=self._name)
        message.settings.add(name="delay", value=wanted)
        message.header.t_ns = now_ns
        self._requests.put(message)

    def close(self) -> None:
        """Close the subscription."""
        self._status.close()
