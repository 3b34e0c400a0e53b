#!/usr/bin/env python3
"""Reads logs with the tools that their encodings are for.

usage: other_readers.py rosbags LOG    as a bag of ROS 2, by PyPI `rosbags`
       other_readers.py rerun LOG      by PyPI `rerun-sdk`

Prints one JSON object: of `rosbags` type, count and last message of every topic, each message decoded; of `rerun` the
status and the components that it gives every topic. Exits with 77 where the library is not there, with 1 where it complains.
"""

import collections
import dataclasses
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

METADATA = """\
rosbag2_bagfile_information:
  version: 5
  storage_identifier: mcap
  duration: {{nanoseconds: {duration}}}
  starting_time: {{nanoseconds_since_epoch: {start}}}
  message_count: {count}
  topics_with_message_count:
{topics}
  compression_format: ""
  compression_mode: ""
  relative_file_paths: [log.mcap]
  files:
  - path: log.mcap
    starting_time: {{nanoseconds_since_epoch: {start}}}
    duration: {{nanoseconds: {duration}}}
    message_count: {count}
"""

TOPIC = """\
  - topic_metadata: {{name: {topic}, type: {type}, serialization_format: cdr, offered_qos_profiles: ""}}
    message_count: {count}"""


def bag(log, folder):
    """The log in a folder such as `ros2 bag` writes."""
    from mcap.reader import make_reader

    with log.open("rb") as file:
        summary = make_reader(file).get_summary()
    shutil.copy(log, folder / "log.mcap")
    statistics = summary.statistics
    topics = [
        TOPIC.format(
            topic=channel.topic,
            type=summary.schemas[channel.schema_id].name,
            count=statistics.channel_message_counts.get(channel.id, 0),
        )
        for channel in summary.channels.values()
    ]
    text = METADATA.format(
        start=statistics.message_start_time,
        duration=statistics.message_end_time - statistics.message_start_time,
        count=statistics.message_count,
        topics="\n".join(topics),
    )
    (folder / "metadata.yaml").write_text(text)


def plain(value):
    """A message as JSON; of long lists the first and the last."""
    if dataclasses.is_dataclass(value):
        return {f.name: plain(getattr(value, f.name)) for f in dataclasses.fields(value) if f.name != "__msgtype__"}
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, list):
        return {"len": len(value), "items": [plain(v) for v in (value if len(value) < 40 else value[:1] + value[-1:])]}
    return value


def by_rosbags(log):
    from rosbags.highlevel import AnyReader

    found = {}
    with tempfile.TemporaryDirectory() as folder:
        bag(log, pathlib.Path(folder))
        with AnyReader([pathlib.Path(folder)]) as reader:
            for connection, _, data in reader.messages():
                message = reader.deserialize(data, connection.msgtype)
                topic = found.setdefault(connection.topic, {"type": connection.msgtype, "count": 0})
                topic["count"] += 1
                topic["last"] = message
    for topic in found.values():
        topic["last"] = plain(topic["last"])
    return found


def by_rerun(log):
    program = pathlib.Path(sys.executable).with_name("rerun")
    if not program.exists():
        raise ImportError("no rerun")
    with tempfile.TemporaryDirectory() as folder:
        made = pathlib.Path(folder) / "log.rrd"

        def run(*args):
            env = {**os.environ, "DO_NOT_TRACK": "1", "HOME": folder, "NO_COLOR": "1"}
            ran = subprocess.run([program, *args], capture_output=True, text=True, env=env)
            if ran.returncode != 0 or "ERROR" in ran.stderr or "panicked" in ran.stderr:
                sys.exit(f"rerun {args}: {ran.stdout}{ran.stderr}")
            return ran.stdout

        checked = run("mcap", "check", "--full", log)
        run("mcap", "convert", log, "-o", made)
        chunks = run("rrd", "print", "-v", made)
    found = collections.defaultdict(lambda: {"status": None, "components": set()})
    for status, topic in re.findall(r"^(\w+) +\d+ +\d+  (/\S+)", checked, re.M):
        found[topic]["status"] = status
    for topic, columns in re.findall(r"^Chunk.* - (/\S+) - .*data columns: \[(.*)\]", chunks, re.M):
        found[topic]["components"].update(column.rpartition("@")[2] for column in columns.split())
    return {topic: {**of, "components": sorted(of["components"])} for topic, of in found.items()}


def main(kind, log):
    try:
        found = {"rosbags": by_rosbags, "rerun": by_rerun}[kind](pathlib.Path(log))
    except ImportError as error:
        print(error, file=sys.stderr)
        return 77
    print(json.dumps(found))
    return 0


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
