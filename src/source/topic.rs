//! What topics' names say: which sensor, whether a reference, whether a position or a velocity.

use std::collections::BTreeSet;

use crate::sample::Quantity;

/// Words of class I sensors, the default datum, then those of class II. The second number of each is
/// whether the word must stand alone, since it is part of other words.
const DATUM_WORDS: [(&str, bool); 3] = [("tether", false), ("wire", true), ("gauge", false)];
const OTHER_WORDS: [(&str, bool); 4] =
    [("beacon", false), ("acoustic", false), ("usbl", false), ("lbl", true)];

/// Topics with one of these words hold what a track is judged by, never what it is made of.
const REFERENCE_WORDS: [&str; 4] = ["truth", "reference", "ins", "gt"];

/// Whether a name holds a word of the sensors that are the datum by default: tether, wire, gauge.
#[must_use]
pub fn is_datum_like(name: &str) -> bool {
    find_word(name, &DATUM_WORDS).is_some()
}

/// Whether a topic's name says that a track is judged by it.
pub(super) fn is_reference(topic: &str) -> bool {
    words(topic).iter().any(|w| REFERENCE_WORDS.contains(&w.as_str()))
}

/// Whether a field that is just a `vector` is that quantity: only the topic's name can say.
pub(super) fn vector_is(topic: &str, quantity: Quantity) -> bool {
    let words = words(topic);
    let any_of = |known: &[&str]| words.iter().any(|w| known.contains(&w.as_str()));
    let of_velocity = any_of(&["vel", "velocity", "speed", "twist"]);
    match quantity {
        Quantity::Velocity => of_velocity,
        Quantity::Position => any_of(&["pos", "position", "fix", "point"]) && !of_velocity,
    }
}

/// The words of a topic, but for those that say what is measured: those of one sensor's topics are the same.
pub(super) fn sensor_words(topic: &str) -> BTreeSet<String> {
    const MEASURED: [&str; 10] =
        ["pose", "pos", "position", "fix", "point", "twist", "vel", "velocity", "speed", "linear"];
    let words = topic.split(|c: char| !c.is_alphanumeric()).map(str::to_lowercase);
    words.filter(|w| !w.is_empty() && !MEASURED.contains(&w.as_str())).collect()
}

/// What stands before the first sensor's word of a topic, and the word with the digits behind it.
pub(super) fn sensor_word(topic: &str) -> Option<(String, String)> {
    let datum = find_word(topic, &DATUM_WORDS);
    let other = find_word(topic, &OTHER_WORDS);
    let (start, word) = [datum, other].into_iter().flatten().min()?;
    let digits = topic[start + word.len()..].chars().take_while(char::is_ascii_digit);
    Some((topic[..start].to_owned(), format!("{word}{}", digits.collect::<String>())))
}

/// The first of `known` in a name, and where it begins.
fn find_word<'a>(name: &str, known: &[(&'a str, bool)]) -> Option<(usize, &'a str)> {
    let lower = name.to_ascii_lowercase();
    let alone = |at: usize, word: &str| {
        let beside = |c: Option<char>| c.is_none_or(|c| !c.is_ascii_alphabetic());
        beside(lower[..at].chars().next_back()) && beside(lower[at + word.len()..].chars().next())
    };
    let places = known.iter().filter_map(|&(word, must_stand_alone)| {
        let mut places = lower.match_indices(word).map(|(at, _)| at);
        places.find(|&at| !must_stand_alone || alone(at, word)).map(|at| (at, word))
    });
    places.min()
}

/// The words of a topic, in lower case: cut at everything that is no letter, and where capitals begin.
fn words(topic: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut before = ' ';
    for c in topic.chars() {
        let boundary = !c.is_ascii_alphabetic() || (c.is_ascii_uppercase() && before.is_ascii_lowercase());
        if boundary {
            words.push(String::new());
        }
        if c.is_ascii_alphabetic() {
            words.last_mut().into_iter().for_each(|w| w.push(c.to_ascii_lowercase()));
        }
        before = c;
    }
    words.retain(|w| !w.is_empty());
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_of_one_sensor_share_its_name() {
        let name = |t: &str| sensor_word(t).map(|(_, name)| name);
        assert_eq!(sensor_word("/gauge/pose"), sensor_word("/gauge/velocity"));
        assert_eq!(name("/rov/Beacon2/odom").as_deref(), Some("beacon2"));
        assert_eq!(name("/tether_position").as_deref(), Some("tether"));
        assert_eq!(name("/acoustic_beacon/fix").as_deref(), Some("acoustic"));
        assert_eq!(name("/wireless/status"), None);
        assert_eq!(name("/lbl/fix").as_deref(), Some("lbl"));
        assert_eq!(name("/cub1/pose"), None);
        assert_ne!(sensor_word("/a/beacon/pose"), sensor_word("/b/beacon/pose"));
    }

    #[test]
    fn topics_that_differ_in_what_they_measure_alone_are_of_one_sensor() {
        let same = |a: &str, b: &str| sensor_words(a) == sensor_words(b);
        assert!(same("/gps1/pose", "/gps1/twist"));
        assert!(same("/local_position/pose", "/local_position/velocity_local"));
        assert!(same("/rov/usbl_position", "/rov/usbl/vel"));
        assert!(!same("/rov/usbl_position", "/rov/dvl_velocity"));
        assert!(!same("/gps1/pose", "/gps2/twist"));
        assert!(sensor_words("/fix").is_empty());
    }

    #[test]
    fn words_are_cut_at_signs_digits_and_capitals() {
        assert_eq!(words("/gtPose/ins_1"), ["gt", "pose", "ins"]);
        assert_eq!(words("/instrument/truths"), ["instrument", "truths"]);
    }

    #[test]
    fn a_bare_vector_is_what_its_topic_says() {
        assert!(vector_is("/beacon/velocity", Quantity::Velocity));
        assert!(!vector_is("/beacon/velocity", Quantity::Position));
        assert!(vector_is("/beacon/fix", Quantity::Position));
        assert!(!vector_is("/beacon/force", Quantity::Position));
    }
}
