#!/usr/bin/env python3
"""Holds logs and their successors against each other with the PyPI library `mcap`.

usage: independent_reader.py INPUT OUTPUT [INPUT OUTPUT]...

Prints what it found. Exits with 1 on any difference in the old messages (schema, channel, times,
sequence, data), attachments or metadata, whichever way they are read; CRCs are checked.
"""

import collections
import contextlib
import io
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


def compare(old_path, new_path):
    """Prints what differs, and returns how much does."""
    differences = 0
    lost = definitions(old_path) - definitions(new_path)
    print(f"schemas and channels: {len(definitions(old_path))} old, {len(lost)} lost")
    differences += len(lost)
    # Each way of reading must show what it showed before; a scan shows all that there is.
    for reader_type in (NonSeekingReader, SeekingReader):
        new = contents(new_path, reader_type)
        try:
            old = contents(old_path, reader_type)
        except KeyError as error:
            # a summary that leaves out schemas or channels stops this reader
            print(f"{reader_type.__name__}: can't read the old: KeyError {error}")
            old = contents(old_path, NonSeekingReader)
        for kind, was in old.items():
            lost, added = was - new[kind], new[kind] - was
            differences += lost.total()
            print(f"{reader_type.__name__}: {kind}: {was.total()} old, {lost.total()} lost, {added.total()} added")
            if kind == "messages":
                topics = collections.Counter(channel[1] for _, channel, _ in added.elements())
                for topic, count in sorted(topics.items()):
                    print(f"  {topic}: {count} new messages")
                if not added:
                    print("  no new messages")
                    differences += 1
    with open(new_path, "rb") as file:
        summary = SeekingReader(file, validate_crcs=True).get_summary()
    everything = contents(new_path, NonSeekingReader)["messages"].total()
    if summary is not None and summary.statistics.message_count != everything:
        print(f"statistics count {summary.statistics.message_count} messages, found {everything}")
        differences += 1
    return differences


def main(paths):
    wrong = 0
    for old_path, new_path in zip(paths[::2], paths[1::2]):
        text = io.StringIO()
        with contextlib.redirect_stdout(text if len(paths) > 2 else sys.stdout):
            differences = compare(old_path, new_path)
        if differences:
            print(old_path, text.getvalue(), sep="\n")
        wrong += differences
    print("same" if wrong == 0 else f"{wrong} differences")
    return 1 if wrong else 0


if __name__ == "__main__":
    if len(sys.argv) < 3 or len(sys.argv) % 2 == 0:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1:]))
