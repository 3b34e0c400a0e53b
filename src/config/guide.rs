//! `docs/config.md`, made of the config's JSON Schema, so that it says what the code does.

use std::fmt::Write;
use std::path::Path;

use serde_json::{Map, Value};

use super::Config;
use super::template::{meaning, resolved, sentence};

const HEAD: &str = "# The config

A TOML file for `trackfuse fuse LOG --config FILE`. Every key may be left out; what is left out has the default below. `trackfuse init LOG`
writes a config with the sources of that log and all other keys as comments, and is the way to begin. An unknown key is an error that names the
nearest known one. `fuse` keeps the config in its output, every default resolved, in the metadata record `trackfuse:PREFIX`.

Units stand in the keys: `_m` is metres, `_s` seconds, `_m_s` metres a second, `_hz` hertz, `_ns` nanoseconds, `_rad` radians, `_deg` degrees. Sigmas are one
standard deviation.

```toml
EXAMPLE```

Editors that know [`schemas/config.schema.json`](../schemas/config.schema.json) complete and check the keys: in VS Code with Even Better TOML, say,
by the first line `#:schema ./schemas/config.schema.json`.

A *message path* names a place in a topic's messages, as in Foxglove: `/nav/odom.pose.pose.position`, `/beacons.fixes[0].p`,
`/tf.transforms[:]{child_frame_id==\"rov\"}.transform.translation`; topics with unusual characters stand in quotes.

This page is made from the code: `TRACKFUSE_UPDATE_DOCS=1 cargo test --release --lib config` writes it anew.
";

const EXAMPLE: &str = "[[source]]
name = \"tether\"
position = \"/winch/state.position\"     # message path to an object with x, y, z
velocity = \"/winch/state.velocity\"
datum = true                           # its bias and clock are zero by definition

[[source]]
name = \"beacon\"
position = \"/nav/odom.pose.pose.position\"
velocity = \"/nav/odom.twist.twist.linear\"

[extrapolation]
horizon_s = 2.0

[[characteristic_point]]
name = \"exit\"
z_m = -2.0
";

fn guide() -> String {
    let schema = serde_json::to_value(schemars::schema_for!(Config)).expect("a schema is JSON");
    let none = Map::new();
    let mut page = HEAD.replace("EXAMPLE", EXAMPLE);
    let mut sections: Vec<_> = schema["properties"].as_object().unwrap_or(&none).iter().collect();
    sections.sort_by_key(|(name, _)| *name != "source");
    for (name, section) in sections {
        let (open, close) = if section.get("items").is_some() { ("[[", "]]") } else { ("[", "]") };
        let _ = write!(page, "\n## `{open}{name}{close}`\n\n{}\n\n", sentence(section));
        page.push_str("| key | takes | unit | default | meaning | example |\n|---|---|---|---|---|---|\n");
        let keys = resolved(&schema, section.get("items").unwrap_or(section));
        for (key, property) in keys["properties"].as_object().unwrap_or(&none) {
            page.push_str(&row(&schema, key, property));
        }
    }
    page
}

fn row(schema: &Value, key: &str, property: &Value) -> String {
    let meaning = meaning(schema, property);
    let (meaning, default) = match meaning.split_once("; default: ") {
        // the values that words can have stand behind the default
        Some((meaning, rest)) => match rest.split_once(". \"") {
            Some((default, words)) => (format!("{meaning}. \"{words}"), default.to_owned()),
            None => (format!("{meaning}."), rest.trim_end_matches('.').to_owned()),
        },
        None => (meaning, String::new()),
    };
    let value = |value: &Value| format!("`{}`", value.to_string().replace(',', ", "));
    let own = property.get("default").filter(|v| v.as_str() != Some(""));
    let default = match own {
        Some(own) if default.is_empty() => value(own),
        _ if !default.is_empty() => default,
        _ if ["name", "z_m"].contains(&key) => "must be given".into(),
        _ => "none".into(),
    };
    let example = property.get("examples").and_then(|list| list.get(0)).or(own).expect("each key has one");
    let cells = [takes(schema, property), unit(key), default, meaning].map(|cell| cell.replace('|', "\\|"));
    format!(
        "| `{key}` | {} | {} |\n",
        cells.join(" | "),
        format_args!("`{key} = {}`", example.to_string().replace(',', ", "))
    )
}

/// What kind of value a key takes.
fn takes(schema: &Value, property: &Value) -> String {
    let optional = property.get("anyOf").and_then(|list| list.get(0)).filter(|p| p.get("$ref").is_some());
    let definition = resolved(schema, optional.unwrap_or(property));
    let kind = &definition["type"];
    match kind.as_str().or_else(|| kind[0].as_str()) {
        Some("number") => "number".into(),
        Some("integer") => "whole number".into(),
        Some("boolean") => "`true` or `false`".into(),
        Some("array") => "three numbers".into(),
        Some("string") if definition.get("enum").is_none() => "text".into(),
        _ if definition.get("anyOf").is_some() => "`\"auto\"` or a list of words".into(),
        _ => "a word".into(),
    }
}

/// The unit that a key's name ends with.
fn unit(key: &str) -> String {
    let units = [
        ("_m_s", "m/s"),
        ("_m", "m"),
        ("_hz", "Hz"),
        ("_ns", "ns"),
        ("_rad", "rad"),
        ("_deg", "degrees"),
        ("_s", "s"),
    ];
    let unit = units.iter().find(|(ending, _)| key.ends_with(ending)).map_or("", |(_, unit)| unit);
    if key == "origin" { "degrees, degrees, m".into() } else { unit.into() }
}

#[test]
fn the_guide_in_the_tree_is_the_one_of_this_code() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/config.md");
    if std::env::var_os("TRACKFUSE_UPDATE_DOCS").is_some() {
        std::fs::write(&path, guide()).expect("the tree can be written");
    }
    let stored = std::fs::read_to_string(&path).expect("docs/config.md");
    assert!(stored == guide(), "it differs; TRACKFUSE_UPDATE_DOCS=1 writes it anew");
}

#[test]
fn every_example_of_the_guide_is_taken_by_the_program() {
    let parse =
        |text: &str| Config::parse(text, Path::new("guide.toml")).map_err(|e| format!("{e} in\n{text}"));
    parse(EXAMPLE).expect("the example at its head");
    let page = guide();
    let mut seen = 0;
    for section in page.split("\n## `").skip(1) {
        let (table, rows) = section.split_once("`\n").expect("a heading");
        let needed = match table {
            "[[source]]" => "name = \"a\"\nposition = \"/a.p\"\n",
            "[[characteristic_point]]" => "name = \"a\"\nz_m = 0.0\n",
            _ => "",
        };
        for row in rows.lines().filter(|line| line.starts_with("| `")) {
            let example = row.trim_end_matches("` |").rsplit_once('`').expect("an example").1;
            let key = example.split(' ').next().expect("a key");
            let others = needed.lines().filter(|line| !line.starts_with(&format!("{key} =")));
            let others: String = others.map(|line| format!("{line}\n")).collect();
            parse(&format!("{table}\n{others}{example}\n")).expect("an example");
            seen += 1;
        }
    }
    assert!(seen > 35, "{seen}");
}
