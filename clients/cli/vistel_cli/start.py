"""Entry point of the `vistel` command: Ctrl-C ends it without a word while what it is made of still loads."""

import signal


def main() -> None:
    """As `vistel_cli.main.main`."""
    before = signal.signal(signal.SIGINT, signal.SIG_DFL)
    from vistel_cli.waiting import command_begins

    command_begins()
    from vistel_cli.main import main as run

    signal.signal(signal.SIGINT, before)
    run()
