//! What a user may have meant by a name that is no log's: for hints.

use std::fs;
use std::path::Path;

use super::disk;
use crate::printable::shell_word;

/// Names that are less alike are no slip of the finger.
const ALIKE: f64 = 0.8;
/// Most names that a hint lists.
const SHOWN: usize = 5;

/// The logs in a folder, in order of their names.
fn logs_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    let mut logs: Vec<String> = names
        .filter(|name| !name.starts_with('.') && Path::new(name).extension().is_some_and(|e| e == "mcap"))
        .collect();
    logs.sort();
    logs
}

/// Of a path that can't be opened as a log.
pub(super) fn hint(path: &Path) -> Option<String> {
    let shown = |name: &String| shell_word(&path.with_file_name(name).to_string_lossy());
    if path.is_dir() {
        let logs = logs_in(path);
        let named: Vec<String> =
            logs.iter().take(SHOWN).map(|name| shell_word(&path.join(name).to_string_lossy())).collect();
        return Some(match named.len() {
            0 => "it holds no `.mcap`".into(),
            _ => format!("it holds {}{}", named.join(", "), if logs.len() > SHOWN { ", ..." } else { "" }),
        });
    }
    if path.exists() {
        return None;
    }
    let folder = disk::folder(path);
    if !folder.is_dir() {
        return Some(format!("there is no folder {}", shell_word(&folder.to_string_lossy())));
    }
    let asked = path.file_name()?.to_string_lossy();
    let logs = logs_in(folder);
    let score = |name: &String| strsim::jaro_winkler(&asked, name);
    let nearest = logs.iter().max_by(|a, b| score(a).total_cmp(&score(b)))?;
    if score(nearest) >= ALIKE {
        return Some(format!("did you mean {}?", shown(nearest)));
    }
    let list: Vec<String> = logs.iter().take(SHOWN).map(shown).collect();
    Some(format!("its folder holds {}{}", list.join(", "), if logs.len() > SHOWN { ", ..." } else { "" }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_is_named_a_folder_tells_its_logs_and_a_missing_folder_is_said_to_be_missing() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["dive_1.mcap", "dive_2.mcap", "notes.txt", ".hidden.mcap"] {
            fs::write(folder.path().join(name), "").expect("a file");
        }
        let said = |name: &str| hint(&folder.path().join(name)).expect("a hint");
        assert!(said("dvie_2.mcap").ends_with("/dive_2.mcap?"), "{}", said("dvie_2.mcap"));
        let other = said("zzz");
        assert!(
            other.starts_with("its folder holds ") && !other.contains("notes") && !other.contains("hidden")
        );
        assert!(said("").starts_with("it holds ") && said("").ends_with("/dive_2.mcap"), "{}", said(""));
        assert!(said("none/a.mcap").starts_with("there is no folder "));
        assert_eq!(hint(&folder.path().join("notes.txt")), None);
    }
}
