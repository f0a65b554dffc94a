"""A new verb needs three things: its description, what it does, and its field in the messages. Everything else follows."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pytest
from google.protobuf import message_factory
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto
from google.protobuf.descriptor_pool import DescriptorPool
from talking import Talk, done, refused

from vistel.messages.commands import write_action
from vistel.messages.commands_read import action_of
from vistel.space.actions import Refused
from vistel.space.arguments import THIS, Which
from vistel.space.command_description import COMMANDS, Action, Quantity, command, phrase, spoken, typed
from vistel.space.commands.context import PERFORMERS, Answer, Context, performs
from vistel.space.commands.phrase import PhraseError, read, usage
from vistel.space.commands.placing import glide
from vistel.speech.grammar_file import load_grammar
from vistel.speech.meaning import asked_for
from vistel.v1 import command_pb2, envelope_pb2, geometry_pb2

DESCRIBED = command(
    typed("spin WHICH TURNS"),
    typed("whirl WHICH", turns=1.5),
    spoken("spin", phrase("shape_it.spin", "くるくるまわして", "spin/whirl around", "くるくる回して")),
)
"""The first thing, with the class below."""


@dataclass(frozen=True)
class Spin(Action):
    """Turn things on the spot by whole turns and parts of them."""

    which: Which = THIS
    turns: Annotated[float, Quantity("TURNS", "how often?", {"": 1.0, "little": 0.5, "more": 1.75}, tag="turns")] = 1.0


def spin(context: Context, action: Spin) -> Answer:
    """The second thing."""
    if not 0.0 < action.turns <= 2.0:
        raise Refused(f"things spin up to 2 times, not {action.turns:g} times")
    turn = np.array([0.0, 2.0 * math.pi * action.turns, 0.0])
    return glide(context, context.loose(action.which), lambda n: (np.zeros(3), turn))


def message_with_spin() -> Any:
    """The third thing, in a pool of its own: SpinThing { Which which = 1; optional double turns = 2; }, Command.spin = 99."""
    pool = DescriptorPool()
    for module in (envelope_pb2, geometry_pb2):
        pool.AddSerializedFile(module.DESCRIPTOR.serialized_pb)
    file = FileDescriptorProto()
    command_pb2.DESCRIPTOR.CopyToProto(file)
    thing = file.message_type.add(name="SpinThing")
    optional = FieldDescriptorProto.LABEL_OPTIONAL
    thing.field.add(name="which", number=1, label=optional, type=FieldDescriptorProto.TYPE_MESSAGE, type_name=".vistel.v1.Which")
    thing.oneof_decl.add(name="_turns")
    turns = {"type": FieldDescriptorProto.TYPE_DOUBLE, "oneof_index": 0, "proto3_optional": True}
    thing.field.add(name="turns", number=2, label=optional, **turns)
    whole = next(m for m in file.message_type if m.name == "Command")
    kind = {"type": FieldDescriptorProto.TYPE_MESSAGE, "type_name": ".vistel.v1.SpinThing", "oneof_index": 0}
    whole.field.add(name="spin", number=99, label=optional, **kind)
    pool.AddSerializedFile(file.SerializeToString())
    return message_factory.GetMessageClass(pool.FindMessageTypeByName("vistel.v1.Command"))


@pytest.fixture(autouse=True)
def _registered() -> Iterator[None]:
    DESCRIBED(Spin)
    performs(Spin)(spin)
    yield
    del COMMANDS["spin"], PERFORMERS[Spin]


def test_it_is_typed_and_listed() -> None:
    assert read("spin the box 1.25") == Spin(Which(name="box"), 1.25)
    assert read("whirl all balls") == Spin(Which(name="balls", every=True), 1.5)
    with pytest.raises(PhraseError, match="spin how often"):
        read("spin the box")
    assert "spin WHICH TURNS" in usage()
    assert "whirl WHICH" in usage()


def test_it_is_said_in_both_languages() -> None:
    grammar, faults = load_grammar()
    assert faults == []
    for text, action in (
        ("spin the box", Spin(Which(shape="box"))),
        ("whirl around this a little", Spin(THIS, 0.5)),
        ("はこをもっとくるくるまわして", Spin(Which(shape="box"), 1.75)),
        ("箱をくるくる回して", Spin(Which(shape="box"))),
    ):
        said = grammar.read(text)
        assert said is not None, text
        assert asked_for(said.means) == action
    assert asked_for({"do": "spin", "turns": 2}) == Spin(THIS, 2.0)


@pytest.mark.parametrize("action", [Spin(), Spin(Which("box"), 0.0), Spin(Which(colour="red", every=True), 1.25)])
def test_it_goes_through_its_message(action: Spin) -> None:
    message = message_with_spin()
    sent = message(id="1", participant="ann")
    write_action(action, sent)
    assert action_of(message.FromString(sent.SerializeToString())) == action


def test_what_its_message_leaves_out_is_as_described() -> None:
    message = message_with_spin()
    sent = message()
    sent.spin.SetInParent()
    assert action_of(sent) == Spin(THIS, 1.0)


def test_the_world_does_it_and_takes_it_back() -> None:
    talk = Talk()
    before = talk.play.thing("box").rotation.copy()
    assert done(talk.say(read("spin the box 0.25"))) == ("box",)
    talk.wait(120)
    after = talk.play.thing("box").rotation
    assert abs(float(before @ after)) == pytest.approx(math.cos(math.pi / 4), abs=0.02)
    assert "up to 2 times" in refused(talk.say(read("spin the box 3")))
    assert "not finite" in refused(talk.say(read("spin the box nan")))
    assert done(talk.say(read("undo"))) == ("box",)
