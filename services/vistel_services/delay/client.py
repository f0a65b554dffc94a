"""A Modbus client for one device: connects, reads and writes registers by name."""

from __future__ import annotations

import asyncio
import logging
import termios
from collections.abc import Mapping
from typing import Any

from pymodbus import FramerType, ModbusException
from pymodbus.client import AsyncModbusSerialClient, AsyncModbusTcpClient

from vistel.protocol.equipment import BUSY_CODES, Block, Register, blocks

log = logging.getLogger("vistel.delay")
logging.getLogger("pymodbus").setLevel(logging.CRITICAL)  # the device's status has it

TIMEOUT_S = 0.3
_RETRIES = 1


class NoAnswerError(Exception):
    """The device does not answer, is busy or cannot be reached; one line for a person."""


class RefusedError(Exception):
    """The device answered with an exception that trying again does not mend; one line for a person."""


_MEANING = {
    1: "the device does not know this function",
    2: "the device has no such register",
    3: "the device does not accept this value",
    4: "the device failed",
    10: "the gateway has no path to the device",
    11: "the gateway cannot reach the device",
}


class ModbusDevice:
    """Reads and writes registers by name. Raises NoAnswerError and RefusedError."""

    def __init__(
        self, address: str, device_id: int, registers: Mapping[str, Register], baud: int = 19200, parity: str = "E"
    ) -> None:
        self.address = address
        self._id = device_id
        self._registers = registers
        self._blocks = blocks(registers)
        self.refusals = 0
        kind, _, rest = address.partition(":")
        # The client does not reconnect by itself: service.py decides when to try again.
        settings: dict[str, Any] = {"timeout": TIMEOUT_S, "retries": _RETRIES, "reconnect_delay": 0}
        if kind == "rtu":
            self._client: Any = AsyncModbusSerialClient(rest, baudrate=baud, parity=parity, **settings)
        else:
            host, _, port = rest.rpartition(":")
            framer = FramerType.RTU if kind == "rtu+tcp" else FramerType.SOCKET
            self._client = AsyncModbusTcpClient(host, port=int(port), framer=framer, **settings)

    async def connect(self) -> None:
        """Does nothing if already connected."""
        if self._client.connected:
            return
        try:
            connected = await self._client.connect()
        except (OSError, ModbusException, ValueError, termios.error) as e:
            # A serial port that does not accept its settings fails only here; pymodbus passes that error on.
            raise NoAnswerError(f"{self.address}: cannot be reached: {e}") from e
        if not connected:
            raise NoAnswerError(f"{self.address}: nothing answers")

    def close(self) -> None:
        """Disconnect."""
        self._client.close()

    async def read_all(self) -> dict[str, float]:
        """The value of every register, in its unit."""
        words: dict[tuple[str, int], Any] = {}
        for block in self._blocks:
            got = await self._read(block)
            words |= {(block.table, block.address + i): value for i, value in enumerate(got)}
        return {name: r.value([words[r.table, r.address + i] for i in range(r.words)]) for name, r in self._registers.items()}

    async def write(self, name: str, value: float) -> None:
        """Write one register. Raises ValueError for a value that it cannot hold."""
        register = self._registers[name]
        raw = register.raw(value)
        if register.table == "coil":
            await self._ask(self._client.write_coil, register.address, bool(raw[0]), what=f"{name} = {value:g}")
        else:
            await self._ask(self._client.write_registers, register.address, raw, what=f"{name} = {value:g}")

    async def _read(self, block: Block) -> list[Any]:
        read = {
            "holding": self._client.read_holding_registers,
            "input": self._client.read_input_registers,
            "coil": self._client.read_coils,
            "discrete": self._client.read_discrete_inputs,
        }[block.table]
        what = f"{block.table} {block.address}..{block.address + block.count - 1}"
        reply = await self._ask(read, block.address, what=what, count=block.count)
        out = reply.bits if block.table in ("coil", "discrete") else reply.registers
        if len(out) < block.count:
            self.close()
            raise NoAnswerError(f"{self.address}: {what}: the answer is too short")
        return list(out[: block.count])

    async def _ask(self, call: Any, *arguments: Any, what: str, **named: Any) -> Any:
        try:
            reply = await call(*arguments, device_id=self._id, **named)
        except ModbusException as e:
            # A late answer would be taken for that to the next request: connect anew.
            self.close()
            raise NoAnswerError(f"{self.address}: no answer: {what}") from e
        except (OSError, asyncio.IncompleteReadError) as e:
            self.close()
            raise NoAnswerError(f"{self.address}: {e}") from e
        if reply.isError():
            self.refusals += 1
            code = int(getattr(reply, "exception_code", 0))
            if code in BUSY_CODES:
                raise NoAnswerError(f"{self.address}: busy: {what}")
            raise RefusedError(f"{self.address}: {what}: {_MEANING.get(code, 'refused')} (exception {code})")
        return reply
