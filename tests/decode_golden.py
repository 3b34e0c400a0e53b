"""The numbers in decode.rs, by an independent decoder: `pip install mcap mcap-ros1-support mcap-ros2-support`.

Run as `python decode_golden.py DIR`, where DIR is what TRACKFUSE_TEST_DATA names.
"""

import json
import sys
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros1.decoder import DecoderFactory as Ros1DecoderFactory
from mcap_ros2.decoder import DecoderFactory

# (file, topic, which message, counted from 0 in log-time order, fields)
WANTED = [
    ("flight_two_sensors.mcap", "/cub1/pose", 1234, ["header.stamp.sec", "header.stamp.nanosec", "header.frame_id", "pose.position.x", "pose.position.y", "pose.position.z", "pose.orientation.w"]),
    ("flight_two_sensors.mcap", "/gauge/velocity", 77, ["header.stamp.nanosec", "twist.linear.x", "twist.linear.y", "twist.linear.z"]),
    ("flight_two_sensors.mcap", "/beacon/odom", 159, ["header.stamp.nanosec", "child_frame_id", "pose.pose.position.x", "pose.pose.position.z", "pose.covariance[35]", "twist.twist.linear.y", "twist.covariance[0]", "twist.covariance[1]"]),
    ("rosbag2/cdr_test_0.mcap", "/test_topic", 2, ["bool_value", "int32_value", "uint64_value"]),
    ("rosbag2/cdr_test_0.mcap", "/array_topic", 3, ["bool_values[2]", "string_values[2]", "defaults_values[2].uint64_value", "string_values_default[1]", "alignment_check"]),
    ("rosbag2/talker.mcap", "/rosout", 9, ["stamp.sec", "msg", "line"]),
    ("rosbag2/only_topics.mcap", "/parameter_events", 6, ["node", "new_parameters[0].name", "new_parameters[0].value.string_value"]),
    ("others/autoferry_s02.mcap", "/lidar/detections", 200, ["header.frame_id", "poses[0].position.x", "poses[-1].position.y"]),
    ("others/husky_gps_odom_ros1.mcap", "/fix", 499, ["header.seq", "header.stamp.secs", "header.stamp.nsecs", "header.frame_id", "status.status", "latitude", "longitude", "altitude", "position_covariance[8]", "position_covariance_type"]),
    ("others/husky_gps_odom_ros1.mcap", "/husky_velocity_controller/odom", 499, ["header.seq", "header.stamp.nsecs", "pose.pose.position.x", "pose.pose.position.y", "pose.pose.orientation.z", "twist.twist.linear.x"]),
    ("climbs/async_0.mcap", "/tether/track", 100, ["timestamp.nsec", "position.x", "velocity.z"]),
    ("others/nbp1406_rv_palmer.mcap", "/knudsen/depth", 4999, None),
]


def messages(path, topic):
    """The topic's messages, decoded."""
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for _, channel, message in reader.iter_messages(topics=[topic]):
            if channel.message_encoding == "json":
                yield json.loads(message.data)
            else:
                factory = Ros1DecoderFactory() if channel.message_encoding == "ros1" else DecoderFactory()
                schema = reader.get_summary().schemas[channel.schema_id]
                yield factory.decoder_for(channel.message_encoding, schema)(message.data)


def field(value, path):
    """The value at a path such as `poses[0].position.x`."""
    for part in path.replace("[", ".[").split("."):
        if part.startswith("["):
            value = value[int(part[1:-1])]
        else:
            value = value[part] if isinstance(value, dict) else getattr(value, part)
    return value


for name, topic, index, fields in WANTED:
    message = list(messages(Path(sys.argv[1]) / name, topic))[index]
    for path in fields or [key for key, v in message.items() if isinstance(v, (int, float, str))]:
        print(f'("{name}", {index}, "{topic}.{path}", {field(message, path)!r}),')
