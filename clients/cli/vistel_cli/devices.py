"""`vistel devices`: the ports of this machine and what hangs on them."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from rich.table import Table

from vistel_cli.terminal import out


def devices(as_json: Annotated[bool, typer.Option("--json", help="Print the list as JSON.")] = False) -> None:
    """List serial ports and HID devices a tracker or glove can be on.

    [bold]Example[/bold]

      vistel devices
    """
    found = _serial() + _hid()
    if as_json:
        out.print_json(data=found)
        return
    if not found:
        out.print('No serial port and no HID device here. Devices with port = "sim" are simulated.')
        return
    table = Table("port", "kind", "description")
    for row in found:
        table.add_row(row["port"], row["kind"], row["description"])
    out.print(table)


def _serial() -> list[dict[str, Any]]:
    from serial.tools import list_ports  # noqa: PLC0415

    return [{"port": p.device, "kind": "serial", "description": p.description or ""} for p in list_ports.comports()]


def _hid() -> list[dict[str, Any]]:
    import hid  # noqa: PLC0415

    return [
        {
            "port": d["path"].decode(errors="replace"),
            "kind": f"HID {d['vendor_id']:04x}:{d['product_id']:04x}",
            "description": d["product_string"] or "",
        }
        for d in hid.enumerate()
    ]
