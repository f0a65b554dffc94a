"""The drivers of the built-in kinds of phones and cameras that see faces and eyes (`DeviceKind.driver`)."""

from functools import partial
from pathlib import Path

from vistel.capture.live_link_frames import LiveLinkDecoder
from vistel.conference.device_list import Device
from vistel.conference.devices import CameraConfig, EyeConfig, FaceConfig
from vistel.devices.transport.camera import CameraSource, open_camera
from vistel.vision.camera_frames import GazeReader, MarksReader, PictureReader
from vistel.vision.face_calibration import read_face
from vistel.vision.gaze_calibration import read_gaze
from vistel.wire.topics import BY_NAME
from vistel_services.devices.sender_driver import SenderDriver
from vistel_services.devices.service import Connected, udp_opener
from vistel_services.face.camera import CameraDriver


def live_link(device: Device, link: Path | None) -> Connected:
    """A phone that runs Live Link Face."""
    port = 0 if device.simulated else int(device.port)
    decoder = LiveLinkDecoder(device.name)
    missing = f"no phone with a face in its picture sends to UDP port {port}"
    driver = SenderDriver(
        device.name,
        BY_NAME["face"],
        decoder,
        "Live Link Face",
        missing,
        lambda: f"Live Link Face on {decoder.subject or 'a phone'}",
    )
    return Connected(driver, udp_opener(device, link))


def face_camera(device: Device, link: Path | None) -> Connected:
    """A camera that sees the marks on a face."""
    keys = device.config_as(FaceConfig)
    calibration = None if keys.calibration is None else read_face(keys.calibration)
    return _camera(device, link, MarksReader(calibration, mirrored=keys.mirrored), "a face camera")


def eye_camera(device: Device, link: Path | None) -> Connected:
    """A camera that sees one eye."""
    keys = device.config_as(EyeConfig)
    calibration = None if keys.calibration is None else read_gaze(keys.calibration)
    return _camera(device, link, GazeReader(calibration), f"a camera at the {keys.eye} eye")


def _camera(device: Device, link: Path | None, reader: PictureReader, about: str) -> Connected:
    keep = device.config_as(CameraConfig).keep_pictures
    source = CameraSource(announce=link) if device.simulated else CameraSource(device.port)
    driver = CameraDriver(device.name, reader, about)
    return Connected(driver, partial(open_camera, source, driver.decoder.look, keep=keep), keeps_raw=keep)
