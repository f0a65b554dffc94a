"""Keeps one device of the room as it is desired to be, and says what it does.

What is desired and what is observed are kept apart: after every reconnection, and whenever the two differ, what is desired
is written again, so that a unit that was switched off and on holds it within a round. Without a good answer for a second
nothing may be assumed: a delay unit's delay is then unknown.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping

from prometheus_client import Counter, Gauge

from vistel.protocol.equipment import MAGIC, MAP_VERSION, Register
from vistel.v1.audio_pb2 import EquipmentRequest, EquipmentStatus
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel.wire.topics import BY_NAME
from vistel_services.delay.client import ModbusDevice, NoAnswerError, RefusedError
from vistel_services.delay.config import Device

log = logging.getLogger("vistel.delay")

_UNKNOWN = Counter("vistel_delay_unknown_total", "Times a device's state became unknown", ["equipment"])
_RECONNECTS = Counter("vistel_delay_reconnects_total", "Times a device was reached again", ["equipment"])
_REFUSALS = Counter("vistel_delay_refusals_total", "Modbus exceptions in answers of a device", ["equipment"])
_ACOUSTIC = Gauge("vistel_delay_acoustic_seconds", "Delay of a delay unit, its own latency included", ["equipment"])

_ROUND_NS = 200_000_000
_RETRY_NS = 100_000_000
"""Wait before a unit that did not answer is asked again; it doubles once nothing is known of the unit."""
_RETRY_MOST_NS = 2_000_000_000
"""Longest such wait, and the one after a refusal or a wrong device."""
_TRUST_NS = 1_000_000_000
_WATCHDOG_S = 10.0
_S = EquipmentStatus


class DelayRequest:
    """What is desired of each register."""

    def __init__(self, registers: Mapping[str, Register], settings: Mapping[str, float], channel: int) -> None:
        self._registers, self._channel = registers, channel
        self.values = dict(settings)
        self.complaint = ""

    def follow(self, message: EquipmentRequest) -> None:
        """Take a request; what makes no sense is told and left out."""
        for setting in message.settings:
            name = f"delay_{self._channel}" if self._channel and setting.name == "delay" else setting.name
            register = self._registers.get(name)
            try:
                if register is None or not register.writable:
                    raise ValueError("no register that can be written")
                register.raw(setting.value)
            except ValueError as e:
                self.complaint = f"{name} = {setting.value:g} was asked: {e}"
                log.warning("event=bad_request reason=%r", self.complaint)
                continue
            self.values[name] = setting.value

    def limit(self, observed: Mapping[str, float]) -> dict[str, float]:
        """What is desired as far as the device can do it."""
        most = observed.get("max_delay")
        return {
            name: min(value, most) if most is not None and name.startswith("delay_") else value
            for name, value in self.values.items()
        }

    def missing(self, observed: Mapping[str, float]) -> dict[str, float]:
        """What must be written."""
        return {
            name: value
            for name, value in self.limit(observed).items()
            if self._registers[name].raw(value) != self._registers[name].raw(observed[name])
        }


class DelayUnit:
    """What a delay unit's registers mean."""

    def __init__(self, channel: int) -> None:
        self._channel = channel

    def check(self, observed: Mapping[str, float]) -> str:
        """What speaks against its being a delay unit; "" for nothing."""
        if int(observed["magic"]) != MAGIC:
            return f"no delay unit of this map: input register 0 holds {int(observed['magic']):#06x}, expected {MAGIC:#06x}"
        if int(observed["map_version"]) != MAP_VERSION:
            return f"map version {int(observed['map_version'])}, expected {MAP_VERSION}"
        if self._channel > int(observed["channels"]):
            return f"channel {self._channel} was asked for; it has {int(observed['channels'])}"
        return ""

    def acoustic_s(self, observed: Mapping[str, float]) -> float:
        """From its input to its output."""
        bypassed = observed[f"bypass_{self._channel}"] or observed["watchdog_tripped"]
        return observed["own_latency"] + (0.0 if bypassed else observed[f"actual_{self._channel}"])

    def wishes(self) -> dict[str, float]:
        """What is always desired: the channel is not bypassed, and goes to bypass when nobody asks any more."""
        return {f"bypass_{self._channel}": 0.0, "watchdog": _WATCHDOG_S}


async def run_device(device: Device, bus: Bus, clock: Clock) -> None:
    """Until cancelled."""
    keeper = _Keeper(device, bus, clock)
    try:
        while True:
            await keeper.round()
    finally:
        keeper.close()


