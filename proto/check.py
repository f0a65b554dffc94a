"""Lint and breaking-change check of the messages: `python proto/check.py`.

With `--accept`, what is new is added to the baseline, unless something breaks it.

Lint: every message, enum, value and field has a comment, names follow the style guide of Protocol Buffers, and every message of a
topic begins with a header. Breaking: against `baseline.binpb`, the descriptors that logs and older nodes know, no field may vanish
(unless its number and name are reserved), be renamed, or change its type.
"""

import argparse
import re
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from google.protobuf.descriptor_pb2 import (
    DescriptorProto,
    EnumDescriptorProto,
    FieldDescriptorProto,
    FileDescriptorProto,
    FileDescriptorSet,
)
from grpc_tools import protoc

HERE = Path(__file__).resolve().parent
BASELINE = HERE / "vistel/v1/baseline.binpb"


def compile_protos(folder: Path = HERE, *, comments: bool = True) -> FileDescriptorSet:
    """The descriptors of every .proto below `folder`. Raises SystemExit with protoc's lines when one is not valid."""
    with tempfile.TemporaryDirectory() as temporary:
        out = Path(temporary) / "all.binpb"
        options = ["--include_source_info"] if comments else []
        if protoc.main(["protoc", f"-I{folder}", f"--descriptor_set_out={out}", *options, *sources(folder)]):
            raise SystemExit(1)
        return FileDescriptorSet.FromString(out.read_bytes())


def sources(folder: Path = HERE) -> list[str]:
    """Paths of the .proto files, sorted."""
    return [str(p) for p in sorted(folder.rglob("*.proto"))]


def generate(out: Path, folder: Path = HERE) -> None:
    """Python modules and their stubs into `out`."""
    if protoc.main(["protoc", f"-I{folder}", f"--python_out={out}", f"--pyi_out={out}", *sources(folder)]):
        raise SystemExit(1)


def lint(files: FileDescriptorSet) -> list[str]:
    """What the style forbids, one line each."""
    out: list[str] = []
    for file in files.file:
        commented = {tuple(at.path) for at in file.source_code_info.location if at.leading_comments or at.trailing_comments}
        if file.package != "vistel.v1":
            out.append(f"{file.name}: package is {file.package!r}, expected 'vistel.v1'")
        for name, path, message in _messages(file):
            if path not in commented:
                out.append(f"{file.name}: {name}: has no comment")
            out += _lint_fields(file.name, name, path, message, commented)
        for name, path, enum in _enums(file):
            out += _lint_enum(file.name, name, path, enum, commented)
    return out


def breaking(old: FileDescriptorSet, new: FileDescriptorSet) -> list[str]:
    """What a node or log that knows `old` would misread in `new`, one line each."""
    out: list[str] = []
    now = {name: message for file in new.file for name, _, message in _messages(file)}
    for file in old.file:
        for name, _, message in _messages(file):
            if name not in now:
                out.append(f"{name}: the message is gone")
            else:
                out += _breaking_fields(name, message, now[name])
    enums = {name: enum for file in new.file for name, _, enum in _enums(file)}
    for file in old.file:
        for name, _, enum in _enums(file):
            if name not in enums:
                out.append(f"{name}: the enum is gone")
            else:
                out += _breaking_values(name, enum, enums[name])
    return out


Path_ = tuple[int, ...]


def _messages(file: FileDescriptorProto) -> Iterator[tuple[str, Path_, DescriptorProto]]:
    stack = [(m.name, (4, i), m) for i, m in enumerate(file.message_type)]
    while stack:
        name, path, message = stack.pop(0)
        yield name, path, message
        stack += [(f"{name}.{m.name}", (*path, 3, i), m) for i, m in enumerate(message.nested_type)]


def _enums(file: FileDescriptorProto) -> Iterator[tuple[str, Path_, EnumDescriptorProto]]:
    yield from ((e.name, (5, i), e) for i, e in enumerate(file.enum_type))
    for name, path, message in _messages(file):
        yield from ((f"{name}.{e.name}", (*path, 4, i), e) for i, e in enumerate(message.enum_type))


def _lint_fields(file: str, name: str, path: Path_, message: DescriptorProto, commented: set[Path_]) -> Iterator[str]:
    for i, field in enumerate(message.field):
        header = field.name == "header" and field.type_name == ".vistel.v1.Header"
        if header and field.number != 1:
            yield f"{file}: {name}.header: has number {field.number}, expected 1"
        if not header and (*path, 2, i) not in commented:
            yield f"{file}: {name}.{field.name}: has no comment"
        if not re.fullmatch(r"[a-z][a-z0-9]*(_[a-z0-9]+)*", field.name):
            yield f"{file}: {name}.{field.name}: expected lower_snake_case"


def _lint_enum(file: str, name: str, path: Path_, enum: EnumDescriptorProto, commented: set[Path_]) -> Iterator[str]:
    prefix = re.sub(r"(?<!^)(?=[A-Z])", "_", name.rsplit(".", 1)[-1]).upper()
    if path not in commented:
        yield f"{file}: {name}: has no comment"
    for i, value in enumerate(enum.value):
        if not value.name.startswith(f"{prefix}_"):
            yield f"{file}: {name}.{value.name}: expected a name that begins with {prefix}_"
        if (value.number == 0) != value.name.endswith("_UNSPECIFIED"):
            yield f"{file}: {name}.{value.name}: 0 and only 0 is {prefix}_UNSPECIFIED"
        if value.number and (*path, 2, i) not in commented:
            yield f"{file}: {name}.{value.name}: has no comment"


def _breaking_fields(name: str, old: DescriptorProto, new: DescriptorProto) -> Iterator[str]:
    now = {f.number: f for f in new.field}
    for field in old.field:
        what = f"{name}.{field.name} = {field.number}"
        after = now.get(field.number)
        if after is None:
            reserved = any(r.start <= field.number < r.end for r in new.reserved_range)
            if not (reserved and field.name in new.reserved_name):
                yield f"{what}: is gone; reserve its number and its name"
        elif after.name != field.name:
            yield f"{what}: its number now belongs to {after.name}"
        elif _kind(after) != _kind(field):
            yield f"{what}: was {_kind(field)}, is {_kind(after)}"


def _breaking_values(name: str, old: EnumDescriptorProto, new: EnumDescriptorProto) -> Iterator[str]:
    now = {v.number: v.name for v in new.value}
    for value in old.value:
        if now.get(value.number) != value.name:
            yield f"{name}.{value.name} = {value.number}: is {now.get(value.number, 'gone')}"


def _kind(field: FieldDescriptorProto) -> str:
    label = "repeated " if field.label == FieldDescriptorProto.LABEL_REPEATED else ""
    kind = FieldDescriptorProto.Type.Name(field.type).removeprefix("TYPE_").lower()
    # What may be absent goes over the wire as before: protoc puts it into a oneof of its own.
    oneof = " in a oneof" if field.HasField("oneof_index") and not field.proto3_optional else ""
    return f"{label}{field.type_name.removeprefix('.') or kind}{oneof}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--accept", action="store_true", help="add what is new to the baseline")
    accept = parser.parse_args().accept
    now = compile_protos()
    faults = lint(now)
    if BASELINE.exists():
        faults += breaking(FileDescriptorSet.FromString(BASELINE.read_bytes()), now)
    if accept and not faults:
        BASELINE.write_bytes(compile_protos(comments=False).SerializeToString(deterministic=True))
    for line in faults:
        print(line, file=sys.stderr)
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main())
