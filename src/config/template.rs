//! A config for a person to go on with: every key with what it means, and its default as a comment.
//!
//! Meanings, defaults and examples are those of the config's JSON Schema, which comes from the doc comments and
//! defaults of [`Config`].

use serde_json::{Map, Value};

use super::Config;
use crate::printable::{printable, toml_string};

/// A `[[source]]` as it shall stand in the config.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SourceTable {
    /// Its name.
    pub name: String,
    /// Paths of its position; those behind the first are alternatives, as comments.
    pub positions: Vec<String>,
    /// Paths of its velocity, likewise.
    pub velocities: Vec<String>,
    /// Whether it is the datum.
    pub datum: bool,
    /// Whether it stands there as a comment, to be chosen by a person.
    pub commented: bool,
    /// What is to be said above it, a line each.
    pub remarks: Vec<String>,
}

/// Longest line of a comment.
const WIDTH: usize = 110;

/// Marks what is no default, since that depends on the log or there is none.
const EXAMPLE: &str = "   # an example";

/// The text of a config with these sources and remarks at its head; all other keys are comments that hold
/// their defaults.
#[must_use]
pub fn template(head: &[String], sources: &[SourceTable]) -> String {
    let schema = serde_json::to_value(schemars::schema_for!(Config)).unwrap_or_default();
    let none = Map::new();
    let mut sections: Vec<_> = schema["properties"].as_object().unwrap_or(&none).iter().collect();
    // What a person looks for first.
    sections.sort_by_key(|(name, _)| *name != "source");
    let mut lines: Vec<String> = head.iter().flat_map(|remark| comment(remark)).collect();
    lines.extend(comment(
        "A line that begins with # and a key holds that key's default, or an example where the default depends on the \
         log: take the # away to set it.",
    ));
    for (name, section) in sections {
        let keys = resolved(&schema, section.get("items").unwrap_or(section));
        lines.push(String::new());
        if name == "source" {
            lines.extend(source_lines(&schema, keys, sources));
            continue;
        }
        lines.extend(comment(&sentence(section)));
        let is_list = section.get("items").is_some();
        lines.push(if is_list { format!("#[[{name}]]{EXAMPLE}") } else { format!("[{name}]") });
        lines.extend(key_lines(&schema, keys, &[]));
    }
    lines.join("\n") + "\n"
}

/// The source tables, the first of them with all keys, or a table as an example where there are none.
fn source_lines(schema: &Value, keys: &Value, sources: &[SourceTable]) -> Vec<String> {
    let mut lines = Vec::new();
    if sources.is_empty() {
        lines.push("# A sensor, one table each.".to_owned());
        lines.push(format!("#[[source]]{EXAMPLE}"));
        lines.extend(key_lines(schema, keys, &[]));
    }
    for (i, source) in sources.iter().enumerate() {
        if i > 0 {
            lines.push(String::new());
        }
        lines.extend(source.remarks.iter().flat_map(|remark| comment(remark)));
        lines.push(format!("{}[[source]]", source.mark()));
        let mut set = source.keys();
        if i > 0 {
            lines.extend(set.into_iter().flat_map(|(_, lines)| lines));
            continue;
        }
        // A path that it doesn't have is nothing to be tried out.
        set.extend(["position", "velocity"].map(|key| (key, Vec::new())));
        lines.extend(key_lines(schema, keys, &set));
    }
    lines
}

impl SourceTable {
    /// What stands before its lines.
    fn mark(&self) -> &'static str {
        if self.commented { "#" } else { "" }
    }

    /// The keys that are set, with their lines.
    fn keys(&self) -> Vec<(&'static str, Vec<String>)> {
        let mark = self.mark();
        let paths = |key: &'static str, paths: &[String]| {
            let mark = |i: usize| if i == 0 { mark } else { "#" };
            let lines =
                paths.iter().enumerate().map(|(i, p)| format!("{}{key} = {}", mark(i), toml_string(p)));
            (!paths.is_empty()).then(|| (key, lines.collect()))
        };
        let name = Some(("name", vec![format!("{mark}name = {}", toml_string(&self.name))]));
        let datum = self.datum.then(|| ("datum", vec![format!("{mark}datum = true")]));
        let (position, velocity) = (paths("position", &self.positions), paths("velocity", &self.velocities));
        [name, position, velocity, datum].into_iter().flatten().collect()
    }
}

/// Every key of a table with what it means; those that are not `set` as comments.
fn key_lines(schema: &Value, table: &Value, set: &[(&str, Vec<String>)]) -> Vec<String> {
    let none = Map::new();
    let mut lines = Vec::new();
    for (key, property) in table["properties"].as_object().unwrap_or(&none) {
        let own = match set.iter().find(|(name, _)| name == key) {
            Some((_, own)) if own.is_empty() => continue,
            Some((_, own)) => own.clone(),
            None => vec![commented_key(key, property)],
        };
        lines.extend(comment(&meaning(schema, property)));
        lines.extend(own);
    }
    lines
}

/// A key with its default, or an example.
fn commented_key(key: &str, property: &Value) -> String {
    // An empty name is no default, but missing.
    let default = property.get("default").filter(|v| v.as_str() != Some(""));
    let example = property.get("examples").and_then(|list| list.get(0));
    let (value, mark) = if let Some(value) = default { (Some(value), "") } else { (example, EXAMPLE) };
    let value = value.map_or(String::new(), |v| v.to_string().replace(',', ", "));
    format!("#{key} = {value}{mark}")
}

