"""What finds landmarks in the pictures of a guest's camera, in their browser: the files of npm's @mediapipe/holistic, with the
worker that runs them. Set-up copies them beside the page (clients/web/build.mjs); without them the page offers other ways."""

from aiohttp import web

from vistel_services.console.bundle import FOLDER

PATH = "/landmarks/{file}"
_KINDS = {".js": "text/javascript", ".wasm": "application/wasm"}
_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-cache",  # browsers ask, and are told that they have it
    "Content-Security-Policy": "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; connect-src 'self'",
}
"""A worker has the policy that its own script comes with: it may compile WebAssembly, which the page may not."""


async def landmarks(request: web.Request) -> web.StreamResponse:
    """One of the files. Raises 404 for another, and where they are not there."""
    folder, name = FOLDER / "landmarks", request.match_info["file"]
    found = next((file for file in folder.iterdir() if file.name == name), None) if folder.is_dir() else None
    if found is None:
        raise web.HTTPNotFound(text=f"{name} is not there\n")
    kind = _KINDS.get(name[name.rfind(".") :], "application/octet-stream")
    return web.FileResponse(str(found), headers=_HEADERS | {"Content-Type": kind})
