//! Text that others wrote (topics, names, frames) as it may go to a terminal.

use std::borrow::Cow;

/// The text with its control characters, and those that turn the direction of writing, as escapes.
pub(crate) fn printable(text: &str) -> Cow<'_, str> {
    if !text.chars().any(harmful) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        if harmful(c) { shown.extend(c.escape_default()) } else { shown.push(c) }
    }
    Cow::Owned(shown)
}

fn harmful(c: char) -> bool {
    let turns = matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    c.is_control() || turns
}

/// The text as a TOML string on one line, free of what steers a terminal.
pub(crate) fn toml_string(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if harmful(c) => quoted.extend(["\\u", &format!("{:04X}", u32::from(c))]),
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

/// The text as one word of a POSIX shell's command line, free of what steers a terminal.
pub(crate) fn shell_word(text: &str) -> String {
    let text = printable(text);
    let plain = |c: char| c.is_alphanumeric() || "/._-+:,=@%".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        return text.into_owned();
    }
    format!("'{}'", text.replace('\'', "'\\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_steers_a_terminal_is_escaped_and_all_else_stays() {
        assert_eq!(printable("a\n\u{1b}[31m\u{202e}b\0"), "a\\n\\u{1b}[31m\\u{202e}b\\u{0}");
        assert!(matches!(printable("/трос/ünï \"x\""), Cow::Borrowed(_)));
    }

    #[test]
    fn any_text_survives_as_a_toml_string() {
        for text in ["/трос/\"x\"\\ 'y'", "a\nb\u{7f}\u{1b}\0\u{85}\u{202e}", ""] {
            let quoted = toml_string(text);
            assert_eq!(quoted.lines().count(), 1, "{quoted}");
            let table: toml::Table = toml::from_str(&format!("t = {quoted}")).expect("TOML");
            assert_eq!(table["t"].as_str(), Some(text));
        }
    }

    #[test]
    fn a_shell_takes_the_word_as_one() {
        assert_eq!(shell_word("/a/dive-2.mcap"), "/a/dive-2.mcap");
        assert_eq!(shell_word("my dive's.mcap"), r"'my dive'\''s.mcap'");
        assert_eq!(shell_word(""), "''");
    }
}
