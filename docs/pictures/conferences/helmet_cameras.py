"""What the cameras of a simulated helmet see, and what is found in it: python -m docs.pictures.conferences.helmet_cameras

Makes helmet-cameras.png: above, a speaking face with its marks, the same with a hand before it and in fading light; below,
the eye at three of the nine points, half closed and closed. Green: seen; yellow: guessed from the others.
"""

from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from vistel.arrays import U8
from vistel.figure.face.marks import REST, Expressions
from vistel.protocol.live_link_face import CHANNELS
from vistel.vision.eye_reader import EyeReader
from vistel.vision.face_calibration import calibrate_face
from vistel.vision.face_reader import FaceReader
from vistel.vision.gaze_calibration import GAZE_TARGETS, calibrate_gaze
from vistel_sim.phone import talking
from vistel_sim.pictures.eye import HEIGHT, WIDTH, EyePicture
from vistel_sim.pictures.face import FacePicture, View
from vistel_sim.pictures.noise import light_at

OUT = Path(__file__).with_name("helmet-cameras.png")
SEEN, GUESSED, TEXT = (40, 255, 60), (0, 220, 255), (255, 255, 255)
COLUMN = 360


def faces() -> list[U8]:
    """Three pictures with the marks found drawn in."""
    painter, expressions = FacePicture(5), Expressions(CHANNELS)
    reader = FaceReader(calibrate_face([painter.draw(REST, k) for k in range(10)]))
    views = {40: View(), 70: View(covers=((375.0, 290.0, 62.0),)), 100: View(gains=light_at(2.0, 6.0))}
    out: list[U8] = []
    view = View()
    for k in range(101):
        view = next((v for at, v in views.items() if k <= at), view)
        picture = painter.draw(expressions.marks(talking(1.2 + k / 60)), k, view)
        reading = reader.read(picture, 1 / 60)
        if k in views:
            for at, seen in zip(reading.pixels, reading.seen, strict=True):
                colour = SEEN if seen else GUESSED
                cv2.circle(picture, tuple(int(v) for v in np.rint(16 * at)), 16 * 14, colour, 2, cv2.LINE_AA, 4)
            out.append(np.asarray(cv2.resize(picture, (COLUMN, 3 * COLUMN // 4), interpolation=cv2.INTER_AREA), np.uint8))
    return out


def eyes() -> list[U8]:
    """Five pictures with pupil, gaze and opening."""
    eye = EyePicture(4)
    pupils, heights = [], []
    for n, target in enumerate(GAZE_TARGETS):
        reader = EyeReader()
        readings = [reader.read(eye.draw(target, 1.0, 20 * n + k)) for k in range(8)]
        pupils.append(np.array([r.pupil.centre for r in readings if r.pupil]).reshape(-1, 2))
        heights += [r.opening_px for r in readings if r.pupil]
    reader = EyeReader(calibrate_gaze(pupils, GAZE_TARGETS, (WIDTH, HEIGHT), float(np.median(heights))))
    out: list[U8] = []
    for k, (target, opening) in enumerate(((0, 1.0), (4, 1.0), (5, 1.0), (4, 0.45), (4, 0.0))):
        grey = eye.draw(GAZE_TARGETS[target], opening, k)
        reading = reader.read(grey)
        picture = cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR)
        if reading.pupil is not None:
            p = reading.pupil
            box = (tuple(p.centre), tuple(2.0 * p.axes), float(np.degrees(p.angle)))
            cv2.ellipse(picture, box, SEEN, 2, cv2.LINE_AA)
        said = "no gaze" if reading.gaze is None else "gaze {:+.0f}, {:+.0f} deg".format(*(np.rint(np.degrees(reading.gaze)) + 0.0))
        cv2.putText(
            picture,
            f"{said}   opening {reading.opening:.2f}",
            (8, HEIGHT - 12),
            cv2.FONT_HERSHEY_SIMPLEX,
            0.5,
            TEXT,
            1,
            cv2.LINE_AA,
        )
        out.append(np.asarray(cv2.resize(picture, (3 * COLUMN // 5, 9 * COLUMN // 20), interpolation=cv2.INTER_AREA), np.uint8))
    return out


def main() -> None:
    sheet = Image.fromarray(np.vstack((np.hstack(faces()), np.hstack(eyes())))[..., ::-1])
    sheet.save(OUT, optimize=True)
    print(OUT)


if __name__ == "__main__":
    main()