/// What a key means, and which values it can have where those are words.
pub(super) fn meaning(schema: &Value, property: &Value) -> String {
    let mut text = sentence(property);
    let optional = property.get("anyOf").and_then(|list| list.get(0));
    let words = &resolved(schema, optional.unwrap_or(property))["oneOf"];
    let words: Vec<String> = words
        .as_array()
        .into_iter()
        .flatten()
        .map(|word| format!("{}: {}", word["const"], clause(&sentence(word))))
        .collect();
    if words.len() > 1 {
        text.extend([" ", &words.join("; "), "."]);
    }
    text
}

/// A definition itself, where it stands elsewhere.
pub(super) fn resolved<'a>(schema: &'a Value, definition: &'a Value) -> &'a Value {
    let name = definition["$ref"].as_str().and_then(|r| r.strip_prefix("#/$defs/"));
    name.map_or(definition, |name| &schema["$defs"][name])
}

pub(super) fn sentence(definition: &Value) -> String {
    definition["description"].as_str().unwrap_or_default().replace('\n', " ")
}

/// A sentence as a part of another one.
fn clause(sentence: &str) -> String {
    let mut chars = sentence.trim_end_matches('.').chars();
    chars.next().map_or(String::new(), |first| first.to_lowercase().chain(chars).collect())
}

/// Text as comment lines.
fn comment(remark: &str) -> Vec<String> {
    let mut lines = vec!["#".to_owned()];
    for word in printable(remark).split(' ').filter(|word| !word.is_empty()) {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= WIDTH || line == "#" => {
                line.extend([" ", word]);
            }
            _ => lines.push(format!("# {word}")),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    use super::*;
    use crate::config::SourceConfig;

    fn tether() -> (SourceTable, SourceConfig) {
        let (position, velocity) = ("/\"t\"/#track.position", "/tether/track.velocity");
        let table = SourceTable {
            name: "tether".into(),
            positions: vec![position.into()],
            velocities: vec![velocity.into()],
            datum: true,
            ..SourceTable::default()
        };
        let config = SourceConfig {
            name: "tether".into(),
            position: Some(position.into()),
            velocity: Some(velocity.into()),
            datum: true,
            ..SourceConfig::default()
        };
        (table, config)
    }

    fn parse(text: &str) -> Config {
        Config::parse(text, Path::new("made.toml")).unwrap_or_else(|e| panic!("{e}:\n{text}"))
    }

    /// The text with those commented keys and tables in force for which `wanted` says so.
    fn uncommented(text: &str, wanted: impl Fn(&str) -> bool) -> String {
        let is_key = |l: &str| l.len() > 1 && l.starts_with('#') && !l.starts_with("# ");
        let line = |l: &str| if is_key(l) && wanted(l) { l[1..].to_owned() } else { l.to_owned() };
        text.lines().map(|l| line(l) + "\n").collect()
    }

    #[test]
    fn as_it_is_a_template_holds_its_sources_and_nothing_else() {
        let (table, config) = tether();
        let other = SourceTable { name: "other".into(), commented: true, datum: false, ..table.clone() };
        let text = template(&["of a log".into()], &[table, other]);
        assert_eq!(parse(&text), Config { source: vec![config], ..Config::default() });
    }

    #[test]
    fn of_several_paths_the_first_is_in_force() {
        let (table, config) = tether();
        let positions = [table.positions.clone(), vec!["/another.position".into()]].concat();
        let text = template(&[], &[SourceTable { positions, ..table }]);
        assert_eq!(parse(&text).source, [config]);
        assert!(text.contains("\n#position = \"/another.position\"\n"), "{text}");
    }

    #[test]
    fn default_lines_put_in_force_are_the_defaults() {
        let (table, config) = tether();
        let text = uncommented(&template(&[], &[table]), |line| !line.ends_with(EXAMPLE));
        assert_eq!(parse(&text), Config { source: vec![config], ..Config::default() });
        assert!(text.lines().filter(|l| !l.starts_with('#')).count() > 25, "{text}");
    }

    /// All keys below a value, with the tables they stand in.
    fn keys(value: &toml::Value, inside: &str, found: &mut BTreeSet<String>) {
        match value {
            toml::Value::Table(table) => table.iter().for_each(|(key, value)| {
                let place = format!("{inside}.{key}");
                keys(value, &place, found);
                found.insert(place);
            }),
            toml::Value::Array(list) => list.iter().for_each(|value| keys(value, inside, found)),
            _ => {}
        }
    }

    #[test]
    fn all_lines_put_in_force_are_a_config_that_has_every_key_of_the_schema() {
        let text = uncommented(&template(&[], &[]), |_| true);
        parse(&text);
        let mut found = BTreeSet::new();
        keys(&toml::from_str(&text).expect("TOML"), "", &mut found);
        let schema = serde_json::to_value(schemars::schema_for!(Config)).expect("a schema is JSON");
        let sections = schema["properties"].as_object().expect("tables");
        let mut expected = BTreeSet::new();
        for (name, section) in sections {
            expected.insert(format!(".{name}"));
            let table = resolved(&schema, section.get("items").unwrap_or(section));
            let names = table["properties"].as_object().expect("keys").keys();
            expected.extend(names.map(|key| format!(".{name}.{key}")));
        }
        assert_eq!(found, expected);
    }

    #[test]
    fn every_key_is_explained_and_no_line_of_the_template_is_long() {
        let text = template(&[], &[tether().0]);
        let lines: Vec<&str> = text.lines().collect();
        let key = |l: &str| l.split('=').count() > 1 && !l.starts_with("# ");
        for pair in lines.windows(2).filter(|pair| key(pair[1])) {
            assert!(pair[0].starts_with("# "), "{}", pair[1]);
        }
        assert!(lines.iter().all(|l| l.chars().count() <= WIDTH), "{text}");
        for part in ["\"ned\": north, east, down", "m/s", "default: the fastest source's rate"] {
            assert!(text.contains(part), "{part} is missing in\n{text}");
        }
    }
}
