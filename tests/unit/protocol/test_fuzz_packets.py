"""Any bytes at all from phones, tracking suites and VRPN servers (see `fuzzing`)."""

from __future__ import annotations

import math
import struct
from typing import Any

from fuzzing import Case, check, fuzz, pieces, true_pose, variants
from hypothesis import given

from vistel.protocol import vmc, vrpn
from vistel.protocol.live_link_face import FacePacket, LiveLinkParser, encode
from vistel.protocol.vrpn import AnalogReport, ButtonReport, PongReport, VrpnParser

FACE = encode(FacePacket("id", "Ann", 7, 0.25, (60, 1), (0.5,) * 61))
BODY = vmc.encode({"Hips": ((0.0, 0.9, 0.0), (0.0, 0.0, 0.0, 1.0)), "Head": ((0.1, 0.2, 0.3), (0.6, 0.0, 0.0, 0.8))})
HEAD_AT = struct.unpack("3f", struct.pack("3f", 0.1, 0.2, 0.3))

TURN = (0.0, 0.6, 0.0, 0.8)
SERVER = (
    vrpn.COOKIE
    + vrpn.describe(vrpn.SENDER, 3, "Tracker0")
    + vrpn.describe(vrpn.TYPE, 4, vrpn.POSE)
    + vrpn.describe(vrpn.TYPE, 5, vrpn.ANALOG)
    + vrpn.describe(vrpn.TYPE, 6, vrpn.PONG)
    + vrpn.describe(vrpn.TYPE, 7, vrpn.BUTTON)
    + vrpn.describe(vrpn.TYPE, 8, vrpn.BUTTONS)
)
POSE = vrpn.message(4, 3, vrpn.pose_payload(2, (0.1, 0.2, -0.3), TURN))
ANALOG = vrpn.message(5, 3, vrpn.analog_payload((0.5, 0.25)))
BUTTON = vrpn.message(7, 3, vrpn.change_payload(2, True))
BUTTONS = vrpn.message(8, 3, vrpn.states_payload((True, False, True)))


@fuzz
@given(pieces(FACE, FACE[:20], FACE[20:40], FACE[40:], b"\x06", b"\0\0\0\x02", b"\x3d"))
def test_fuzz_live_link_gives_only_finite_faces_and_the_next_is_read(case: Case) -> None:
    for packet in variants(case):
        parser = LiveLinkParser()
        for face in parser.feed(packet, 1):
            assert len(face.values) in (0, 61) and all(map(math.isfinite, face.values)), packet
        assert len(parser.feed(FACE, 2 * 10**9)) == 1


@fuzz
@given(pieces(BODY, BODY[:16], BODY[16:40], BODY[40:], b"#bundle\0", b"/VMC/Ext/Bone/Pos\0\0\0", b",sfffffff\0\0\0", b"Head\0"))
def test_fuzz_vmc_gives_only_true_poses_and_is_back_at_once(case: Case) -> None:
    for packet in variants(case):
        parser = vmc.VmcParser()
        bodies = [*parser.feed(packet, 1), *parser.feed(BODY, 2)]
        for body in bodies:
            assert all(true_pose(p, q, 20.0) for p, q in body.bones.values()), packet
        assert bodies[-1].bones["Head"][0] == HEAD_AT


@fuzz
@given(
    pieces(
        vrpn.COOKIE,
        POSE,
        ANALOG,
        BUTTON,
        BUTTONS,
        vrpn.describe(vrpn.SENDER, 3, "Tracker0"),
        vrpn.describe(vrpn.TYPE, 4, vrpn.POSE),
        vrpn.describe(vrpn.TYPE, 4, "else"),
        vrpn.message(6, 3),
        vrpn.message(vrpn.LOG, 0, b"file\0"),
        vrpn.message(9, 9, bytes(400)),
        longest=32,
    )
)
def test_fuzz_vrpn_is_never_fooled_and_finds_the_next_report(case: Case) -> None:
    def sound(report: Any) -> bool:
        if isinstance(report, AnalogReport):
            return all(map(math.isfinite, report.channels))
        if isinstance(report, ButtonReport):
            return bool(report.device) and all(0 <= k <= 256 for k in report.pressed)
        if isinstance(report, PongReport):
            return bool(report.device)
        return true_pose(report.position, report.rotation, 1e3) and 0 <= report.sensor < 4096 and bool(report.device)

    for garbage in variants(case):
        parser = VrpnParser()
        parser.feed(SERVER, 0)
        check(parser, garbage, POSE, sound, SERVER)