class _Keeper:
    def __init__(self, device: Device, bus: Bus, clock: Clock) -> None:
        self._device, self._clock = device, clock
        self._unit = DelayUnit(device.delay_channel) if device.delay_channel else None
        always = self._unit.wishes() if self._unit is not None else {}
        self._request = DelayRequest(device.registers, always | dict(device.settings), device.delay_channel)
        self._requests = bus.subscribe(BY_NAME["equipment_request"], site=bus.site, equipment=device.name)
        self._publication = bus.publish(BY_NAME["equipment_status"], equipment=device.name)
        self._modbus: ModbusDevice | None = None
        self._observed: dict[str, float] = {}
        self._good_ns: int | None = None
        self._retry_ns = _RETRY_NS
        self._beats = self._told_refusals = 0
        self.reconnects = 0
        self._last: tuple[int, str] = (-1, "")

    async def round(self) -> None:
        """Once: hear what is asked, read, write, tell."""
        started_ns = self._clock.now_ns()
        for sample in self._requests.take():
            self._request.follow(sample.message)
        try:
            await self._work()
        except NoAnswerError as e:
            unknown = self._good_ns is None or self._clock.now_ns() - self._good_ns > _TRUST_NS
            if unknown:
                self._observed = {}
            state = _S.STATE_SEARCHING if self._good_ns is None else _S.STATE_UNKNOWN if unknown else _S.STATE_SETTLING
            self._tell(state, str(e))
            await self._clock.sleep_until_ns(self._clock.now_ns() + self._retry_ns)
            self._retry_ns = min(_RETRY_MOST_NS, 2 * self._retry_ns) if unknown else _RETRY_NS
            return
        except (RefusedError, _WrongDeviceError) as e:
            self._observed = {}
            self._tell(_S.STATE_FAULT, str(e))
            await self._clock.sleep_until_ns(self._clock.now_ns() + _RETRY_MOST_NS)
            return
        self._retry_ns = _RETRY_NS
        await self._clock.sleep_until_ns(started_ns + _ROUND_NS)

    def close(self) -> None:
        """Let it be: a delay unit's watchdog takes it to bypass."""
        self._requests.close()
        if self._modbus is not None:
            self._modbus.close()

    async def _work(self) -> None:
        device = self._reach()
        was_there = self._good_ns is not None and bool(self._observed)
        await device.connect()
        observed = await device.read_all()
        if self._unit is not None and (complaint := self._unit.check(observed)):
            raise _WrongDeviceError(f"{device.address}: {complaint}")
        if not was_there:
            self._came(observed)
        restarted = bool(self._observed) and observed.get("uptime", 0.0) < self._observed.get("uptime", 0.0)
        if restarted:
            log.warning("event=equipment_restarted equipment=%s action=written_again", self._device.name)
        missing = self._request.missing(observed)
        for name, value in missing.items():
            await device.write(name, value)
        if self._unit is not None and "heartbeat" in self._device.registers:
            self._beats = (self._beats + 1) % 0x10000
            await device.write("heartbeat", float(self._beats))
        self._observed, self._good_ns = observed, self._clock.now_ns()
        settling = bool(missing) or bool(observed.get("ramping"))
        fault = observed.get("fault", 0.0) != 0.0
        detail = f"it reports fault {observed.get('fault_code', 0.0):.0f}" if fault else self._request.complaint
        self._tell(_S.STATE_FAULT if fault else _S.STATE_SETTLING if settling else _S.STATE_OBSERVED, detail)

    def _reach(self) -> ModbusDevice:
        address = self._device.address
        if self._device.announce is not None:
            try:
                address = self._device.announce.read_text().strip()
            except OSError:
                raise NoAnswerError(f"{self._device.announce.name}: no simulated device is plugged in") from None
        if self._modbus is None or self._modbus.address != address:
            if self._modbus is not None:
                self._modbus.close()
            d = self._device
            parity = d.parity if d.announce is None else "N"  # a simulated line is a pseudo-terminal and knows no parity
            self._modbus = ModbusDevice(address, d.device_id, d.registers, d.baud, parity)
            self._told_refusals = 0
        return self._modbus

    def _came(self, observed: Mapping[str, float]) -> None:
        log.info("event=equipment_reached equipment=%s registers=%d", self._device.name, len(observed))
        if self._good_ns is not None:
            self.reconnects += 1
            _RECONNECTS.labels(self._device.name).inc()

    def _tell(self, state: EquipmentStatus.State, detail: str) -> None:
        name, now_ns = self._device.name, self._clock.now_ns()
        if (state, detail) != self._last and {state, self._last[0]} - {_S.STATE_SETTLING, _S.STATE_OBSERVED}:
            level = logging.INFO if state in (_S.STATE_OBSERVED, _S.STATE_SETTLING) else logging.WARNING
            log.log(level, "event=equipment equipment=%s state=%s detail=%r", name, _S.State.Name(state), detail)
            if state == _S.STATE_UNKNOWN:
                _UNKNOWN.labels(name).inc()
        self._last = (state, detail)
        refusals = self._modbus.refusals if self._modbus is not None else 0
        _REFUSALS.labels(name).inc(refusals - self._told_refusals)
        self._told_refusals = refusals
        message = EquipmentStatus(equipment=name, state=state, detail=detail, reconnects=self.reconnects, refusals=refusals)
        message.header.t_ns = now_ns
        wished = self._request.values
        for key, value in self._observed.items():
            unit = self._device.registers[key].unit
            message.values.add(name=key, observed=value, desired=wished.get(key, 0.0), asked=key in wished, unit=unit)
        trusted = self._good_ns is not None and now_ns - self._good_ns <= _TRUST_NS and state != _S.STATE_FAULT
        if self._unit is not None and self._observed and trusted:
            message.delay_known = True
            message.acoustic_s = self._unit.acoustic_s(self._observed)
            _ACOUSTIC.labels(name).set(message.acoustic_s)
        self._publication.put(message)


class _WrongDeviceError(Exception):
    """It answers, and is not what the conference file says."""
