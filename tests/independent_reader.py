#!/usr/bin/env python3
"""Holds a log and its successor against each other with the PyPI library `mcap`.

usage: independent_reader.py INPUT OUTPUT

Prints what it found. Exits with 1 on any difference in the old messages (schema, channel, times,
sequence, data), attachments or metadata, whichever way they are read; CRCs are checked.
"""

import collections
import sys

from mcap.reader import NonSeekingReader, SeekingReader
from mcap.records import Channel, Schema
from mcap.stream_reader import StreamReader


def contents(path, reader_type):
    """Multisets of messages, attachments, metadata records."""
    messages, attachments, metadata = (collections.Counter() for _ in range(3))
    for kind in ("messages", "attachments", "metadata"):
        with open(path, "rb") as file:
            reader = reader_type(file, validate_crcs=True)
            if kind == "messages":
                for schema, channel, message in reader.iter_messages():
                    messages[
                        (
                            (schema.id, schema.name, schema.encoding, schema.data) if schema else None,
                            (channel.id, channel.topic, channel.message_encoding, tuple(channel.metadata.items())),
                            (message.log_time, message.publish_time, message.sequence, message.data),
                        )
                    ] += 1
            elif kind == "attachments":
                for a in reader.iter_attachments():
                    attachments[(a.name, a.media_type, a.log_time, a.create_time, a.data)] += 1
            else:
                for m in reader.iter_metadata():
                    metadata[(m.name, tuple(m.metadata.items()))] += 1
    return {"messages": messages, "attachments": attachments, "metadata records": metadata}


def definitions(path):
    """Schemas and channels of the data section, those without messages too."""
    with open(path, "rb") as file:
        return {repr(record) for record in StreamReader(file).records if isinstance(record, (Schema, Channel))}


def main(old_path, new_path):
    differences = 0
    lost = definitions(old_path) - definitions(new_path)
    print(f"schemas and channels: {len(definitions(old_path))} old, {len(lost)} lost")
    differences += len(lost)
    old = contents(old_path, NonSeekingReader)
    for reader_type in (NonSeekingReader, SeekingReader):
        new = contents(new_path, reader_type)
        for kind, was in old.items():
            lost, added = was - new[kind], new[kind] - was
            differences += lost.total()
            print(f"{reader_type.__name__}: {kind}: {was.total()} old, {lost.total()} lost, {added.total()} added")
            if kind == "messages":
                topics = collections.Counter(channel[1] for _, channel, _ in added.elements())
                for topic, count in sorted(topics.items()):
                    print(f"  {topic}: {count} new messages")
    with open(new_path, "rb") as file:
        statistics = SeekingReader(file, validate_crcs=True).get_summary().statistics
    if statistics.message_count != new["messages"].total():
        print(f"statistics count {statistics.message_count} messages, found {new['messages'].total()}")
        differences += 1
    print("same" if differences == 0 else f"{differences} differences")
    return 1 if differences else 0


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
