//! The text of a message path, read and written.

use std::fmt;
use std::iter::Peekable;
use std::str::{Chars, FromStr};

use super::path::{Comparison, Filter, Literal, MessagePath, Step};

/// A text that is no message path.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("path {text:?}: found {found} at character {at}, expected {expected}")]
pub struct PathError {
    /// The whole text.
    pub text: String,
    /// What stands there: a character, or the end.
    pub found: String,
    /// Where it stands, the first character being 1.
    pub at: usize,
    /// What should stand there.
    pub expected: &'static str,
}

pub(super) fn parse(text: &str) -> Result<MessagePath, PathError> {
    let mut parser = Parser { text, rest: text.chars().peekable(), at: 1 };
    let topic = parser.quoted_or("a topic", is_topic_char)?;
    let mut steps = Vec::new();
    while let Some(&c) = parser.rest.peek() {
        match c {
            '.' => steps.push(parser.field()?),
            '[' => steps.push(parser.bracket()?),
            '{' => steps.push(Step::Filter(parser.filter()?)),
            _ => return Err(parser.error("one of . [ { or the end")),
        }
    }
    Ok(MessagePath { topic, steps })
}

fn is_topic_char(c: char) -> bool {
    !c.is_whitespace() && !c.is_control() && !".[]{}\"'\\".contains(c)
}

fn is_name_char(c: char) -> bool {
    c.is_alphanumeric() || "_-/:".contains(c)
}

struct Parser<'t> {
    text: &'t str,
    rest: Peekable<Chars<'t>>,
    /// The number of the next character, from 1.
    at: usize,
}

impl Parser<'_> {
    fn next(&mut self) -> Option<char> {
        let next = self.rest.next();
        // the end has a place of its own, but nothing behind it
        self.at += usize::from(next.is_some());
        next
    }

    fn eat(&mut self, c: char) -> bool {
        let found = self.rest.peek() == Some(&c);
        if found {
            self.next();
        }
        found
    }

    fn expect(&mut self, c: char, expected: &'static str) -> Result<(), PathError> {
        if self.eat(c) { Ok(()) } else { Err(self.error(expected)) }
    }

    fn error(&mut self, expected: &'static str) -> PathError {
        let here = self.mark();
        self.error_at(here, expected)
    }

    fn error_at(&self, (found, at): (Option<char>, usize), expected: &'static str) -> PathError {
        let found = found.map_or_else(|| "the end".to_owned(), |c| format!("{c:?}"));
        PathError { text: self.text.to_owned(), found, at, expected }
    }

    fn take_while(&mut self, wanted: fn(char) -> bool) -> String {
        let mut taken = String::new();
        while let Some(&c) = self.rest.peek()
            && wanted(c)
        {
            taken.push(c);
            self.next();
        }
        taken
    }

    fn quoted_or(&mut self, what: &'static str, plain: fn(char) -> bool) -> Result<String, PathError> {
        if matches!(self.rest.peek(), Some('"' | '\'')) {
            return self.quoted();
        }
        let taken = self.take_while(plain);
        if taken.is_empty() { Err(self.error(what)) } else { Ok(taken) }
    }

    /// Text in double or single quotes; a backslash takes the next character as it is.
    fn quoted(&mut self) -> Result<String, PathError> {
        let quote = self.next();
        let mut text = String::new();
        loop {
            match self.rest.peek() {
                None => return Err(self.error("a closing quote")),
                c if c == quote.as_ref() => {
                    self.next();
                    return Ok(text);
                }
                Some('\\') => {
                    self.next();
                    match self.next() {
                        Some(c) => text.push(c),
                        None => return Err(self.error("a closing quote")),
                    }
                }
                Some(&c) => {
                    text.push(c);
                    self.next();
                }
            }
        }
    }

    fn field(&mut self) -> Result<Step, PathError> {
        self.expect('.', "a dot")?;
        Ok(Step::Field(self.quoted_or("a field name", is_name_char)?))
    }

    fn bracket(&mut self) -> Result<Step, PathError> {
        const INDEX: &str = "an index such as 0 or -1, or : with a filter behind";
        self.expect('[', "[")?;
        if self.eat(':') {
            self.expect(']', "] (a slice would be more than one value)")?;
            let mut filters = Vec::new();
            while self.rest.peek() == Some(&'{') {
                filters.push(self.filter()?);
            }
            if filters.is_empty() {
                return Err(self.error("a filter such as {id==2}, since a path leads to one value"));
            }
            return Ok(Step::First(filters));
        }
        let start = self.mark();
        let digits = self.take_while(|c| c == '-' || c.is_ascii_digit());
        let index = digits.parse().map_err(|_| self.error_at(start, INDEX))?;
        self.expect(']', "]")?;
        Ok(Step::Index(index))
    }

    fn filter(&mut self) -> Result<Filter, PathError> {
        self.expect('{', "{")?;
        self.spaces();
        let mut fields = vec![self.quoted_or("a field name", is_name_char)?];
        while self.eat('.') {
            fields.push(self.quoted_or("a field name", is_name_char)?);
        }
        self.spaces();
        let comparison = self.comparison()?;
        self.spaces();
        let literal = self.literal()?;
        self.spaces();
        self.expect('}', "}")?;
        Ok(Filter { fields, comparison, literal })
    }

    fn comparison(&mut self) -> Result<Comparison, PathError> {
        const COMPARISON: &str = "one of == != < <= > >=";
        let start = self.mark();
        let text = self.take_while(|c| "=!<>".contains(c));
        match text.as_str() {
            "==" => Ok(Comparison::Equal),
            "!=" => Ok(Comparison::Unequal),
            "<" => Ok(Comparison::Less),
            "<=" => Ok(Comparison::LessOrEqual),
            ">" => Ok(Comparison::Greater),
            ">=" => Ok(Comparison::GreaterOrEqual),
            _ => Err(self.error_at(start, COMPARISON)),
        }
    }

    fn literal(&mut self) -> Result<Literal, PathError> {
        const LITERAL: &str = "a number, true, false, or text in quotes";
        if matches!(self.rest.peek(), Some('"' | '\'')) {
            return Ok(Literal::Text(self.quoted()?));
        }
        let start = self.mark();
        let text = self.take_while(|c| c.is_ascii_alphanumeric() || "+-.".contains(c));
        match text.as_str() {
            "true" => return Ok(Literal::Bool(true)),
            "false" => return Ok(Literal::Bool(false)),
            _ => {}
        }
        // Rust would also read `nan` and `infinity`, which nothing equals.
        let number = text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        let float = text.parse::<f64>().ok().filter(|float| number && float.is_finite());
        let int = text.parse().map(Literal::Int).ok();
        int.or(float.map(Literal::Float)).ok_or_else(|| self.error_at(start, LITERAL))
    }

    fn spaces(&mut self) {
        self.take_while(char::is_whitespace);
    }

    /// Where a word starts, for an error about the whole of it.
    fn mark(&mut self) -> (Option<char>, usize) {
        (self.rest.peek().copied(), self.at)
    }
}

