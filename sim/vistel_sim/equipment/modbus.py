"""The server's side of Modbus (Application Protocol V1.1b3, TCP/IP V1.0b, Serial Line V1.02): bytes in, bytes out, no port."""

import struct
from collections.abc import Callable, Sequence
from enum import IntEnum
from typing import Protocol

COILS = 1
"""Function code that reads coils."""
DISCRETE = 2
"""Function code that reads discrete inputs."""
HOLDING = 3
"""Function code that reads holding registers."""
INPUT = 4
"""Function code that reads input registers."""
_WRITE_COIL = 5
_WRITE_REGISTER = 6
_WRITE_COILS = 15
_WRITE_REGISTERS = 16
_DEVICE_IDENTIFICATION = 43
_READ_MOST = {COILS: 2000, DISCRETE: 2000, HOLDING: 125, INPUT: 125}
"""Values that one request may read."""
_WRITE_MOST = {_WRITE_COILS: 1968, _WRITE_REGISTERS: 123}
"""Values that one request may write."""
_COIL = {0x0000: False, 0xFF00: True}
_MBAP = struct.Struct(">HHHB")
_LONGEST_PDU = 253
_FIXED = {COILS: 8, DISCRETE: 8, HOLDING: 8, INPUT: 8, _WRITE_COIL: 8, _WRITE_REGISTER: 8, _DEVICE_IDENTIFICATION: 7}
"""Length of a request on a serial line, with address and checksum [bytes]."""


class Refusal(IntEnum):
    """Exception codes."""

    ILLEGAL_FUNCTION = 1
    ILLEGAL_ADDRESS = 2
    ILLEGAL_VALUE = 3
    DEVICE_FAILURE = 4
    DEVICE_BUSY = 6
    NO_TARGET = 11
    """A gateway's, of a unit that is not there."""


class _RefusedError(Exception):
    """args: the exception code."""


class Registers(Protocol):
    """The unit behind the protocol."""

    @property
    def identity(self) -> Sequence[str]:
        """Vendor, product, revision."""
        ...

    def table(self, function: int) -> list[bool] | list[int]:
        """The values that a function code (COILS, DISCRETE, HOLDING, INPUT) reads, from address 0."""
        ...

    def write(self, table: int, address: int, values: Sequence[int]) -> Refusal | None:
        """Take values for coils or holding registers that exist; or why not."""
        ...


def answer(unit: Registers, request: bytes) -> bytes:
    """The answer to a request, both from the function code on."""
    function = request[0] if request else 0
    try:
        return request[:1] + _performed(unit, function, request[1:])
    except _RefusedError as e:
        return bytes((function | 0x80, e.args[0]))
    except struct.error:  # too short
        return bytes((function | 0x80, Refusal.ILLEGAL_VALUE))


