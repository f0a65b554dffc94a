"""Runs in the detectors' own environment: python detect.py FOLDER.

FOLDER/frames.json lists pictures: {"file", "wants", "hands": squares (x, y, side) [pixels]}. FOLDER/found.json says by file:
near, far: faces of the short-range and of the full-range model, each (score, x, y, w, h); pose: 33 landmarks (x, y, visibility);
hands: whether one is in each square; hands_whole: the middles (x, y) of those in the whole picture. All places in pixels.
"""

import json
import sys
from pathlib import Path

import mediapipe
import numpy as np
from PIL import Image

LEAST = 0.05
"""Least score of a face that is told."""
SURE = 0.5
"""Least score of a face or hand that counts as found: MediaPipe's own default."""


def main() -> None:
    folder = Path(sys.argv[1])
    tools = mediapipe.solutions
    near, far = (tools.face_detection.FaceDetection(min_detection_confidence=LEAST, model_selection=k) for k in (0, 1))
    pose = tools.pose.Pose(static_image_mode=True, model_complexity=1)
    hands = tools.hands.Hands(static_image_mode=True, max_num_hands=6, min_detection_confidence=SURE)
    found = {}
    for frame in json.loads((folder / "frames.json").read_text("utf-8")):
        picture = np.asarray(Image.open(folder / frame["file"]).convert("RGB"))
        wants = frame["wants"]
        told = found[frame["file"]] = {}
        if "near" in wants:
            told["near"] = faces(near, picture)
        if "far" in wants:
            told["far"] = faces(far, picture)
        if "pose" in wants:
            told["pose"] = landmarks(pose, picture)
        if "hands" in wants:
            told["hands"] = [bool(hands.process(square_of(picture, *s)).multi_hand_landmarks) for s in frame["hands"]]
            told["hands_whole"] = middles(hands, picture)
    (folder / "found.json").write_text(json.dumps(found), "utf-8")


def faces(detector, picture):
    height, width = picture.shape[:2]
    boxes = [(d.score[0], d.location_data.relative_bounding_box) for d in detector.process(picture).detections or ()]
    return [(s, b.xmin * width, b.ymin * height, b.width * width, b.height * height) for s, b in boxes]


def landmarks(detector, picture):
    height, width = picture.shape[:2]
    told = detector.process(picture).pose_landmarks
    return [(p.x * width, p.y * height, p.visibility) for p in told.landmark] if told else []


def middles(detector, picture):
    height, width = picture.shape[:2]
    told = detector.process(picture).multi_hand_landmarks or ()
    places = [np.mean([(p.x * width, p.y * height) for p in hand.landmark], axis=0) for hand in told]
    return [tuple(map(float, place)) for place in places]


def square_of(picture, x, y, side):
    """A square of the picture, grey where it leaves it."""
    out = np.full((side, side, 3), 128, np.uint8)
    top, left = max(0, y), max(0, x)
    inside = picture[top : max(0, y + side), left : max(0, x + side)]
    out[top - y : top - y + inside.shape[0], left - x : left - x + inside.shape[1]] = inside
    return out


if __name__ == "__main__":
    main()
