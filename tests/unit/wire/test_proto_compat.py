"""The messages: commented, in style, readable by older nodes and logs, and their Python is up to date."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet

from vistel.wire.topics import TOPICS, Publisher

ROOT = Path(__file__).resolve().parents[3]
pytest.importorskip("grpc_tools", reason="grpcio-tools is not installed (pip install -e .[dev])")


@pytest.fixture(scope="module")
def check() -> ModuleType:
    spec = importlib.util.spec_from_file_location("proto_check", ROOT / "proto/check.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def compiled(check: ModuleType, folder: Path, text: str) -> FileDescriptorSet:
    folder.mkdir(exist_ok=True)
    (folder / "x.proto").write_text('syntax = "proto3";\npackage vistel.v1;\n' + text)
    return check.compile_protos(folder)


def test_every_message_enum_and_field_is_commented_and_in_style(check: ModuleType) -> None:
    assert check.lint(check.compile_protos()) == []


def test_older_nodes_and_logs_can_read_what_we_write(check: ModuleType) -> None:
    baseline = FileDescriptorSet.FromString(check.BASELINE.read_bytes())
    assert len(baseline.file) > 0
    assert check.breaking(baseline, check.compile_protos()) == []


def test_the_baseline_knows_every_message(check: ModuleType) -> None:
    """Else nobody would notice that a new field is changed later: run `python proto/check.py --accept`."""
    baseline = FileDescriptorSet.FromString(check.BASELINE.read_bytes())
    assert check.breaking(check.compile_protos(), baseline) == []


def test_the_generated_python_is_up_to_date(check: ModuleType, tmp_path: Path) -> None:
    check.generate(tmp_path)
    made = sorted((tmp_path / "vistel/v1").iterdir())
    assert len(made) == 2 * len(check.sources())
    for path in made:
        committed = ROOT / "vistel/v1" / path.name
        assert committed.read_text() == path.read_text(), f"{committed.name} is old: run `make proto`"


def test_every_message_of_a_topic_begins_with_a_header() -> None:
    for topic in TOPICS:
        if topic.publisher is not Publisher.HUB:
            field = topic.message.DESCRIPTOR.fields_by_number[1]
            assert (field.name, field.message_type.name) == ("header", "Header"), topic.name


OLD = "// m\nmessage M {\n  // a\n  uint32 a = 1;\n  // b\n  string b = 2;\n}\n"


@pytest.mark.parametrize(
    ("new", "expected"),
    [
        (OLD.replace("string b = 2", "bytes b = 2"), "M.b = 2: was string, is bytes"),
        (OLD.replace("uint32 a", "repeated uint32 a"), "M.a = 1: was uint32, is repeated uint32"),
        (OLD.replace("string b = 2", "string c = 2"), "M.b = 2: its number now belongs to c"),
        (OLD.replace("  // b\n  string b = 2;\n", ""), "M.b = 2: is gone; reserve its number and its name"),
        ("// n\nmessage N {}\n", "M: the message is gone"),
        (OLD.replace("uint32 a = 1;", "oneof x {\n uint32 a = 1;\n}"), "M.a = 1: was uint32, is uint32 in a oneof"),
    ],
)
def test_a_breaking_change_is_found(check: ModuleType, tmp_path: Path, new: str, expected: str) -> None:
    assert check.breaking(compiled(check, tmp_path / "a", OLD), compiled(check, tmp_path / "b", new)) == [expected]


@pytest.mark.parametrize(
    "new",
    [
        OLD.replace("}\n", "  // c\n  float c = 3;\n}\n"),
        OLD.replace("uint32 a", "optional uint32 a"),
        OLD.replace("  // b\n  string b = 2;\n", '  reserved 2;\n  reserved "b";\n'),
    ],
)
def test_a_change_that_breaks_nothing_passes(check: ModuleType, tmp_path: Path, new: str) -> None:
    assert check.breaking(compiled(check, tmp_path / "a", OLD), compiled(check, tmp_path / "b", new)) == []


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("message M {}\n", "M: has no comment"),
        ("// m\nmessage M {\n  uint32 a = 1;\n}\n", "M.a: has no comment"),
        ("// m\nmessage M {\n  // a\n  uint32 someName = 1;\n}\n", "expected lower_snake_case"),
        ("// e\nenum E {\n  E_UNSPECIFIED = 0;\n  // x\n  OTHER = 1;\n}\n", "begins with E_"),
        ("// e\nenum E {\n  E_NONE = 0;\n}\n", "E_UNSPECIFIED"),
    ],
)
def test_a_fault_of_style_is_found(check: ModuleType, tmp_path: Path, text: str, expected: str) -> None:
    (line,) = check.lint(compiled(check, tmp_path / "a", text))
    assert expected in line