def _performed(unit: Registers, function: int, data: bytes) -> bytes:
    """What follows the function code. Raises _RefusedError, struct.error."""
    if function in _READ_MOST:
        address, count = struct.unpack(">HH", data)
        values = _within(unit.table(function), address, count, _READ_MOST[function])
        payload = _bits(values) if function in (COILS, DISCRETE) else struct.pack(f">{count}H", *values)
        return bytes((len(payload),)) + payload
    if function in (_WRITE_COIL, _WRITE_REGISTER):
        address, value = struct.unpack(">HH", data)
        if function == _WRITE_COIL and value not in _COIL:
            raise _RefusedError(Refusal.ILLEGAL_VALUE)
        _write(unit, function, address, [_COIL[value] if function == _WRITE_COIL else value])
        return data
    if function in _WRITE_MOST:
        address, count, size = struct.unpack(">HHB", data[:5])
        values = data[5:]
        wanted = -(-count // 8) if function == _WRITE_COILS else 2 * count
        if not 1 <= count <= _WRITE_MOST[function] or not size == wanted == len(values):
            raise _RefusedError(Refusal.ILLEGAL_VALUE)
        bits = [values[k // 8] >> k % 8 & 1 for k in range(count)] if function == _WRITE_COILS else []
        _write(unit, function, address, bits or struct.unpack(f">{count}H", values))
        return data[:4]
    if function == _DEVICE_IDENTIFICATION and data[:1] == b"\x0e":
        return _identification(unit.identity, data)
    raise _RefusedError(Refusal.ILLEGAL_FUNCTION)


def _within(values: list[bool] | list[int], address: int, count: int, most: int) -> list[bool] | list[int]:
    if not 1 <= count <= most:
        raise _RefusedError(Refusal.ILLEGAL_VALUE)
    if address + count > len(values):
        raise _RefusedError(Refusal.ILLEGAL_ADDRESS)
    return values[address : address + count]


def _write(unit: Registers, function: int, address: int, values: Sequence[int]) -> None:
    table = COILS if function in (_WRITE_COIL, _WRITE_COILS) else HOLDING
    _within(unit.table(table), address, len(values), 2000)
    if (refused := unit.write(table, address, values)) is not None:
        raise _RefusedError(refused)


def _bits(values: Sequence[int]) -> bytes:
    packed = sum(bool(v) << k for k, v in enumerate(values))
    return packed.to_bytes(-(-len(values) // 8), "little")


def _identification(identity: Sequence[str], data: bytes) -> bytes:
    _, code, first = struct.unpack(">BBB", data)
    if code not in (1, 4):
        raise _RefusedError(Refusal.ILLEGAL_VALUE)
    if first >= len(identity):
        if code == 4:
            raise _RefusedError(Refusal.ILLEGAL_ADDRESS)
        first = 0
    numbers = range(first, len(identity)) if code == 1 else (first,)
    objects = [bytes((k, len(identity[k]))) + identity[k].encode("ascii") for k in numbers]
    return bytes((0x0E, code, 0x81, 0, 0, len(objects))) + b"".join(objects)


class TcpFraming:
    """Requests of one connection, in any pieces and several at once, each answered in its turn."""

    def __init__(self, unit_id: int, answered: Callable[[bytes], bytes]) -> None:
        """answered: the answer to a request; empty: none."""
        self._id, self._answered, self._rest = unit_id, answered, b""

    def feed(self, data: bytes) -> tuple[bytes, bool]:
        """Answers to the requests that `data` completes, and whether the connection can go on: after a wrong head nobody knows
        where the next begins."""
        self._rest += data
        out = b""
        while len(self._rest) >= _MBAP.size:
            number, protocol, length, unit = _MBAP.unpack_from(self._rest)
            if protocol or not 2 <= length <= 1 + _LONGEST_PDU:
                return out, False
            if len(self._rest) < 6 + length:
                break
            request, self._rest = self._rest[_MBAP.size : 6 + length], self._rest[6 + length :]
            here = unit in (0, self._id, 0xFF)
            reply = self._answered(request) if here else bytes((request[0] | 0x80, Refusal.NO_TARGET))
            if reply:
                out += _MBAP.pack(number, 0, 1 + len(reply), unit) + reply
        return out, True


class SerialFraming:
    """Requests on a serial line (RTU). Those to others are nobody's; garbage is passed over."""

    def __init__(self, unit_id: int, answered: Callable[[bytes], bytes]) -> None:
        """answered: as of `TcpFraming`."""
        self._id, self._answered, self._rest = unit_id, answered, b""

    def silence(self) -> None:
        """Nothing has come for so long that a new request begins."""
        self._rest = b""

    def feed(self, data: bytes) -> bytes:
        """Answers to the requests that `data` completes."""
        self._rest = (self._rest + data)[-2 * (_LONGEST_PDU + 3) :]
        out, i = b"", 0
        while i < len(self._rest):
            length = _length(self._rest[i:])
            if length is None:
                break
            frame = self._rest[i : i + length]
            if length == 0 or crc(frame[:-2]) != frame[-2:]:
                i += 1
                continue
            i += length
            reply = self._answered(frame[1:-2]) if frame[0] in (0, self._id) else b""
            if reply and frame[0]:  # a broadcast is answered by nobody
                body = frame[:1] + reply
                out += body + crc(body)
        self._rest = self._rest[i:]
        return out


def _length(data: bytes) -> int | None:
    """Bytes of the request at the beginning of `data`; None: more must come, 0: no request. One of an unknown function is as long
    as its checksum says."""
    if len(data) < 4:
        return None
    if (fixed := _FIXED.get(data[1])) is not None:
        return fixed if len(data) >= fixed else None
    if data[1] in _WRITE_MOST:
        whole = 9 + data[6] if len(data) > 6 else len(data) + 1
        return whole if len(data) >= whole else None
    return next((n for n in range(4, min(len(data), _LONGEST_PDU + 3) + 1) if crc(data[: n - 2]) == data[n - 2 : n]), 0)


def crc(data: bytes) -> bytes:
    """The checksum of a serial line, low byte first."""
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return value.to_bytes(2, "little")
