# SPDX-License-Identifier: Apache-2.0
"""Write a log that is in memory to an MCAP file: repaired logs, replayed outputs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from mcap.writer import Writer

from pneumo_ros import __version__
from pneumo_ros.errors import InputError
from pneumo_ros.files import new_file
from pneumo_ros.log.bags import PROFILE
from pneumo_ros.log.decoded import Log

CHUNK_BYTES = 192 * 1024  # as the recorder's


def refuse_target(output: Path, source: Path | None = None, overwrite: bool = False) -> None:
    """Refuse an output that would destroy something.

    Raises
    ------
    InputError
        if it is the source itself, lies in the source's folder under its name, or exists already.
    """
    if source is not None and output.exists() and source.exists() and output.samefile(source):
        raise InputError("output is the input itself", where=output, remedy="choose another name")
    if output.exists() and not overwrite:
        raise InputError("the file exists already", where=output, remedy="choose another name, or give --overwrite")
    if not output.parent.is_dir():
        raise InputError("no such folder", where=output.parent, remedy="create it first")


def write_log(log: Log, output: Path, extra: Mapping[str, Mapping[str, str]] | None = None) -> int:
    """Write every message, metadata record and attachment; returns the number of messages.

    Parameters
    ----------
    log : to be written, in log-time order
    output : final name; nothing stands there before the file is complete
    extra : further metadata records, name -> entries

    Raises
    ------
    InputError
        if the file cannot be written.
    """
    try:
        with new_file(output) as part, part.open("wb") as stream:
            writer = Writer(stream, chunk_size=CHUNK_BYTES, enable_data_crcs=True)
            writer.start(PROFILE, f"pneumo_ros {__version__}")
            _write_messages(writer, log)
            for attachment in log.attachments:
                writer.add_attachment(
                    attachment.create_time, attachment.log_time, attachment.name, attachment.media_type, attachment.data
                )
            for record in log.metadata:
                writer.add_metadata(record.name, record.metadata)
            for name, entries in (extra or {}).items():
                writer.add_metadata(name, dict(entries))
            writer.finish()
    except OSError as error:
        raise InputError(f"cannot write ({error.strerror})", where=output, remedy="check space and rights") from error
    return sum(info.count for info in log.topics.values())


def _write_messages(writer: Writer, log: Log) -> None:
    names = list(log.topics)
    channels = []
    for name in names:
        info = log.topics[name]
        schema = writer.register_schema(info.type, info.schema_encoding, info.schema.encode()) if info.type else 0
        metadata = {"offered_qos_profiles": info.qos, "topic_type_hash": info.type_hash}
        kept = {key: value for key, value in metadata.items() if value}
        channels.append(writer.register_channel(name, info.encoding, schema, kept))
    records = [log.records(name) for name in names]
    which = np.concatenate([np.full(len(r), i) for i, r in enumerate(records)] or [np.empty(0, int)])
    row = np.concatenate([np.arange(len(r)) for r in records] or [np.empty(0, int)])
    times = np.concatenate([r.log_time_ns for r in records] or [np.empty(0, np.int64)])
    for i in np.argsort(times, kind="stable").tolist():
        source, k = records[which[i]], int(row[i])
        writer.add_message(
            channels[which[i]],
            int(source.log_time_ns[k]),
            source.message(k),
            int(source.publish_time_ns[k]),
            int(source.sequence[k]),
        )
