"""Keeps the registers of one device at their desired values, and publishes the observed ones.

Whenever desired and observed values differ, the desired ones are written again: a unit that was switched off and on has
them within a round. After a second without a valid answer the device's state, and a delay unit's delay, is unknown.
"""

from __future__ import annotations

import asyncio
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
"""Pause after a failed attempt; it doubles once the state is unknown."""
_RETRY_MOST_NS = 2_000_000_000
"""Longest such pause, and the one after a refusal or a wrong device."""
_VALID_NS = 1_000_000_000
"""For this time after an answer the observed values are taken as still true."""
_WATCHDOG_S = 10.0
_S = EquipmentStatus


class DesiredValues:
    """The desired value of each register, from settings and requests."""

    def __init__(self, registers: Mapping[str, Register], settings: Mapping[str, float], channel: int) -> None:
        self._registers, self._channel = registers, channel
        self.values = dict(settings)
        self.refused = ""

    def follow(self, message: EquipmentRequest) -> None:
        """Take over a request; a setting that the map does not allow is logged and left out."""
        for setting in message.settings:
            name = f"delay_{self._channel}" if self._channel and setting.name == "delay" else setting.name
            register = self._registers.get(name)
            try:
                if register is None or not register.writable:
                    raise ValueError("no register that can be written")
                register.raw(setting.value)
            except ValueError as e:
                self.refused = f"{name} = {setting.value:g} was requested: {e}"
                log.warning("event=bad_request reason=%r", self.refused)
                continue
            self.values[name] = setting.value

    def limit(self, observed: Mapping[str, float]) -> dict[str, float]:
        """Desired values, delays no longer than the device's longest."""
        most = observed.get("max_delay")
        return {
            name: min(value, most) if most is not None and name.startswith("delay_") else value
            for name, value in self.values.items()
        }

    def missing(self, observed: Mapping[str, float]) -> dict[str, float]:
        """Desired values that the device does not have yet."""
        return {
            name: value
            for name, value in self.limit(observed).items()
            if self._registers[name].raw(value) != self._registers[name].raw(observed[name])
        }


class DelayRegisters:
    """Reads the registers of a delay unit, of which one channel is used."""

    def __init__(self, channel: int) -> None:
        self._channel = channel

    def check(self, observed: Mapping[str, float]) -> str:
        """Why this is not the delay unit that is expected; "" if it is."""
        if int(observed["magic"]) != MAGIC:
            return f"no delay unit of this map: input register 0 holds {int(observed['magic']):#06x}, expected {MAGIC:#06x}"
        if int(observed["map_version"]) != MAP_VERSION:
            return f"map version {int(observed['map_version'])}, expected {MAP_VERSION}"
        if self._channel > int(observed["channels"]):
            return f"channel {self._channel} is configured; the unit has {int(observed['channels'])}"
        return ""

    def acoustic_s(self, observed: Mapping[str, float]) -> float:
        """Delay from input to output [s]."""
        bypassed = observed[f"bypass_{self._channel}"] or observed["watchdog_tripped"]
        return observed["own_latency"] + (0.0 if bypassed else observed[f"actual_{self._channel}"])

    def desired(self) -> dict[str, float]:
        """What is always desired: the channel is not bypassed until its watchdog misses the heartbeat."""
        return {f"bypass_{self._channel}": 0.0, "watchdog": _WATCHDOG_S}


async def run_device(device: Device, bus: Bus, clock: Clock) -> None:
    """Runs until cancelled."""
    loop, task = _DeviceLoop(device, bus, clock), asyncio.current_task()
    try:
        # pymodbus waits with asyncio.wait_for, which in Python 3.11 loses a cancellation that comes together with an answer.
        while task is None or not task.cancelling():
            await loop.round()
    finally:
        loop.close()


