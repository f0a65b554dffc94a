"""Copies the avatars of a log to the avatar folder, so that a replay needs none of their source files."""

from pathlib import Path

from vistel.conference.avatar_files import keep_parcel, kept_parcel, parcel_path
from vistel.conference.model import Conference
from vistel.wire.log import LogReader
from vistel.wire.parcels import Parcels, is_digest


def with_recorded_avatars(conference: Conference, reader: LogReader) -> Conference:
    """The conference with the participants' own avatars as the log (or the avatar folder) has them."""
    parcels = Parcels()
    found: dict[str, Path] = {}
    for record in reader.records(topics=("avatar_part", "participant")):
        if record.topic.name == "participant":
            digest = record.message.parcel
            if is_digest(digest):
                found[record.names["participant"]] = parcel_path(digest)
            continue
        digest = record.names["digest"]
        whole = parcels.take(record.names["site"], digest, record.names["part"], record.message)
        if whole is not None and kept_parcel(digest) is None:
            keep_parcel(digest, whole)
    data = conference.model_dump(mode="json", exclude_none=True)
    for participant in (p for site in data["sites"] for p in site["participants"]):
        path = found.get(participant["name"])
        if path is not None and path.is_file():
            participant["avatar"] = str(path)
    return Conference.model_validate(data)
