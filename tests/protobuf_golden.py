"""The bytes in `src/log/decode/protobuf.rs`, by Google's own library: `pip install protobuf`."""

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2

F = descriptor_pb2.FieldDescriptorProto
file = descriptor_pb2.FileDescriptorProto(
    name="fix.proto", package="nav", syntax="proto3", dependency=["google/protobuf/timestamp.proto"]
)
point = file.message_type.add(name="Point")
for number, name in enumerate("xyz", 1):
    point.field.add(name=name, number=number, type=F.TYPE_DOUBLE, label=F.LABEL_OPTIONAL)
file.enum_type.add(name="Kind").value.extend(
    [descriptor_pb2.EnumValueDescriptorProto(name=n, number=v) for n, v in [("RAW", 0), ("SMOOTH", 7)]]
)
fix = file.message_type.add(name="Fix")
entry = fix.nested_type.add(name="TagsEntry")
entry.options.map_entry = True
entry.field.add(name="key", number=1, type=F.TYPE_STRING, label=F.LABEL_OPTIONAL)
entry.field.add(name="value", number=2, type=F.TYPE_SINT32, label=F.LABEL_OPTIONAL)


def add(name, number, kind, label=F.LABEL_OPTIONAL, of=None):
    fix.field.add(name=name, number=number, type=kind, label=label, type_name=of)


add("timestamp", 1, F.TYPE_MESSAGE, of=".google.protobuf.Timestamp")
add("position", 2, F.TYPE_MESSAGE, of=".nav.Point")
add("velocity", 3, F.TYPE_MESSAGE, of=".nav.Point")
add("covariance", 4, F.TYPE_DOUBLE, F.LABEL_REPEATED)
add("kind", 5, F.TYPE_ENUM, of=".nav.Kind")
add("frame_id", 6, F.TYPE_STRING)
add("raw", 7, F.TYPE_BYTES)
add("trail", 8, F.TYPE_MESSAGE, F.LABEL_REPEATED, ".nav.Point")
add("tags", 9, F.TYPE_MESSAGE, F.LABEL_REPEATED, ".nav.Fix.TagsEntry")
add("count", 10, F.TYPE_SFIXED64)

pool = descriptor_pool.DescriptorPool()
stamp_file = descriptor_pb2.FileDescriptorProto()
timestamp_pb2.DESCRIPTOR.CopyToProto(stamp_file)
stamp_file.ClearField("options")
pool.Add(stamp_file)
pool.Add(file)
message = message_factory.GetMessageClass(pool.FindMessageTypeByName("nav.Fix"))()
message.timestamp.seconds, message.timestamp.nanos = 1731000000, 250000000
message.position.x, message.position.z = 1.5, -40.25
message.covariance.extend([0.1, 0.0, 1e300])
message.kind, message.frame_id, message.raw, message.count = 7, "enü", b"\x00\xff", -3
message.trail.add(y=2.0)
message.trail.add()
message.tags["b"], message.tags["a"] = -5, 6
print(descriptor_pb2.FileDescriptorSet(file=[stamp_file, file]).SerializeToString().hex())
print(message.SerializeToString(deterministic=True).hex())
