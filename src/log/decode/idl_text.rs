//! IDL text cut into words: names with their scopes, numbers and signs. Comments, texts, preprocessor lines and the
//! lines that join several files are passed over.

/// A word and the line that it stands on, from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Word<'t> {
    pub(super) text: &'t str,
    pub(super) line: usize,
}

/// The words of `text`, in their order.
pub(super) fn words(text: &str) -> Vec<Word<'_>> {
    let mut words = Vec::new();
    let (mut rest, mut line) = (text, 1);
    while let Some(first) = rest.chars().next() {
        let len = if let Some(behind) = rest.strip_prefix("/*") {
            behind.find("*/").map_or(rest.len(), |end| end + 4)
        } else if rest.starts_with("//") || is_line_apart(text, rest) {
            rest.find('\n').unwrap_or(rest.len())
        } else if first == '"' {
            text_len(rest)
        } else if is_name_char(first) || rest.starts_with("::") {
            let len = name_len(rest);
            words.push(Word { text: &rest[..len], line });
            len
        } else {
            if !first.is_whitespace() {
                words.push(Word { text: &rest[..first.len_utf8()], line });
            }
            first.len_utf8()
        };
        let (passed, next) = rest.split_at_checked(len).unwrap_or((rest, ""));
        line += passed.matches('\n').count();
        rest = next;
    }
    words
}

/// Whether `rest` begins a line that is no IDL: `#include`, `====`, or `IDL: package/msg/Type` below that.
fn is_line_apart(text: &str, rest: &str) -> bool {
    let at = text.len() - rest.len();
    let at_start = text[..at].chars().next_back().is_none_or(|c| c == '\n');
    at_start && (rest.starts_with('#') || rest.starts_with("====") || rest.starts_with("IDL: "))
}

fn is_name_char(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// A name with its scopes, such as `a::B`, or a number.
fn name_len(rest: &str) -> usize {
    let mut len = 0;
    loop {
        if rest[len..].starts_with("::") {
            len += 2;
        }
        let name = rest[len..].find(|c| !is_name_char(c)).unwrap_or(rest.len() - len);
        len += name;
        if name == 0 || !rest[len..].starts_with("::") {
            return len;
        }
    }
}

/// A text with its quotes; a backslash takes the next character as it is.
fn text_len(rest: &str) -> usize {
    let mut escaped = false;
    for (at, c) in rest.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '"' => return at + 1,
            _ => {}
        }
    }
    rest.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_idl_is_passed_over_and_lines_are_counted() {
        let text = "====\nIDL: p/msg/T\n#include \"a.idl\"\n// c\nmodule p { /* {\n */ struct T { ::a::B x[3]; };\n\
                    @verbatim (text=\"a \\\" }\" \"b\")";
        let words: Vec<_> = words(text).into_iter().map(|w| (w.text, w.line)).collect();
        assert_eq!(words[..3], [("module", 5), ("p", 5), ("{", 5)]);
        assert_eq!(words[3..7], [("struct", 6), ("T", 6), ("{", 6), ("::a::B", 6)]);
        let behind: Vec<_> = words[14..].iter().map(|w| w.0).collect();
        assert_eq!(behind, ["@", "verbatim", "(", "text", "=", ")"]);
    }
}
