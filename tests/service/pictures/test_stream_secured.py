"""Who may watch a stream, and who on the way may not: tokens, cookies and certificates on real sockets."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import json
import logging
import ssl
from collections.abc import AsyncIterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import aiohttp
import pytest
from browser import page
from test_stream_watched import HEIGHT, RATE, WIDTH, draw

from vistel.conference.console import ConsoleConfig, certificate_name
from vistel.conference.display import Display, StreamTls
from vistel.conference.model import Conference, Participant, Site
from vistel.wire.certificates.authority import Authority, read_certificate
from vistel.wire.certificates.errors import CertificateError
from vistel.wire.certificates.server import OWN_VALID, ServerFiles, fingerprint
from vistel.wire.clock import SystemClock
from vistel_cli.run.pages import console_line, pages_of
from vistel_services.renderer.out.outputs import Out, Outputs
from vistel_services.renderer.out.stream import Stream
from vistel_services.serving.address import PageAddress, stream_address, with_certificate

TOKEN = "0123456789abcdef"
NOW = datetime.now(UTC)
REACHED = PageAddress("0.0.0.0", 0, TOKEN)
"""By other machines."""


@pytest.fixture(autouse=True)
def _state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Certificates of its own lie in a folder of the test."""
    monkeypatch.setattr("vistel_services.serving.address.default_state", lambda: tmp_path / "state")


@contextlib.asynccontextmanager
async def streaming(address: PageAddress) -> AsyncIterator[Stream]:
    stream = Stream("tokyo", address, (WIDTH, HEIGHT), RATE, False, SystemClock())
    try:
        await stream.open(NOW)
        yield stream
    finally:
        await stream.close()


def here(stream: Stream) -> str:
    """Its page as this machine finds it."""
    return stream.address.url.replace("0.0.0.0", "127.0.0.1")


def pinned(stream: Stream) -> aiohttp.Fingerprint:
    """What a program checks that has been told the fingerprint."""
    assert stream.address.certificate is not None
    shown = fingerprint(read_certificate(stream.address.certificate.certificate))
    return aiohttp.Fingerprint(bytes.fromhex(shown.replace(":", "")))


def test_a_stream_with_a_token_is_read_by_those_who_show_it_and_by_nobody_else() -> None:
    async def watch() -> None:
        jar = aiohttp.CookieJar(unsafe=True)  # also for addresses
        async with streaming(PageAddress("127.0.0.1", 0, TOKEN)) as stream, aiohttp.ClientSession() as stranger:
            where = here(stream)
            assert TOKEN not in repr(stream.address)
            for path in ("", "watch.js", "stream", f"?token={TOKEN}", f"stream?token={TOKEN}", "stream?token=%00%ff"):
                async with stranger.get(where + path) as answer:
                    assert answer.status == 403, path
                    assert not answer.cookies
            for said in ("Bearer ", "Bearer 0123456789abcdee", TOKEN, "Basic " + TOKEN, "Bearer \xff\udcff"):
                with pytest.raises(aiohttp.WSServerHandshakeError, match="403"):
                    await stranger.ws_connect(f"{where}stream", headers={"Authorization": said})
            for form in ({"token": "0123456789abcdee"}, {"token": ""}, {}, {"other": TOKEN}):
                async with stranger.post(where, data=form) as answer:
                    assert answer.status == 403 and "not the token" in await answer.text()
            async with stranger.post(where, data={"token": TOKEN}, headers={"Origin": "http://evil.example"}) as answer:
                assert answer.status == 403
            async with stranger.post(where, data={"token": "x" * 10_000}) as answer:
                assert answer.status == 413

            async with aiohttp.ClientSession(cookie_jar=jar) as browser:
                async with browser.get(where) as answer:
                    assert answer.status == 403 and "<form" in await answer.text()
                async with browser.post(where, data={"token": TOKEN}, allow_redirects=False) as answer:
                    assert (answer.status, answer.headers["Location"]) == (303, "/")
                    (cookie,) = answer.cookies.values()
                    assert cookie["httponly"] and cookie["samesite"] == "Strict" and not cookie["secure"]
                    assert TOKEN not in str(answer.headers)
                for path in ("", "watch.js"):
                    async with browser.get(where + path) as answer:
                        assert answer.status == 200
                async with browser.ws_connect(f"{where}stream") as connection:
                    assert (await connection.receive_json())["kind"] == "hello"
            shown = {"Authorization": f"Bearer {TOKEN}"}
            async with aiohttp.ClientSession(headers=shown) as program, program.ws_connect(f"{where}stream") as connection:
                assert (await connection.receive_json())["kind"] == "hello"

    asyncio.run(watch())