class _DeviceLoop:
    def __init__(self, device: Device, bus: Bus, clock: Clock) -> None:
        self._device, self._clock = device, clock
        self._unit = DelayRegisters(device.delay_channel) if device.delay_channel else None
        always = self._unit.desired() if self._unit is not None else {}
        self._desired = DesiredValues(device.registers, always | dict(device.settings), device.delay_channel)
        self._requests = bus.subscribe(BY_NAME["equipment_request"], site=bus.site, equipment=device.name)
        self._publication = bus.publish(BY_NAME["equipment_status"], equipment=device.name)
        self._modbus: ModbusDevice | None = None
        self._observed: dict[str, float] = {}
        self._good_ns: int | None = None
        self._retry_ns = _RETRY_NS
        self._beats = self._counted_refusals = 0
        self.reconnects = 0
        self._last: tuple[int, str] = (-1, "")

    async def round(self) -> None:
        """Take requests, read, write, publish; then wait."""
        started_ns = self._clock.now_ns()
        for sample in self._requests.take():
            self._desired.follow(sample.message)
        try:
            await self._work()
        except NoAnswerError as e:
            unknown = self._good_ns is None or self._clock.now_ns() - self._good_ns > _VALID_NS
            if unknown:
                self._observed = {}
            state = _S.STATE_SEARCHING if self._good_ns is None else _S.STATE_UNKNOWN if unknown else _S.STATE_SETTLING
            self._publish(state, str(e))
            await self._clock.sleep_until_ns(self._clock.now_ns() + self._retry_ns)
            self._retry_ns = min(_RETRY_MOST_NS, 2 * self._retry_ns) if unknown else _RETRY_NS
            return
        except (RefusedError, _WrongDeviceError) as e:
            self._observed = {}
            self._publish(_S.STATE_FAULT, str(e))
            await self._clock.sleep_until_ns(self._clock.now_ns() + _RETRY_MOST_NS)
            return
        self._retry_ns = _RETRY_NS
        await self._clock.sleep_until_ns(started_ns + _ROUND_NS)

    def close(self) -> None:
        """Disconnect; a delay unit's watchdog then bypasses its channel."""
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
            self._count_reached(observed)
        restarted = bool(self._observed) and observed.get("uptime", 0.0) < self._observed.get("uptime", 0.0)
        if restarted:
            log.warning("event=equipment_restarted equipment=%s action=written_again", self._device.name)
        missing = self._desired.missing(observed)
        for name, value in missing.items():
            await device.write(name, value)
        if self._unit is not None and "heartbeat" in self._device.registers:
            self._beats = (self._beats + 1) % 0x10000
            await device.write("heartbeat", float(self._beats))
        self._observed, self._good_ns = observed, self._clock.now_ns()
        settling = bool(missing) or bool(observed.get("ramping"))
        fault = observed.get("fault", 0.0) != 0.0
        detail = f"the device reports fault {observed.get('fault_code', 0.0):.0f}" if fault else self._desired.refused
        self._publish(_S.STATE_FAULT if fault else _S.STATE_SETTLING if settling else _S.STATE_OBSERVED, detail)

    def _reach(self) -> ModbusDevice:
        address = self._device.address
        if self._device.announce is not None:
            try:
                address = self._device.announce.read_text().strip()
            except OSError:
                raise NoAnswerError(f"{self._device.announce.name}: the simulated device is not running") from None
        if self._modbus is None or self._modbus.address != address:
            if self._modbus is not None:
                self._modbus.close()
            d = self._device
            parity = d.parity if d.announce is None else "N"  # a simulated device is at a pseudo-terminal, which has no parity
            self._modbus = ModbusDevice(address, d.device_id, d.registers, d.baud, parity)
            self._counted_refusals = 0
        return self._modbus

    def _count_reached(self, observed: Mapping[str, float]) -> None:
        log.info("event=equipment_reached equipment=%s registers=%d", self._device.name, len(observed))
        if self._good_ns is not None:
            self.reconnects += 1
            _RECONNECTS.labels(self._device.name).inc()

    def _publish(self, state: EquipmentStatus.State, detail: str) -> None:
        name, now_ns = self._device.name, self._clock.now_ns()
        if (state, detail) != self._last and {state, self._last[0]} - {_S.STATE_SETTLING, _S.STATE_OBSERVED}:
            level = logging.INFO if state in (_S.STATE_OBSERVED, _S.STATE_SETTLING) else logging.WARNING
            log.log(level, "event=equipment equipment=%s state=%s detail=%r", name, _S.State.Name(state), detail)
            if state == _S.STATE_UNKNOWN:
                _UNKNOWN.labels(name).inc()
        self._last = (state, detail)
        refusals = self._modbus.refusals if self._modbus is not None else 0
        _REFUSALS.labels(name).inc(refusals - self._counted_refusals)
        self._counted_refusals = refusals
        message = EquipmentStatus(equipment=name, state=state, detail=detail, reconnects=self.reconnects, refusals=refusals)
        message.header.t_ns = now_ns
        desired = self._desired.values
        for key, value in self._observed.items():
            unit = self._device.registers[key].unit
            message.values.add(name=key, observed=value, desired=desired.get(key, 0.0), asked=key in desired, unit=unit)
        valid = self._good_ns is not None and now_ns - self._good_ns <= _VALID_NS and state != _S.STATE_FAULT
        if self._unit is not None and self._observed and valid:
            message.delay_known = True
            message.acoustic_s = self._unit.acoustic_s(self._observed)
            _ACOUSTIC.labels(name).set(message.acoustic_s)
        self._publication.put(message)


class _WrongDeviceError(Exception):
    """What answers is not the device of the conference file."""
