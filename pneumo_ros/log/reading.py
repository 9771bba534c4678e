# SPDX-License-Identifier: Apache-2.0
"""Reading a session log into arrays: by topic and by channel name, whoever wrote it.

    log = read_log("run.mcap")
    road = log.joint("/road/profile")                    # stamps, names, positions (N, K)
    z = log.select("/rig/displacement", ["sprung_front", "sprung_rear"])
    front = log.pressure("/rig/front/pressure")
    rig = log.config

A log is an MCAP file or a bag folder (split files with metadata.yaml). Decoding is lazy and in
bulk: see :mod:`pneumo_ros.log.records` and :mod:`pneumo_ros.log.layouts`; messages that do not fit are
deserialised one by one by ``rosbags``, with equal results. Nothing here needs ROS.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from mcap.records import Statistics

from pneumo_ros.errors import InputError
from pneumo_ros.log.bags import Part, read_parts
from pneumo_ros.log.decoded import Log
from pneumo_ros.log.records import Records, join
from pneumo_ros.log.topic_data import TopicInfo


def read_log(path: str | Path, topics: Sequence[str] | None = None, since_ns: int = 0) -> Log:
    """Read a log, checking every bound and checksum; a damaged one is refused.

    Parameters
    ----------
    path : an .mcap file, or a bag folder
    topics : keep only these (missing ones are not an error here); None keeps all
    since_ns : log time before which nothing is kept

    Raises
    ------
    InputError
        not a log, another profile, truncated or damaged: with the byte it breaks at and the remedy.
    """
    return assemble(Path(path), read_parts(Path(path), topics, since_ns))


def assemble(path: Path, parts: Sequence[Part]) -> Log:
    """One log of the files that were read.

    Raises
    ------
    InputError
        if a topic was recorded with different definitions.
    """
    found: dict[str, list[tuple[TopicInfo, Records]]] = {}
    for part in parts:
        for info, records in _topics_of(part):
            found.setdefault(info.name, []).append((info, records))
    infos, joined = {}, {}
    for name in sorted(found):
        infos[name], joined[name] = _merged(path, found.pop(name))
    contents = [part.contents for part in parts]
    return Log(
        path=path,
        profile=contents[0].header.profile,
        library=contents[0].header.library,
        topics=infos,
        metadata=tuple(m for c in contents for m in c.metadata),
        attachments=tuple(a for c in contents for a in c.attachments),
        unprotected=any(c.unprotected for c in contents),
        span_ns=_span([c.statistics for c in contents]),
        _records=joined,
    )


def _span(found: Sequence[Statistics | None]) -> tuple[int, int] | None:
    filled = [one for one in found if one is not None and one.message_count]
    if not filled or None in found:
        return None
    return min(one.message_start_time for one in filled), max(one.message_end_time for one in filled)


def _topics_of(part: Part) -> Iterator[tuple[TopicInfo, Records]]:
    for identity, records in part.records.items():
        channel = part.contents.channels[identity]
        schema = part.contents.schemas.get(channel.schema_id)
        yield (
            TopicInfo(
                channel.topic,
                _full_name(schema.name) if schema else "",
                len(records),
                channel.message_encoding,
                schema.encoding if schema else "",
                schema.data.decode("utf-8", "replace") if schema else "",
                channel.metadata.get("offered_qos_profiles", ""),
                channel.metadata.get("topic_type_hash", ""),
            ),
            records,
        )


def _full_name(name: str) -> str:
    parts = name.split("/")
    return f"{parts[0]}/msg/{parts[1]}" if len(parts) == 2 else name


def _merged(path: Path, entries: list[tuple[TopicInfo, Records]]) -> tuple[TopicInfo, Records]:
    infos = [info for info, _ in entries]
    if any((i.type, i.encoding, i.schema) != (infos[0].type, infos[0].encoding, infos[0].schema) for i in infos):
        kinds = ", ".join(sorted({i.type for i in infos}))
        raise InputError(f"recorded with different definitions ({kinds})", where=path, key=infos[0].name)
    records = join([r for _, r in entries])
    first = infos[0]
    qos, type_hash = first.qos, first.type_hash
    merged = TopicInfo(
        first.name, first.type, len(records), first.encoding, first.schema_encoding, first.schema, qos, type_hash
    )
    return merged, records
