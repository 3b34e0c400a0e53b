//! The `ros2idl` and `omgidl` schema encodings: structs in the Interface Definition Language of the OMG (IDL 4.2),
//! of one file or of several that are joined by lines of `=`.
//!
//! Unions, maps, bit sets, structs that inherit and optional members are refused: no message in common use has them.

use std::collections::HashMap;

use super::DecodeError;
use super::definition::{RawDefinition, RawElement, RawField, RawStruct, Scalar, Shape};
use super::idl_text::{Word, words};

/// A name and its type.
type Declared<'t> = (&'t str, (RawElement, Shape));

/// The types of `text`, with the one called `schema_name` as the message; scopes may stand there with `/` or `::`.
///
/// # Errors
/// [`DecodeError::Definition`] names the line, [`DecodeError::MissingRoot`] where no struct has that name.
pub(super) fn parse(schema_name: &str, text: &str) -> Result<RawDefinition, DecodeError> {
    let words = words(text);
    let mut parser = Parser { words: &words, at: 0, names: HashMap::new(), sizes: HashMap::new() };
    let mut structs = parser.file()?;
    let wanted = schema_name.replace("::", "/");
    // ROS may leave the `msg` out.
    let is_root = |s: &RawStruct| s.name == wanted || s.name.replacen("/msg/", "/", 1) == wanted;
    let root = structs.iter().position(is_root);
    let root = root.ok_or_else(|| DecodeError::MissingRoot { name: schema_name.to_owned() })?;
    Ok(RawDefinition { root: structs.swap_remove(root), others: structs })
}

struct Parser<'t> {
    words: &'t [Word<'t>],
    at: usize,
    /// What typedefs and enums stand for, by full name.
    names: HashMap<String, (RawElement, Shape)>,
    /// Constants that may be a size.
    sizes: HashMap<String, usize>,
}

impl<'t> Parser<'t> {
    fn file(&mut self) -> Result<Vec<RawStruct>, DecodeError> {
        let mut scopes: Vec<&str> = Vec::new();
        let mut structs = Vec::new();
        while self.at < self.words.len() {
            self.skip_annotations()?;
            match self.peek() {
                ";" => self.at += 1,
                "}" if !scopes.is_empty() => {
                    scopes.pop();
                    self.at += 1;
                }
                "module" => {
                    self.at += 1;
                    scopes.push(self.name()?);
                    self.expect("{")?;
                }
                "struct" => structs.extend(self.structure(&scopes)?),
                "enum" => self.enumeration(&scopes)?,
                "typedef" => self.typedef(&scopes)?,
                "const" => self.constant(&scopes)?,
                "" => {}
                _ => return Err(self.error("module, struct, enum, typedef or const")),
            }
        }
        Ok(structs)
    }

    /// A struct; nothing for one that is only announced.
    fn structure(&mut self, scopes: &[&str]) -> Result<Option<RawStruct>, DecodeError> {
        self.at += 1;
        let name = full(scopes, self.name()?);
        if self.eat(";") {
            return Ok(None);
        }
        self.expect("{")?;
        let mut fields = Vec::new();
        loop {
            self.skip_annotations()?;
            if self.eat("}") {
                return Ok(Some(RawStruct { name, fields }));
            }
            for (name, (element, shape)) in self.declaration(scopes)? {
                // what ROS gives a struct without members, which then counts as one
                if name != "structure_needs_at_least_one_member" {
                    fields.push(RawField { name: name.to_owned(), element, shape });
                }
            }
        }
    }

