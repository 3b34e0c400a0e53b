//! Bytes as definitions, payloads, message paths and configs.

use std::path::Path;

use trackfuse::config::Config;
use trackfuse::log::decode::{Decoder, MessagePath};

/// The parts of `data` between zero bytes, up to `n` of them; the last holds all the rest.
fn parts(data: &[u8], n: usize) -> Vec<&[u8]> {
    data.splitn(n, |byte| *byte == 0).collect()
}

/// A message definition, a path, and a payload: what a path leads to is the same in a selection as in the whole.
pub fn decode(data: &[u8]) {
    let [definition, path, payload] = parts(data, 3)[..] else { return };
    let Ok(decoder) = Decoder::new("cdr", "ros2msg", "p/msg/T", definition) else { return };
    let whole = decoder.decode(payload);
    let Some(path) = std::str::from_utf8(path).ok().and_then(|path| MessagePath::parse(path).ok()) else {
        return;
    };
    let Ok(selected) = decoder.select(std::slice::from_ref(&path)) else { return };
    let selected = selected.decode(payload);
    if let (Ok(whole), Ok(selected)) = (&whole, &selected) {
        let (a, b) = (path.resolve(whole), path.resolve(selected));
        // NaN is not equal to itself
        assert_eq!(format!("{:?}", a.ok()), format!("{:?}", b.ok()), "{path:?}");
    }
}

/// A path and a JSON payload.
pub fn json(data: &[u8]) {
    let [path, payload] = parts(data, 2)[..] else { return };
    let Ok(decoder) = Decoder::new("json", "", "", b"") else { return };
    let Ok(message) = decoder.decode(payload) else { return };
    let _ = (message.as_vector3(), message.as_stamp(), message.as_f64(), message.as_i64());
    if let Some(path) = std::str::from_utf8(path).ok().and_then(|path| MessagePath::parse(path).ok()) {
        let _ = path.resolve(&message);
    }
}

/// A message path: what is read from what was written is the same.
pub fn path(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    match MessagePath::parse(text) {
        Ok(path) => {
            let written = path.to_string();
            assert_eq!(MessagePath::parse(&written).as_ref(), Ok(&path), "{text:?} became {written:?}");
        }
        Err(error) => assert!(error.at >= 1 && error.at <= text.chars().count() + 1, "{error}"),
    }
}

/// A config.
pub fn config(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    if let Err(error) = Config::parse(text, Path::new("fuzz.toml")) {
        let _ = (error.to_string(), error.hint());
    }
}
