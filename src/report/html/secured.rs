//! What keeps a page from running anything but its own scripts, and from reaching any network.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use serde::Serialize;
use sha2::{Digest, Sha256};

/// The page's Content-Security-Policy: nothing may be loaded, and of scripts and styles only these may be used, by their
/// hashes.
pub(super) fn policy(scripts: &[&str], styles: &[&str]) -> String {
    let hash = |text: &&str| format!(" 'sha256-{}'", BASE64_STANDARD.encode(Sha256::digest(text.as_bytes())));
    let hashes = |texts: &[&str]| texts.iter().map(hash).collect::<String>();
    format!(
        "default-src 'none'; script-src{}; style-src{}; base-uri 'none'; form-action 'none'",
        hashes(scripts),
        hashes(styles)
    )
}

/// The value as JSON that can stand in a `script` element: without a `<` there is no end of it, and no comment.
pub(super) fn embedded(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default().replace('<', "\\u003c")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_policy_names_the_hash_that_a_browser_computes() {
        // printf 'alert(1)' | openssl dgst -sha256 -binary | base64
        let policy = policy(&["alert(1)"], &[]);
        assert!(
            policy.contains("script-src 'sha256-bhHHL3z2vDgxUt0W3dWQOrprscmda2Y5pLsLg4GF+pI=';"),
            "{policy}"
        );
        assert!(!policy.contains("unsafe") && policy.starts_with("default-src 'none';"));
    }

    #[test]
    fn embedded_json_has_no_end_of_a_script_and_is_still_the_same() {
        let hostile = "</script><!--<script>\u{2028}\"";
        let text = embedded(&hostile);
        assert!(!text.contains('<'), "{text}");
        assert_eq!(serde_json::from_str::<String>(&text).expect("JSON"), hostile);
    }
}