    /// `TYPE a, b[3];`
    fn declaration(&mut self, scopes: &[&str]) -> Result<Vec<Declared<'t>>, DecodeError> {
        let (element, shape) = self.kind(scopes)?;
        let mut declared = Vec::new();
        loop {
            let name = self.name()?;
            let mut own_shape = shape;
            while self.eat("[") {
                let count = self.size(scopes)?;
                own_shape = match own_shape {
                    Shape::One => Shape::Fixed(count),
                    Shape::Fixed(inner) => Shape::Fixed(inner.saturating_mul(count)),
                    Shape::Sequence => return Err(self.error("no array of sequences")),
                };
                self.expect("]")?;
            }
            declared.push((name, (element.clone(), own_shape)));
            if !self.eat(",") {
                self.expect(";")?;
                return Ok(declared);
            }
        }
    }

    fn kind(&mut self, scopes: &[&str]) -> Result<(RawElement, Shape), DecodeError> {
        let scalar = |scalar| Ok((RawElement::Scalar(scalar), Shape::One));
        let word = self.peek();
        let known = match word {
            "boolean" => Scalar::Bool,
            "octet" | "char" | "uint8" => Scalar::Uint { size: 1 },
            "int8" => Scalar::Int { size: 1 },
            "short" | "int16" => Scalar::Int { size: 2 },
            "uint16" => Scalar::Uint { size: 2 },
            "int32" => Scalar::Int { size: 4 },
            "uint32" => Scalar::Uint { size: 4 },
            "int64" => Scalar::Int { size: 8 },
            "uint64" => Scalar::Uint { size: 8 },
            "float" => Scalar::Float { size: 4 },
            "double" => Scalar::Float { size: 8 },
            "long" => {
                self.at += 1;
                return scalar(Scalar::Int { size: if self.eat("long") { 8 } else { 4 } });
            }
            "unsigned" => {
                self.at += 1;
                let size = match self.peek() {
                    "short" => 2,
                    "long" if self.words.get(self.at + 1).is_some_and(|w| w.text == "long") => {
                        self.at += 1;
                        8
                    }
                    "long" => 4,
                    _ => return Err(self.error("short or long")),
                };
                self.at += 1;
                return scalar(Scalar::Uint { size });
            }
            "string" | "wstring" => {
                self.at += 1;
                self.bound(scopes)?;
                let text = if word == "string" { RawElement::Text } else { RawElement::WideText };
                return Ok((text, Shape::One));
            }
            "sequence" => return self.sequence(scopes),
            "union" | "struct" | "enum" | "map" | "fixed" | "wchar" | "any" | "bitset" | "bitmask" => {
                return Err(self.error("a number, a text, a sequence or the name of a struct"));
            }
            _ => {
                let name = self.name()?.trim_start_matches("::");
                let found = nearest(&self.names, scopes, name).cloned();
                let named = || (RawElement::Named(name.replace("::", "/")), Shape::One);
                return Ok(found.unwrap_or_else(named));
            }
        };
        self.at += 1;
        scalar(known)
    }

    /// `sequence<TYPE>` or `sequence<TYPE, BOUND>`
    fn sequence(&mut self, scopes: &[&str]) -> Result<(RawElement, Shape), DecodeError> {
        self.at += 1;
        self.expect("<")?;
        if self.peek() == "sequence" {
            return Err(self.error("no sequence of sequences"));
        }
        let (element, shape) = self.kind(scopes)?;
        if shape != Shape::One {
            return Err(self.error("no sequence of arrays"));
        }
        if self.eat(",") {
            self.size(scopes)?;
        }
        self.expect(">")?;
        Ok((element, Shape::Sequence))
    }

    /// The bound of a text, which changes nothing.
    fn bound(&mut self, scopes: &[&str]) -> Result<(), DecodeError> {
        if self.eat("<") {
            self.size(scopes)?;
            self.expect(">")?;
        }
        Ok(())
    }

    fn size(&mut self, scopes: &[&str]) -> Result<usize, DecodeError> {
        let word = self.peek();
        let known = word.parse().ok().or_else(|| nearest(&self.sizes, scopes, word).copied());
        match known {
            Some(size) if size > 0 => {
                self.at += 1;
                Ok(size)
            }
            _ => Err(self.error("a size, not zero")),
        }
    }

    /// An enum is a number of four bytes.
    fn enumeration(&mut self, scopes: &[&str]) -> Result<(), DecodeError> {
        self.at += 1;
        let name = full(scopes, self.name()?);
        self.names.insert(name, (RawElement::Scalar(Scalar::Uint { size: 4 }), Shape::One));
        self.skip_behind("}")
    }

    fn typedef(&mut self, scopes: &[&str]) -> Result<(), DecodeError> {
        self.at += 1;
        for (name, stands_for) in self.declaration(scopes)? {
            self.names.insert(full(scopes, name), stands_for);
        }
        Ok(())
    }

    /// `const TYPE NAME = VALUE;`: kept where the value is one whole number.
    fn constant(&mut self, scopes: &[&str]) -> Result<(), DecodeError> {
        self.at += 1;
        self.kind(scopes)?;
        let name = full(scopes, self.name()?);
        self.expect("=")?;
        if let Ok(value) = self.peek().parse() {
            self.sizes.insert(name, value);
        }
        self.skip_behind(";")
    }

    /// `@name`, `@name(...)`; an optional member is laid out differently.
    fn skip_annotations(&mut self) -> Result<(), DecodeError> {
        while self.eat("@") {
            if self.peek() == "optional" {
                return Err(self.error("no optional member"));
            }
            self.name()?;
            if self.eat("(") {
                let mut open = 1;
                while open > 0 {
                    match self.peek() {
                        "(" => open += 1,
                        ")" => open -= 1,
                        "" => return Err(self.error("a closing bracket")),
                        _ => {}
                    }
                    self.at += 1;
                }
            }
        }
        Ok(())
    }

    fn skip_behind(&mut self, word: &'static str) -> Result<(), DecodeError> {
        while !self.eat(word) {
            if self.peek().is_empty() {
                return Err(self.error(word));
            }
            self.at += 1;
        }
        Ok(())
    }

    /// The next word; empty at the end.
    fn peek(&self) -> &'t str {
        self.words.get(self.at).map_or("", |word| word.text)
    }

    fn eat(&mut self, word: &str) -> bool {
        let found = self.peek() == word;
        self.at += usize::from(found);
        found
    }

    fn expect(&mut self, word: &'static str) -> Result<(), DecodeError> {
        if self.eat(word) { Ok(()) } else { Err(self.error(word)) }
    }

    fn name(&mut self) -> Result<&'t str, DecodeError> {
        let name = self.peek();
        if !name.trim_start_matches("::").starts_with(|c: char| c.is_alphabetic() || c == '_') {
            return Err(self.error("a name"));
        }
        self.at += 1;
        Ok(name)
    }

    #[cold]
    fn error(&self, expected: &'static str) -> DecodeError {
        let line = self.words.get(self.at).or(self.words.last()).map_or(1, |word| word.line);
        DecodeError::Definition { line, found: self.peek().chars().take(80).collect(), expected }
    }
}

fn full(scopes: &[&str], name: &str) -> String {
    scopes.iter().chain([&name]).copied().collect::<Vec<_>>().join("/")
}

/// What `name` means inside `scopes`: the innermost counts.
fn nearest<'m, T>(known: &'m HashMap<String, T>, scopes: &[&str], name: &str) -> Option<&'m T> {
    let name = name.replace("::", "/");
    (0..=scopes.len()).rev().find_map(|depth| known.get(&full(&scopes[..depth], &name)))
}

#[cfg(test)]
mod tests;
