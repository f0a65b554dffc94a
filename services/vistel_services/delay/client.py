"""One Modbus device: connected, read, brought to hold what is desired, and connected again."""

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
logging.getLogger("pymodbus").setLevel(logging.CRITICAL)  # what it would say of a device is in the device's status

TIMEOUT_S = 0.3
_RETRIES = 1


class NoAnswerError(Exception):
    """The device does not answer, or is not there; one line for a person."""


class RefusedError(Exception):
    """The device answered with an exception that will not go by itself; one line for a person."""


_MEANING = {
    1: "it does not know this function",
    2: "it has no such register",
    3: "it does not take this value",
    4: "it failed",
    10: "the gateway has no way to it",
    11: "the gateway cannot reach it",
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
        # The client's own reconnecting is off: one place decides when to try again.
        settings: dict[str, Any] = {"timeout": TIMEOUT_S, "retries": _RETRIES, "reconnect_delay": 0}
        if kind == "rtu":
            self._client: Any = AsyncModbusSerialClient(rest, baudrate=baud, parity=parity, **settings)
        else:
            host, _, port = rest.rpartition(":")
            framer = FramerType.RTU if kind == "rtu+tcp" else FramerType.SOCKET
            self._client = AsyncModbusTcpClient(host, port=int(port), framer=framer, **settings)

    async def connect(self) -> None:
        """Connect if not connected."""
        if self._client.connected:
            return
        try:
            connected = await self._client.connect()
        except (OSError, ModbusException, ValueError, termios.error) as e:
            # A serial port that cannot be set as asked fails only here, and pymodbus passes on what it says.
            raise NoAnswerError(f"{self.address}: cannot be reached: {e}") from e
        if not connected:
            raise NoAnswerError(f"{self.address}: nobody is there")

    def close(self) -> None:
        """Disconnect."""
        self._client.close()

    async def read_all(self) -> dict[str, float]:
        """Every register of the map, in its unit."""
        words: dict[tuple[str, int], Any] = {}
        for block in self._blocks:
            got = await self._read(block)
            words |= {(block.table, block.address + i): value for i, value in enumerate(got)}
        return {name: r.value([words[r.table, r.address + i] for i in range(r.words)]) for name, r in self._registers.items()}

    async def write(self, name: str, value: float) -> None:
        """One register. Raises ValueError for what it cannot hold."""
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
            # A device that answers late would answer the next question with this one's answer: begin anew.
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