impl FromStr for MessagePath {
    type Err = PathError;

    fn from_str(text: &str) -> Result<Self, PathError> {
        Self::parse(text)
    }
}

impl fmt::Display for MessagePath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if is_plain_topic(&self.topic) {
            f.write_str(&self.topic)?;
        } else {
            write_quoted(f, &self.topic)?;
        }
        self.steps.iter().try_for_each(|step| write!(f, "{step}"))
    }
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Field(name) => {
                f.write_str(".")?;
                write_name(f, name)
            }
            Self::Index(index) => write!(f, "[{index}]"),
            Self::Filter(filter) => write!(f, "{filter}"),
            Self::First(filters) => {
                f.write_str("[:]")?;
                filters.iter().try_for_each(|filter| write!(f, "{filter}"))
            }
        }
    }
}

impl fmt::Display for Filter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("{")?;
        for (index, name) in self.fields.iter().enumerate() {
            if index > 0 {
                f.write_str(".")?;
            }
            write_name(f, name)?;
        }
        write!(f, "{}{}}}", self.comparison, self.literal)
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Equal => "==",
            Self::Unequal => "!=",
            Self::Less => "<",
            Self::LessOrEqual => "<=",
            Self::Greater => ">",
            Self::GreaterOrEqual => ">=",
        })
    }
}

impl fmt::Display for Literal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool(value) => write!(f, "{value}"),
            Self::Int(value) => write!(f, "{value}"),
            // Debug keeps the point of 1.0, by which it stays a float.
            Self::Float(value) => write!(f, "{value:?}"),
            Self::Text(value) => write_quoted(f, value),
        }
    }
}

/// Whether the topic can stand without quotes.
fn is_plain_topic(topic: &str) -> bool {
    !topic.is_empty() && topic.chars().all(is_topic_char)
}

/// Whether the field's name can stand without quotes.
fn is_plain_name(name: &str) -> bool {
    !name.is_empty() && name.chars().all(is_name_char)
}

fn write_name(f: &mut fmt::Formatter<'_>, name: &str) -> fmt::Result {
    if is_plain_name(name) { f.write_str(name) } else { write_quoted(f, name) }
}