def test_a_cookie_is_good_after_a_new_start_and_for_no_other_token() -> None:
    async def watch() -> None:
        cookies: dict[str, str] = {}
        async with streaming(PageAddress("127.0.0.1", 0, TOKEN)) as stream, aiohttp.ClientSession() as browser:
            async with browser.post(here(stream), data={"token": f" {TOKEN}\n"}, allow_redirects=False) as answer:
                cookies = {name: cookie.value for name, cookie in answer.cookies.items()}
            port = stream.address.port
        for token, status in ((TOKEN, 200), (TOKEN[::-1], 403)):
            async with (
                streaming(PageAddress("127.0.0.1", port, token)) as stream,
                aiohttp.ClientSession(cookies=cookies) as browser,
                browser.get(here(stream)) as answer,
            ):
                assert answer.status == status

    asyncio.run(watch())


def test_guesses_are_a_line_a_minute_in_the_log_and_no_line_holds_a_token(caplog: pytest.LogCaptureFixture) -> None:
    async def guess() -> None:
        async with streaming(PageAddress("127.0.0.1", 0, TOKEN)) as stream, aiohttp.ClientSession() as stranger:
            for k in range(30):
                await (await stranger.post(here(stream), data={"token": f"guess-{k:012}"})).read()
            async with stranger.post(here(stream), data={"token": TOKEN}, allow_redirects=False) as answer:
                assert answer.status == 303
            await (await stranger.get(f"{here(stream)}?token={TOKEN}")).read()

    with caplog.at_level(logging.DEBUG):
        asyncio.run(guess())
    lines = [r.getMessage() for r in caplog.records]
    assert len([line for line in lines if "event=stream_refused" in line]) == 1
    assert not [line for line in lines if TOKEN in line or "guess-" in line]


def test_beyond_this_machine_a_stream_is_https_with_a_certificate_of_its_own() -> None:
    async def watch() -> None:
        async with streaming(REACHED) as stream:
            assert stream.address.url.startswith("https://")
            shown = {"Authorization": f"Bearer {TOKEN}"}
            async with aiohttp.ClientSession(headers=shown) as program:
                async with program.ws_connect(f"{here(stream)}stream", ssl=pinned(stream)) as connection:
                    assert (await connection.receive_json())["kind"] == "hello"
                with pytest.raises(aiohttp.ServerFingerprintMismatch):
                    await program.get(here(stream), ssl=aiohttp.Fingerprint(hashlib.sha256(b"another").digest()))
                with pytest.raises(aiohttp.ClientConnectorCertificateError):  # no authority has signed it
                    await program.get(here(stream))
            plain = here(stream).replace("https://", "http://")
            async with aiohttp.ClientSession() as stranger:
                with pytest.raises(aiohttp.ClientConnectionError):
                    await stranger.get(plain)
            old = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
            old.check_hostname, old.verify_mode, old.maximum_version = False, ssl.CERT_NONE, ssl.TLSVersion.TLSv1_2
            async with aiohttp.ClientSession() as stranger:
                with pytest.raises(aiohttp.ClientConnectionError):
                    await stranger.get(here(stream), ssl=old)

    asyncio.run(watch())


def test_over_https_the_cookie_is_for_https_and_this_server_alone() -> None:
    async def watch() -> None:
        async with streaming(REACHED) as stream, aiohttp.ClientSession() as browser:
            tls = pinned(stream)
            async with browser.post(here(stream), data={"token": TOKEN}, allow_redirects=False, ssl=tls) as answer:
                ((name, cookie),) = answer.cookies.items()
            assert name.startswith("__Host-") and cookie["secure"] and cookie["httponly"] and cookie["path"] == "/"
            assert not cookie["domain"]
            async with browser.get(here(stream), headers={"Cookie": f"{name}={cookie.value}"}, ssl=tls) as answer:
                assert answer.status == 200

    asyncio.run(watch())


def test_a_named_certificate_is_shown_and_its_name_is_answered(tmp_path: Path) -> None:
    issued = Authority.create(tmp_path / "certs", NOW).issue("hub", NOW, hosts=["127.0.0.1", "tokyo.example.org"])
    shown = Display(stream="0.0.0.0:0", stream_token=TOKEN, stream_tls=StreamTls(certificate=issued.certificate, key=issued.key))
    address = stream_address(shown)
    assert address is not None

    async def watch() -> None:
        tls = ssl.create_default_context(cafile=issued.ca)
        async with streaming(address) as stream, aiohttp.ClientSession(connector=aiohttp.TCPConnector(ssl=tls)) as browser:
            async with browser.get(here(stream)) as answer:  # the name is checked
                assert answer.status == 403 and "<form" in await answer.text()
            for host, text in (("tokyo.example.org", "<form"), ("evil.example", "its own page only")):
                async with browser.get(here(stream), headers={"Host": host}) as answer:
                    assert text in await answer.text()

    asyncio.run(watch())
    assert not (tmp_path / "state").exists()


