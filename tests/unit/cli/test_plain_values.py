"""Words of a command line are taken as they are, and everything else is converted as typer converts it."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Annotated, Any

import pytest
import typer
from typer import BadParameter

from vistel_cli.plain_values import take_plain_values


def taken(line: str) -> dict[str, Any]:
    """What a command gets."""
    got: dict[str, Any] = {}
    app = typer.Typer(add_completion=False)

    @app.command()
    def command(  # pyright: ignore[reportUnusedFunction]
        names: list[str],
        title: str = "none",
        tag: Annotated[list[str] | None, typer.Option()] = None,
        count: int = 3,
        share: Annotated[float, typer.Option(min=0.0, max=1.0)] = 0.5,
        file: Path | None = None,
    ) -> None:
        got.update(names=names, title=title, tag=tag, count=count, share=share, file=file)

    made: Any = typer.main.get_command(app)
    for parameter in made.params:
        take_plain_values(parameter)
    made.main(line.split(), standalone_mode=False)
    return got


def test_words_and_defaults_stay_as_they_are() -> None:
    got = taken("red box --title mine")
    assert got == {"names": ["red", "box"], "title": "mine", "tag": None, "count": 3, "share": 0.5, "file": None}


def test_other_values_are_converted() -> None:
    got = taken("x --tag a --tag b --count 7 --share 0.25 --file a.toml")
    assert got == {"names": ["x"], "title": "none", "tag": ["a", "b"], "count": 7, "share": 0.25, "file": Path("a.toml")}


@pytest.mark.parametrize("line", ["x --count many", "x --share 2"])
def test_what_is_no_such_value_is_refused(line: str) -> None:
    with pytest.raises(BadParameter):
        taken(line)


def test_ask_loads_neither_pydantic_nor_the_data_of_packages(tmp_path: Path) -> None:
    script = "import sys; from vistel_cli.main import app\ntry: app()\nexcept SystemExit: print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script, "ask", "create", "red", "box"],
        env=os.environ | {"XDG_RUNTIME_DIR": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert "no conference" in done.stderr
    assert "vistel.session.asking" in done.stdout.split()
    assert {"pydantic", "importlib.metadata", "numpy"}.isdisjoint(done.stdout.split())
