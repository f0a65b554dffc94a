"""The files of the console's page. Its script is made at set-up from clients/web/console; everything else works without it."""

from importlib import resources

BUNDLE = "console.js"
GUEST_BUNDLE = "join.js"
"""Of the page for guests; made with the other."""
OF_BOTH = ("labels.css", "chat.css", "connection.js", "microphone.js", "player.js")
"""What both pages load: styles; and, when they need it, the worker that holds the connection, and what a microphone is read and
voices are played with, on the browser's thread for sound."""
OF_SCREEN = "screen.js"
"""The worker that encodes what a guest's page shows live."""
OF_PDF = ("pdf.js", "pdf_worker.js")
"""What a guest's page loads to show the pages of a PDF."""
FOLDER = resources.files("vistel_services.console") / "page"


def bundle_missing() -> bool:
    """Whether the page's script has not been made."""
    return not (FOLDER / BUNDLE).is_file()
