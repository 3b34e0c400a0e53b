//! The report in a browser: everything is drawn, nothing that a log says runs, nothing is complained of.
//!
//! `TRACKFUSE_TEST_BROWSER` names a Chromium; without it this is skipped.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use trackfuse::simulate::{DiveConstants, UsblConstants, dive, watch_by_usbl};

/// What runs in a browser that takes it for markup.
const HOSTILE: &str = "</script><img src=x onerror=document.documentElement.dataset.ran=1>";

fn browser() -> Option<PathBuf> {
    let found = std::env::var_os("TRACKFUSE_TEST_BROWSER").filter(|path| !path.is_empty()).map(PathBuf::from);
    if found.is_none() {
        // past the test runner, which would keep it to itself
        let said = b"skipped: TRACKFUSE_TEST_BROWSER is not set\n";
        let _ = std::io::Write::write_all(&mut std::io::stderr(), said);
    }
    found
}

/// Runs a command that writes into `folder` and opens its report; the page as the browser has it then.
fn opened(browser: &Path, folder: &Path, command: &str, args: &[&str]) -> String {
    let done = Command::new(env!("CARGO_BIN_EXE_trackfuse"))
        .arg(command)
        .args(args)
        .args(["-o", "out.mcap", "--report", "report.html", "--force"])
        .current_dir(folder)
        .output()
        .expect("the program runs");
    let code = done.status.code();
    assert!(matches!(code, Some(0 | 3)), "{}", String::from_utf8_lossy(&done.stderr));
    let done = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=5000"])
        .args(["--enable-logging=stderr", "--window-size=1000,800", "--dump-dom"])
        .arg(format!("--user-data-dir={}", folder.join("profile").display()))
        .arg(format!("file://{}", folder.join("report.html").display()))
        .output()
        .expect("the browser runs");
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{said}");
    let complaints: Vec<&str> = said.lines().filter(|line| line.contains("CONSOLE")).collect();
    assert!(complaints.is_empty(), "{complaints:#?}");
    String::from_utf8(done.stdout).expect("a page is UTF-8")
}

/// Fails unless every place for a drawing has one.
fn assert_drawn(page: &str) {
    let places = page.matches("<div class=\"plot\">").count() + page.matches("<div class=\"space\">").count();
    assert!(places > 10, "{places} places for plots");
    assert!(page.contains(&format!("data-drawn=\"{places}\"")), "{}", &page[..page.len().min(400)]);
    assert_eq!(page.matches("<canvas").count(), places);
}

#[test]
fn the_report_of_a_climb_is_drawn_without_a_complaint() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("sample_logs");
    let of = |name: &str| samples.join(name).display().to_string();
    let page = opened(
        &browser,
        folder.path(),
        "fuse",
        &[&of("steep_climb.mcap"), "--config", &of("steep_climb.config.toml")],
    );
    assert_drawn(&page);
}

#[test]
fn nothing_that_a_log_or_a_config_says_runs_in_the_browser() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("in.mcap"), hostile_log()).expect("a file");
    let config = format!(
        "[[source]]\nname = '{HOSTILE}'\nposition = \"/tether.p\"\n\
         [[characteristic_point]]\nname = '{HOSTILE}'\nz_m = -1.0\n"
    );
    fs::write(folder.path().join("in.toml"), config).expect("a file");
    let page = opened(&browser, folder.path(), "fuse", &["in.mcap", "--config", "in.toml"]);
    assert_drawn(&page);
    assert!(!page.contains("data-ran"), "a script of the log ran");
    assert!(!page.contains("<img"), "an element of the log is in the page");
    assert!(page.matches("&lt;/script&gt;&lt;img").count() > 5, "its names are there to be read");
}

#[test]
fn the_report_of_a_dive_is_drawn_and_nothing_that_its_log_says_runs() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("in.mcap"), hostile_dive()).expect("a file");
    for prediction in ["improved", "paper"] {
        let config = format!("[usbl]\nsigma_m = 3.0\nprediction = \"{prediction}\"\n");
        fs::write(folder.path().join("in.toml"), config).expect("a file");
        let page = opened(&browser, folder.path(), "usbl", &["in.mcap", "--config", "in.toml"]);
        assert_drawn(&page);
        assert!(!page.contains("data-ran"), "a script of the log ran");
        assert!(!page.contains("<img"), "an element of the log is in the page");
        assert!(page.matches("&lt;/script&gt;&lt;img").count() > 2, "its names are there to be read");
        for sign in ["× off by itself", "+ off with its exchange"] {
            assert!(page.contains(sign), "{sign}");
        }
    }
}

/// A dive with wild fixes and a silence; its topic and its frame are markup.
fn hostile_dive() -> Vec<u8> {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let truth = dive(&DiveConstants::default(), &mut rng);
    let watched = UsblConstants { wild_fixes: 0.3, wild_cycles: 0.05, ..UsblConstants::default() };
    let mut log = mcap::Writer::new(std::io::Cursor::new(Vec::new())).expect("a writer");
    let none = std::collections::BTreeMap::new();
    let channel_id = log.add_channel(0, &format!("/usbl{HOSTILE}"), "json", &none).expect("a channel");
    for fix in watch_by_usbl(&truth, 1800.0, &watched, &mut rng).fixes {
        let time = 1_731_000_000_000_000_000 + (fix.sample.time_s * 1e9) as u64;
        let header =
            mcap::records::MessageHeader { channel_id, sequence: 0, log_time: time, publish_time: time };
        let [x, y, z] = fix.sample.value;
        let message = serde_json::json!({ "frame_id": HOSTILE, "position": { "x": x, "y": y, "z": z } });
        log.write_to_known_channel(&header, message.to_string().as_bytes()).expect("a message");
    }
    log.finish().expect("a log");
    log.into_inner().into_inner()
}

/// A rising sensor whose frame is markup, beside a topic whose name is.
fn hostile_log() -> Vec<u8> {
    let mut log = mcap::Writer::new(std::io::Cursor::new(Vec::new())).expect("a writer");
    for topic in ["/tether".to_owned(), format!("/beacon{HOSTILE}")] {
        let none = std::collections::BTreeMap::new();
        let channel_id = log.add_channel(0, &topic, "json", &none).expect("a channel");
        for i in 0..200_u32 {
            let time = 1_731_000_000_000_000_000 + u64::from(i) * 50_000_000;
            let header =
                mcap::records::MessageHeader { channel_id, sequence: i, log_time: time, publish_time: time };
            let z = -5.0 + 0.05 * f64::from(i) + 0.01 * f64::from(i * 7 % 5);
            let message = serde_json::json!({ "frame_id": HOSTILE, "p": { "x": 0.1 * z, "y": 1.0, "z": z } });
            log.write_to_known_channel(&header, message.to_string().as_bytes()).expect("a message");
        }
    }
    log.finish().expect("a log");
    log.into_inner().into_inner()
}
