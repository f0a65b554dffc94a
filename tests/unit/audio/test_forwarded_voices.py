"""What pages are sent of voices: each packet once, in order, with how late its talker's picture is."""

import struct

from vistel.audio.forwarded_voices import ForwardedVoices
from vistel.audio.opus import FRAME_NS
from vistel.audio.page_voice import MOST_BYTES_PER_S, VoiceGate
from vistel.v1.audio_pb2 import Voice


def voice(n: int, opus: bytes, earlier: tuple[bytes, ...] = (), *, talking: bool = True) -> Voice:
    message = Voice(opus=opus, level_db=-20.0, talking=talking, earlier=earlier)
    message.header.t_ns = n * FRAME_NS
    return message


def test_a_lost_packet_comes_with_its_successor_and_none_comes_twice() -> None:
    voices = ForwardedVoices()
    for n, opus, earlier in ((100, b"a", ()), (102, b"c", (b"b",)), (101, b"b", (b"a",)), (103, b"d", (b"c",))):
        voices.receive("ann", voice(n, opus, earlier), n * FRAME_NS + 5)
    records = voices.records(lambda name: 80_000_000)
    assert [record[-1:] for _, record in records] == [b"a", b"b", b"c", b"d"] and not voices.records(lambda name: 0)
    size, name, talking, t_ms, delay_ms = struct.unpack_from("<HBBdf", records[1][1])
    assert (size, name, talking, t_ms, delay_ms) == (len(records[1][1]), 3, 1, 101 * 20.0, 80.0)


def test_the_gate_passes_a_voice_on_at_its_own_rate_and_no_more_bits_than_one_needs() -> None:
    gate, passed, sizes = VoiceGate(), 0, 0
    for n in range(500):
        passed += gate.admits(n * FRAME_NS, 60, n * FRAME_NS)
    assert passed == 500
    gate = VoiceGate()
    for n in range(500):  # 128 kbit/s for ten seconds
        sizes += 320 * gate.admits(n * FRAME_NS, 320, n * FRAME_NS)
    assert sizes <= 11 * MOST_BYTES_PER_S
    gate = VoiceGate()
    assert sum(gate.admits(n * FRAME_NS, 60, 0) for n in range(1000)) == 100