def test_plain_http_beyond_this_machine_has_to_be_meant(caplog: pytest.LogCaptureFixture) -> None:
    meant = stream_address(Display(stream="0.0.0.0:0", stream_token=TOKEN, stream_insecure=True))
    assert meant is not None

    async def watch() -> None:
        async with streaming(meant) as stream, aiohttp.ClientSession() as browser, browser.get(here(stream)) as answer:
            assert answer.url.scheme == "http" and answer.status == 403

    asyncio.run(watch())
    assert "event=plain_http" in caplog.text


def test_without_a_certificate_that_can_be_kept_nothing_is_served_and_one_line_says_why(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "state").touch()  # no folder
    named = ServerFiles(tmp_path / "none.pem", tmp_path / "none.key")

    async def try_it(address: PageAddress) -> None:
        with pytest.raises(CertificateError):
            async with streaming(address):
                pass
        outputs = Outputs("tokyo", Out(stream=address))
        await outputs.open((WIDTH, HEIGHT), RATE, SystemClock())
        await outputs.close()

    for address, why in ((REACHED, "stream_insecure = true"), (PageAddress("0.0.0.0", 0, TOKEN, named), "No such file")):
        caplog.clear()
        asyncio.run(try_it(address))
        (line,) = [r.getMessage() for r in caplog.records if r.levelno >= logging.WARNING]
        assert "event=no_stream" in line and why in line


def test_its_own_certificate_is_the_same_at_every_start_until_it_nears_its_end(tmp_path: Path) -> None:
    def kept(now: datetime, folder: str = "a") -> tuple[str, Path]:
        files = with_certificate(REACHED, "tokyo", now, tmp_path / folder).certificate
        assert files is not None
        return fingerprint(read_certificate(files.certificate)), files.key

    first, key = kept(NOW)
    assert key.stat().st_mode & 0o077 == 0 and key.parent.stat().st_mode & 0o077 == 0
    assert kept(NOW + timedelta(days=300))[0] == first
    assert kept(NOW, "another machine")[0] != first
    assert kept(NOW + OWN_VALID - timedelta(days=20))[0] != first
    for harm in (lambda: key.write_bytes(b"no certificate"), lambda: key.chmod(0o644), key.unlink):
        before = kept(NOW)[0]
        harm()
        assert kept(NOW)[0] != before


def test_the_fingerprint_is_printed_with_the_address_that_shows_it() -> None:
    own, plain = (
        Site(name=name, participants=[Participant(name=f"of_{name}")], display=display)
        for name, display in (("tokyo", Display(stream="192.168.1.7:8090", stream_token=TOKEN)), ("paris", Display(stream="8090")))
    )
    printed = pages_of([own, plain], NOW)
    certificate = with_certificate(PageAddress("192.168.1.7", 8090, TOKEN), "tokyo", NOW).certificate
    assert certificate is not None
    shown = fingerprint(read_certificate(certificate.certificate))
    assert printed == {"tokyo": f"https://192.168.1.7:8090/  certificate SHA-256 {shown}", "paris": "http://127.0.0.1:8090/"}


def test_the_consoles_fingerprint_is_printed_too() -> None:
    def printed(console: ConsoleConfig) -> str:
        site = Site(name="tokyo", participants=[Participant(name="aiko")])
        return console_line(Conference(name="demo", sites=[site], console=console), NOW)["console"]

    certificate = with_certificate(REACHED, certificate_name("demo"), NOW).certificate
    assert certificate is not None
    shown = fingerprint(read_certificate(certificate.certificate))
    assert f"  certificate SHA-256 {shown}" in printed(ConsoleConfig(at="0.0.0.0:8440", token=TOKEN))
    assert "SHA-256" not in printed(ConsoleConfig(at="8440"))


def test_in_a_browser_the_token_is_typed_once_and_the_picture_comes_decoded(tmp_path: Path) -> None:
    async def watch() -> None:
        clock = SystemClock()
        # As if somebody had compared the fingerprint, and gone on.
        async with page(tmp_path, "--ignore-certificate-errors") as tab, streaming(REACHED) as stream:
            drawing = asyncio.create_task(draw(stream, clock))
            await tab.open(here(stream))
            await tab.until("document.querySelector('input[name=token]') !== null")
            await tab.value(f"document.querySelector('input[name=token]').value = {json.dumps(TOKEN)}")
            await tab.click("button[type=submit]")
            await tab.until("document.getElementById('state')?.textContent.includes('ms old')")
            assert await tab.value("location.href") == here(stream)
            assert await tab.value("isSecureContext && 'VideoDecoder' in window")
            assert await tab.value("document.cookie") == ""
            assert {r.form for r in stream._readers} == {"h264"}
            drawing.cancel()

    asyncio.run(watch())
