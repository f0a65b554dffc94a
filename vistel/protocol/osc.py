"""Open Sound Control 1.0: packets to messages and back. No arguments but the types int, float, string, blob, T and F."""

import struct

Argument = int | float | str | bytes | bool
Message = tuple[str, tuple[Argument, ...]]
"""Address and arguments."""

_BUNDLE = b"#bundle\0"
_DEEPEST = 4


def parse(packet: bytes) -> list[Message]:
    """The messages of a packet and of its bundles, without invalid ones. Never raises."""
    out: list[Message] = []
    _packet(packet, out, 0)
    return out


def _packet(data: bytes, out: list[Message], depth: int) -> None:
    if not data.startswith(_BUNDLE):
        message = _message(data)
        if message is not None:
            out.append(message)
        return
    at = len(_BUNDLE) + 8  # its time tag
    while depth < _DEEPEST and at + 4 <= len(data):
        (size,) = struct.unpack_from(">I", data, at)
        at += 4
        if size > len(data) - at:
            return
        _packet(data[at : at + size], out, depth + 1)
        at += size


def _message(data: bytes) -> Message | None:
    address, at = _string(data, 0)
    kinds, at = _string(data, at)
    if address is None or kinds is None or not address.startswith("/") or not kinds.startswith(","):
        return None
    arguments: list[Argument] = []
    for kind in kinds[1:]:
        if kind in "TF":
            arguments.append(kind == "T")
        elif kind == "s":
            text, at = _string(data, at)
            if text is None:
                return None
            arguments.append(text)
        elif kind in "ifb" and at + 4 <= len(data):
            arguments.append(struct.unpack_from(">f" if kind == "f" else ">i", data, at)[0])
            at += 4
            if kind == "b":
                size = arguments.pop()
                if not isinstance(size, int) or not 0 <= size <= len(data) - at:
                    return None
                arguments.append(data[at : at + size])
                at += -(-size // 4) * 4
        else:
            return None
    return address, tuple(arguments)


def _string(data: bytes, at: int) -> tuple[str | None, int]:
    end = data.find(b"\0", at)
    if end < 0:
        return None, at
    return data[at:end].decode("utf-8", "replace"), at + (end - at) // 4 * 4 + 4


def encode(address: str, *arguments: str | float) -> bytes:
    """A message of strings and floats."""
    kinds = "," + "".join("s" if isinstance(a, str) else "f" for a in arguments)
    body = b"".join(_padded(a) if isinstance(a, str) else struct.pack(">f", a) for a in arguments)
    return _padded(address) + _padded(kinds) + body


def bundle(messages: list[bytes]) -> bytes:
    """A bundle for immediate execution."""
    return _BUNDLE + struct.pack(">Q", 1) + b"".join(struct.pack(">I", len(m)) + m for m in messages)


def _padded(text: str) -> bytes:
    data = text.encode() + b"\0"
    return data + bytes(-len(data) % 4)
