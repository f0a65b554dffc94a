"""Run by the peers' own interpreter: draws a scene that `render_scene` wrote, and says how much processor time a picture takes.

python render_peers.py SCENE.npz WIDTH HEIGHT pyrender|filament|three PICTURE.png

The scene stands still: peers neither pose nor deform nor send vertices. Each reads its picture back, but three.js, which leaves
it in the page. `VISTEL_PEER_THREE`: a folder with node_modules/three. Prints one line of JSON: ms (median of CPU time), name.
"""

# pyright: basic, reportMissingImports=false

import json
import math
import os
import sys
import threading
import time
from collections.abc import Callable
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

os.environ.setdefault("PYOPENGL_PLATFORM", "egl")
os.environ.setdefault("EGL_PLATFORM", "surfaceless")

import numpy as np

WARM, REPEATS = 3, 12


def meshes(scene: Any) -> list[dict[str, Any]]:
    """The meshes of a scene, each with its arrays by name."""
    parts = ("positions", "normals", "uv", "triangles", "texture")
    names = sorted({key.rsplit(".", 1)[0] for key in scene.files if "." in key})
    return [{"name": name} | {part: scene[f"{name}.{part}"] for part in parts} for name in names]


def with_pyrender(scene: Any, width: int, height: int) -> tuple[str, Callable[[], Any]]:
    """Its default: metal-roughness shading, 4 samples a pixel, no shadows; two lights."""
    import pyrender

    world = pyrender.Scene(ambient_light=(0.4, 0.4, 0.4))
    for mesh in meshes(scene):
        opaque = np.full((*mesh["texture"].shape[:2], 1), 255, np.uint8)  # rows of other than 4 bytes it shears
        texture = pyrender.Texture(source=np.concatenate((mesh["texture"], opaque), axis=2), source_channels="RGBA")
        material = pyrender.MetallicRoughnessMaterial(baseColorTexture=texture, metallicFactor=0.0, roughnessFactor=0.8)
        shape = {"positions": mesh["positions"], "normals": mesh["normals"], "texcoord_0": mesh["uv"]}
        primitive = pyrender.Primitive(**shape, indices=mesh["triangles"], material=material)
        world.add(pyrender.Mesh([primitive]))
    pose = np.linalg.inv(scene["view"])
    world.add(pyrender.PerspectiveCamera(yfov=float(scene["field"][0]), aspectRatio=width / height, znear=0.05), pose=pose)
    for turn in (0.5, -0.7):
        light = np.eye(4)
        light[:3, :3] = _turned(turn) @ light[:3, :3]
        world.add(pyrender.DirectionalLight(color=np.ones(3), intensity=2.0), pose=light)
    renderer = pyrender.OffscreenRenderer(width, height)
    return f"pyrender {pyrender.__version__}, 4 samples, 2 lights, no shadows", lambda: renderer.render(world)[0]


def with_filament(scene: Any, width: int, height: int) -> tuple[str, Callable[[], Any]]:
    """Through Open3D: physically based, image-based light and sun, without shadows and postprocessing."""
    import open3d as o3d

    renderer = o3d.visualization.rendering.OffscreenRenderer(width, height)
    renderer.scene.set_lighting(renderer.scene.LightingProfile.SOFT_SHADOWS, (0.3, -0.8, -0.5))
    renderer.scene.scene.set_indirect_light_intensity(40_000)
    renderer.scene.view.set_shadowing(False)
    renderer.scene.view.set_post_processing(False)
    for mesh in meshes(scene):
        shape = o3d.geometry.TriangleMesh(
            o3d.utility.Vector3dVector(mesh["positions"]), o3d.utility.Vector3iVector(mesh["triangles"])
        )
        shape.vertex_normals = o3d.utility.Vector3dVector(mesh["normals"])
        corners = mesh["uv"][mesh["triangles"].reshape(-1)]
        shape.triangle_uvs = o3d.utility.Vector2dVector(corners.astype(np.float64))
        material = o3d.visualization.rendering.MaterialRecord()
        material.shader = "defaultLit"
        material.albedo_img = o3d.geometry.Image(np.ascontiguousarray(mesh["texture"]))
        renderer.scene.add_geometry(mesh["name"], shape, material)
    pose = np.linalg.inv(scene["view"])
    eye, ahead, up = pose[:3, 3], -pose[:3, 2], pose[:3, 1]
    renderer.setup_camera(math.degrees(float(scene["field"][0])), eye + ahead, eye, up)
    name = f"Filament through Open3D {o3d.__version__}, image-based light, no shadows, no postprocessing"
    return name, lambda: np.asarray(renderer.render_to_image())


def _turned(angle: float) -> Any:
    c, s = math.cos(angle), math.sin(angle)
    tilt = np.array([[1, 0, 0], [0, math.cos(-0.8), -math.sin(-0.8)], [0, math.sin(-0.8), math.cos(-0.8)]])
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ tilt


