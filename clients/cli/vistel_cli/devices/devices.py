"""`vistel devices`: the ports of this machine and the devices on them."""

import asyncio
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE
from vistel_cli.terminal import FAILED, load_conference, out

_BAUDS = (115200, 38400, 19200, 9600)


def devices(
    as_json: Annotated[bool, typer.Option("--json", help="Print the list as JSON.")] = False,
    probe: Annotated[
        list[str] | None,
        typer.Option(help="Identify the device on this serial port; repeatable. No conference may be using the port."),
    ] = None,
    watch: Annotated[
        Path | None,
        Takes(CONFERENCE),
        typer.Option(help="Show live values of the trackers and gloves of this conference file. No conference may be using them."),
    ] = None,
    seconds: Annotated[float, typer.Option(help="Watch for so long; 0: until Ctrl-C.")] = 0.0,
) -> None:
    """List cameras, and the serial ports and HID devices that may be trackers or gloves.

    --probe and --watch also show each device's firmware and rate.

    [bold]Example[/bold]

      vistel devices
      vistel devices --probe /dev/ttyUSB0
      vistel devices --watch conference.toml
    """
    if watch is not None:
        from vistel_cli.devices.watch import watch_devices

        asyncio.run(watch_devices(load_conference(watch), seconds, as_json=as_json))
        return
    if probe:
        answers = asyncio.run(_probed(probe))
        _show(answers, as_json)
        if any("firmware" not in answer for answer in answers):
            raise typer.Exit(FAILED)
        return
    found = _serial() + _hid() + _video()
    if not found and not as_json:
        out.print('No serial port, no HID device and no camera here. Devices with port = "sim" are simulated.')
        return
    _show(found, as_json)


def _show(found: list[dict[str, Any]], as_json: bool) -> None:
    if as_json:
        out.print_json(data=found)
        return
    columns = [c for c in ("port", "kind", "description", "firmware", "rate") if any(c in row for row in found)]
    table = Table(*columns)
    for row in found:
        table.add_row(*(row.get(c, "") for c in columns))
    out.print(table)


async def _probed(ports: list[str]) -> list[dict[str, Any]]:
    """The device that answers on each port, tried at the baud rates of trackers and gloves."""
    return [{"port": port, "kind": "serial"} | await _answer(port) for port in ports]


async def _answer(port: str) -> dict[str, str]:
    from vistel.devices.transport import TransportError
    from vistel.devices.transport.serial_port import open_serial
    from vistel.wire.clock import SystemClock
    from vistel_services.devices.describe import describe
    from vistel_services.devices.device import Link
    from vistel_services.devices.probe import who_answers

    clock = SystemClock()
    link = Link(clock)
    try:
        transport = open_serial(port, _BAUDS[0], clock)(lambda data, t_ns: link.arrived(data, 0), link.lose)
    except TransportError as e:
        return {"description": str(e)}
    link.attach(transport)
    try:
        for baud in _BAUDS:
            link.set_baud(baud)
            if (kind := await who_answers(link)) is not None:
                about = await describe(link, kind)
                return {"description": f"{kind.title}, {baud} baud", "firmware": about.firmware, "rate": about.rate}
    except TransportError as e:
        return {"description": str(e)}
    finally:
        transport.close()
    return {"description": "no known device answers"}


def _serial() -> list[dict[str, Any]]:
    from serial.tools import list_ports

    return [{"port": p.device, "kind": "serial", "description": p.description or ""} for p in list_ports.comports()]


def _hid() -> list[dict[str, Any]]:
    import hid

    return [
        {
            "port": d["path"].decode(errors="replace"),
            "kind": f"HID {d['vendor_id']:04x}:{d['product_id']:04x}",
            "description": d["product_string"] or "",
        }
        for d in hid.enumerate()
    ]


def _video() -> list[dict[str, Any]]:
    """Cameras, where the system lists them (Linux)."""
    return [
        {"port": f"/dev/{node.name}", "kind": "camera", "description": (node / "name").read_text().strip()}
        for node in sorted(Path("/sys/class/video4linux").glob("video*"))
    ]