fn write_quoted(f: &mut fmt::Formatter<'_>, text: &str) -> fmt::Result {
    write!(f, "\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn error(text: &str) -> String {
        parse(text).unwrap_err().to_string()
    }

    #[test]
    fn quotes_hold_dots_in_topics_and_spaces_in_fields() {
        let path = parse(r#""/a.b"."my field".'say "x"'"#).unwrap();
        assert_eq!(path.topic, "/a.b");
        assert_eq!(path.steps, [Step::Field("my field".into()), Step::Field("say \"x\"".into())]);
        assert_eq!(path.to_string(), r#""/a.b"."my field"."say \"x\"""#);
    }

    #[test]
    fn filters_may_have_spaces_and_lose_them_in_print() {
        let path = parse("/f[:]{ a.b >= -1.5e3 }{c=='x'}.p[-1]").unwrap();
        assert_eq!(path.to_string(), "/f[:]{a.b>=-1500.0}{c==\"x\"}.p[-1]");
    }

    #[test]
    fn an_error_says_where_and_what_was_expected() {
        assert_eq!(error(""), "path \"\": found the end at character 1, expected a topic");
        assert_eq!(error("/a."), "path \"/a.\": found the end at character 4, expected a field name");
        assert_eq!(error("/a..b"), "path \"/a..b\": found '.' at character 4, expected a field name");
        assert_eq!(
            error("/a b"),
            "path \"/a b\": found ' ' at character 3, expected one of . [ { or the end"
        );
        assert!(error("/a[x]").contains("found 'x' at character 4, expected an index"));
        assert!(error("/a[99999999999999999999]").contains("found '9' at character 4, expected an index"));
        assert!(error("/a[1:2]").contains("found ':' at character 5, expected ]"));
        assert!(error("/a[:].x").contains("found '.' at character 6, expected a filter such as"));
        assert!(error("/a{b=2}").contains("found '=' at character 5, expected one of =="));
        assert!(error("/a{b==nan}").contains("found 'n' at character 7, expected a number"));
        assert!(error("/a{b==1e999}").contains("expected a number"));
        assert!(error("/a{b=='x}").contains("found the end at character 10, expected a closing quote"));
        assert!(error(r#""te\"#).contains("found the end at character 5, expected a closing quote"));
    }

    fn filters() -> impl Strategy<Value = Filter> {
        let comparison = prop_oneof![
            Just(Comparison::Equal),
            Just(Comparison::Unequal),
            Just(Comparison::Less),
            Just(Comparison::LessOrEqual),
            Just(Comparison::Greater),
            Just(Comparison::GreaterOrEqual),
        ];
        let literal = prop_oneof![
            any::<bool>().prop_map(Literal::Bool),
            any::<i128>().prop_map(Literal::Int),
            any::<f64>().prop_filter("finite", |f| f.is_finite()).prop_map(Literal::Float),
            any::<String>().prop_map(Literal::Text),
        ];
        let fields = prop::collection::vec(names(), 1..3);
        (fields, comparison, literal).prop_map(|(fields, comparison, literal)| Filter {
            fields,
            comparison,
            literal,
        })
    }

    fn names() -> impl Strategy<Value = String> {
        prop_oneof!["[a-z_]{1,8}", any::<String>()]
    }

    /// A filter after `[:]` belongs to it, so a list that parses back never has the two apart.
    fn steps() -> impl Strategy<Value = Vec<Step>> {
        let step = prop_oneof![
            names().prop_map(Step::Field),
            any::<i64>().prop_map(Step::Index),
            filters().prop_map(Step::Filter),
            prop::collection::vec(filters(), 1..3).prop_map(Step::First),
        ];
        prop::collection::vec(step, 0..6).prop_filter("filters belong to the slice before", |steps| {
            !steps.windows(2).any(|pair| matches!(pair, [Step::First(_), Step::Filter(_)]))
        })
    }

    proptest! {
        #[test]
        fn what_is_printed_is_read_back(topic in prop_oneof!["/[a-z/]{1,12}", any::<String>()], steps in steps()) {
            let path = MessagePath { topic, steps };
            prop_assert_eq!(parse(&path.to_string()), Ok(path));
        }

        #[test]
        fn arbitrary_text_never_panics(text: String) {
            let _ = parse(&text);
        }

        #[test]
        fn text_like_a_path_prints_to_what_it_was(text in r#"/a([.\[\]{}:=!<>"'0-9a-c-]{0,12})"#) {
            if let Ok(path) = parse(&text) {
                prop_assert_eq!(parse(&path.to_string()), Ok(path));
            }
        }
    }
}
