"""A log that only holders of a key can read."""

from __future__ import annotations

import shutil
import stat
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat, PublicFormat
from hypothesis import given
from hypothesis import strategies as st

from vistel.log.encryption import EncryptionError, decrypt, encrypt, new_key, public_file

MEETING = Path(__file__).parents[2] / "replay" / "meeting.mcap"


def quiet(share: float) -> None:
    assert 0.0 <= share <= 1.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With the keys of two people, and a log for one of them."""
    made = tmp_path_factory.mktemp("keys")
    for name in ("ann.key", "bob.key"):
        new_key(made / name)
    encrypt(MEETING, made / "log.age", [str(public_file(made / "ann.key"))], quiet)
    return made


def ssh_key(folder: Path) -> tuple[Path, str]:
    key = Ed25519PrivateKey.generate()
    path = folder / "id_ed25519"
    path.write_bytes(key.private_bytes(Encoding.PEM, PrivateFormat.OpenSSH, NoEncryption()))
    return path, key.public_key().public_bytes(Encoding.OpenSSH, PublicFormat.OpenSSH).decode()


def test_the_holder_of_the_key_reads_what_was_written(folder: Path, tmp_path: Path) -> None:
    decrypt(folder / "log.age", tmp_path / "log.mcap", folder / "ann.key", quiet)
    assert (tmp_path / "log.mcap").read_bytes() == MEETING.read_bytes()
    assert b"conference" not in (folder / "log.age").read_bytes()[200:]


def test_nobody_else_reads_it_and_nothing_is_left_behind(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(EncryptionError, match=r"cannot be decrypted with .*bob\.key"):
        decrypt(folder / "log.age", tmp_path / "log.mcap", folder / "bob.key", quiet)
    assert not list(tmp_path.iterdir())


def test_a_private_key_is_for_its_owner_alone(folder: Path) -> None:
    assert stat.S_IMODE((folder / "ann.key").stat().st_mode) == 0o600


def test_keys_of_ssh_and_several_keys_will_do(folder: Path, tmp_path: Path) -> None:
    private, public = ssh_key(tmp_path)
    encrypt(MEETING, tmp_path / "log.age", [public, str(public_file(folder / "bob.key"))], quiet)
    for key in (private, folder / "bob.key"):
        decrypt(tmp_path / "log.age", tmp_path / "log.mcap", key, quiet)
        assert (tmp_path / "log.mcap").read_bytes() == MEETING.read_bytes()


@given(at=st.integers(0, 10**9), by=st.integers(1, 255))
def test_any_byte_that_was_changed_is_noticed(folder: Path, at: int, by: int) -> None:
    data = bytearray((folder / "log.age").read_bytes())
    data[at % len(data)] ^= by
    refused(folder, bytes(data))


@given(length=st.integers(0, 10**9))
def test_a_file_that_was_cut_off_is_noticed(folder: Path, length: int) -> None:
    data = (folder / "log.age").read_bytes()
    refused(folder, data[: length % len(data)])


def refused(folder: Path, data: bytes) -> None:
    (folder / "other.age").write_bytes(data)
    with pytest.raises(EncryptionError):
        decrypt(folder / "other.age", folder / "other.mcap", folder / "ann.key", quiet)
    assert not (folder / "other.mcap").exists()


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        (lambda f: [str(f / "ann.key")], "a private key was given"),
        (lambda f: [(f / "ann.key").read_text().splitlines()[-1]], "^a private key was given"),
        (lambda f: ["nobody.pub"], "nobody.pub: is no public key of age or SSH, and no such file"),
        (lambda f: ["age1nonsense"], "is no public key"),
        (lambda f: ["ssh-rsa nonsense"], "is no public key"),
        (lambda f: [str(MEETING)], "is no file of keys"),
        (lambda f: [], "nobody could read it"),
    ],
)
def test_what_is_no_key_gets_one_line(folder: Path, tmp_path: Path, keys: Callable[[Path], list[str]], said: str) -> None:
    with pytest.raises(EncryptionError, match=said):
        encrypt(MEETING, tmp_path / "log.age", keys(folder), quiet)
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(shutil.which("age") is None, reason="the program age is not installed")
def test_the_program_age_reads_and_writes_the_same_files(folder: Path, tmp_path: Path) -> None:
    key, public = folder / "ann.key", public_file(folder / "ann.key")
    subprocess.run(["age", "-d", "-i", key, "-o", tmp_path / "log.mcap", folder / "log.age"], check=True)
    assert (tmp_path / "log.mcap").read_bytes() == MEETING.read_bytes()
    subprocess.run(["age", "-R", public, "-o", tmp_path / "theirs.age", MEETING], check=True)
    decrypt(tmp_path / "theirs.age", tmp_path / "theirs.mcap", key, quiet)
    assert (tmp_path / "theirs.mcap").read_bytes() == MEETING.read_bytes()