_PAGE = """
import * as T from "three";
const scene = await (await fetch("scene.json")).json();
const bytes = await (await fetch("scene.bin")).arrayBuffer();
const renderer = new T.WebGLRenderer({antialias: false, preserveDrawingBuffer: true});
renderer.setSize(scene.width, scene.height);
renderer.outputColorSpace = T.SRGBColorSpace;
document.body.style.margin = "0";
document.body.appendChild(renderer.domElement);
const world = new T.Scene();
for (const m of scene.meshes) {
  const g = new T.BufferGeometry();
  const floats = (part, size) => new T.BufferAttribute(new Float32Array(bytes, m[part][0], m[part][1]), size);
  g.setAttribute("position", floats("positions", 3));
  g.setAttribute("normal", floats("normals", 3));
  g.setAttribute("uv", floats("uv", 2));
  g.setIndex(new T.BufferAttribute(new Uint32Array(bytes, m.triangles[0], m.triangles[1]), 1));
  const picture = new T.DataTexture(new Uint8Array(bytes, m.texture[0], m.texture[1]), m.size[0], m.size[1]);
  picture.colorSpace = T.SRGBColorSpace;
  picture.generateMipmaps = true;
  picture.magFilter = T.LinearFilter;
  picture.minFilter = T.LinearMipmapLinearFilter;
  picture.needsUpdate = true;
  world.add(new T.Mesh(g, new T.MeshStandardMaterial({map: picture, roughness: 0.8})));
}
const camera = new T.PerspectiveCamera(scene.field, scene.width / scene.height, 0.05, 30);
camera.matrixAutoUpdate = false;
camera.matrix.fromArray(scene.pose);
camera.matrixWorldNeedsUpdate = true;
world.add(new T.HemisphereLight(0xffffff, 0x999999, 2.0));
for (const x of [0.5, -0.7]) {
  const light = new T.DirectionalLight(0xffffff, 1.5);
  light.position.set(x, 1, 0.6);
  world.add(light);
}
const one = new Uint8Array(4), gl = renderer.getContext();
window.draw = count => {
  for (let k = 0; k < count; k++) {
    renderer.render(world, camera);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, one);  // waits until it is drawn
  }
  return T.REVISION;
};
window.ready = true;
"""


def with_three(path: Path, width: int, height: int, picture: Path) -> dict[str, Any]:
    """MeshStandardMaterial in Chromium, which draws by SwiftShader: processor time of all its processes."""
    import tempfile

    import psutil
    from playwright.sync_api import sync_playwright

    three = Path(os.environ["VISTEL_PEER_THREE"]) / "node_modules" / "three" / "build"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _for_page(np.load(path), width, height, folder)
        for file in three.glob("three.*.js"):
            (folder / file.name).write_bytes(file.read_bytes())
        (folder / "page.js").write_text(_PAGE)
        names = '{"imports": {"three": "./three.module.js"}}'
        (folder / "index.html").write_text(
            f'<script type="importmap">{names}</script><script type="module" src="page.js"></script>'
        )

        class Pages(SimpleHTTPRequestHandler):
            def __init__(self, *given: Any) -> None:
                super().__init__(*given, directory=name)

            def log_message(self, *_: Any) -> None:
                pass

        server = ThreadingHTTPServer(("127.0.0.1", 0), Pages)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        with sync_playwright() as play:
            chromium = os.environ.get("CHROMIUM", "/usr/bin/chromium")
            flags = ["--no-sandbox", "--enable-unsafe-swiftshader"]
            browser = play.chromium.launch(executable_path=chromium, args=flags)
            page = browser.new_page(viewport={"width": width, "height": height})
            page.goto(f"http://127.0.0.1:{server.server_port}/")
            page.wait_for_function("window.ready", timeout=120_000, polling=200)
            page.evaluate(f"draw({WARM})")
            its = psutil.Process().children(recursive=True)

            def spent() -> float:
                return sum(sum(p.cpu_times()[:2]) for p in its if p.is_running())

            times = []
            for _ in range(REPEATS):
                begin = spent()
                revision = page.evaluate("draw(4)")
                times.append((spent() - begin) / 4 * 1e3)
            page.screenshot(path=str(picture))
            version = browser.version
            browser.close()
    name = f"three.js r{revision} MeshStandardMaterial, no antialiasing, 3 lights, Chromium {version.split('.')[0]} on SwiftShader"
    return {"ms": sorted(times)[REPEATS // 2], "name": name}


def _for_page(scene: Any, width: int, height: int, folder: Path) -> None:
    blob, listed = bytearray(), []
    for mesh in meshes(scene):
        entry: dict[str, Any] = {"size": [mesh["texture"].shape[1], mesh["texture"].shape[0]]}
        opaque = np.full((*mesh["texture"].shape[:2], 1), 255, np.uint8)
        mesh["texture"] = np.concatenate((mesh["texture"], opaque), axis=2)[::-1]
        kinds = {"positions": np.float32, "normals": np.float32, "uv": np.float32, "triangles": np.uint32, "texture": np.uint8}
        for part, kind in kinds.items():
            values = np.ascontiguousarray(mesh[part], kind)
            entry[part] = [len(blob), values.size]
            blob += values.tobytes()
            blob += bytes(-len(blob) % 4)
        listed.append(entry)
    (folder / "scene.bin").write_bytes(bytes(blob))
    pose = np.linalg.inv(scene["view"]).T.reshape(-1).tolist()
    told = {"width": width, "height": height, "field": math.degrees(float(scene["field"][0])), "pose": pose, "meshes": listed}
    (folder / "scene.json").write_text(json.dumps(told))


def main() -> None:
    path, width, height, which, picture = sys.argv[1:6]
    out = os.dup(1)
    os.dup2(2, 1)  # some of them chatter
    if which == "three":
        result = with_three(Path(path), int(width), int(height), Path(picture))
    else:
        by = {"pyrender": with_pyrender, "filament": with_filament}[which]
        name, draw = by(np.load(path), int(width), int(height))
        for _ in range(WARM):
            seen = draw()
        times = []
        for _ in range(REPEATS):
            begin = time.process_time()
            seen = draw()
            times.append((time.process_time() - begin) * 1e3)
        from PIL import Image

        Image.fromarray(np.asarray(seen)[..., :3]).save(picture)
        result = {"ms": sorted(times)[REPEATS // 2], "name": name}
    os.write(out, (json.dumps(result) + "\n").encode())
    os._exit(0)  # one of them dies when its renderer goes


if __name__ == "__main__":
    main()
