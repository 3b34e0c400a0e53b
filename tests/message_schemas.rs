//! The descriptors of protobuf messages in the tree are what the `.proto` files beside them say.
//! `TRACKFUSE_UPDATE_SCHEMAS=1` writes them anew.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use trackfuse::log::Encoding;
use trackfuse::publish::Topic;

#[test]
fn every_descriptor_set_is_what_its_proto_file_says() {
    let schemas = Path::new(env!("CARGO_MANIFEST_DIR")).join("schemas");
    let all = [&Topic::FUSED[..], &Topic::USBL].concat();
    let mut names: Vec<String> = Topic::written(&all, Encoding::Protobuf, true)
        .iter()
        .map(|topic| topic.channel("", Encoding::Protobuf).schema_name)
        .collect();
    // what simulated sensors say
    names.push("trackfuse.TrackSample".into());
    names.sort();
    names.dedup();
    assert_eq!(names.len(), 10);
    for name in names {
        let mut compiler = protox::Compiler::new([schemas.join("proto")]).unwrap();
        compiler.include_imports(true).open_file(format!("{}.proto", name.replace('.', "/"))).unwrap();
        let made = compiler.encode_file_descriptor_set();
        let path = schemas.join(format!("protobuf/{name}.binpb"));
        if std::env::var_os("TRACKFUSE_UPDATE_SCHEMAS").is_some() {
            fs::write(&path, &made).unwrap();
        }
        let stored = fs::read(&path).unwrap_or_default();
        assert!(stored == made, "{name} differs; TRACKFUSE_UPDATE_SCHEMAS=1 writes it anew");
    }
}
