"""Saves what a site shows, read from memory while a conference runs: python read_pictures.py demo tokyo picture.png

The site's section of the conference file holds `shared_memory = true`.
"""

import sys
import time

from PIL import Image

from vistel.wire.shared_pictures import PictureReader, shared_path

if len(sys.argv) != 4:
    sys.exit("usage: python read_pictures.py CONFERENCE SITE PICTURE.png, by the names in the conference file")
conference, site, output = sys.argv[1:]
try:
    reader = PictureReader(shared_path(conference, site))
except FileNotFoundError as e:
    sys.exit(f"{e.filename}: is not there; is {conference} running, with shared_memory = true in the display of {site}?")
until = time.monotonic() + 10.0
while (picture := reader.newest()) is None:
    if reader.gone or time.monotonic() > until:
        sys.exit(f"{reader.path}: no picture comes")
    time.sleep(0.005)
Image.fromarray(picture.rgba[..., :3]).save(output)
print(f"picture {picture.number}, drawn at {picture.t_ns / 1e9:.3f} s of conference time, is in {output}")
