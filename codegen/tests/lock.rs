//! Two processes that differentiate at once wait for each other: their work under the machine-wide lock never overlaps.
//!
//! This executable calls itself twice, at the same time. No computer algebra runs here, only the lock.

use std::io::Write;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use tensormass_codegen::lock::{LOCK_VARIABLE, MachineLock, path};

/// Where a child writes when it enters and leaves its work.
const LOG: &str = "TENSORMASS_TEST_LOCK_LOG";
/// Set where a child's work lasts until the other has begun its own.
const MEET: &str = "TENSORMASS_TEST_LOCK_MEET";
/// Longer than two processes started together are apart, so that without the lock their work would overlap.
const WORK: Duration = Duration::from_millis(500);

fn log(file: &Path, word: &str) {
    let mut file = std::fs::OpenOptions::new().create(true).append(true).open(file).expect("the log");
    // One write, so that two processes' lines do not mix.
    file.write_all(format!("{word} {}\n", std::process::id()).as_bytes()).expect("the log");
}

/// In a child, the work; otherwise nothing.
#[test]
fn child() {
    if let Some(file) = std::env::var_os(LOG) {
        log(Path::new(&file), "starts");
        let _lock = MachineLock::acquire().expect("the lock");
        log(Path::new(&file), "enters");
        let entered = || std::fs::read_to_string(&file).expect("the log").matches("enters").count();
        if std::env::var_os(MEET).is_some() {
            while entered() < 2 {
                std::thread::sleep(Duration::from_millis(10));
            }
        } else {
            std::thread::sleep(WORK);
        }
        log(Path::new(&file), "leaves");
    }
}

/// Runs two children on the given lock files and returns the events of their work, in order.
fn check(locks: [&Path; 2], overlap: bool) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("log");
    let children = locks.map(|lock| {
        let mut command = Command::new(std::env::current_exe().expect("this executable"));
        command.args(["--exact", "child"]).env(LOG, &file).env(LOCK_VARIABLE, lock).stdout(std::process::Stdio::null());
        if overlap {
            command.env(MEET, "1");
        }
        command.spawn().expect("a child")
    });
    for mut child in children {
        assert!(child.wait().expect("a child").success());
    }
    let text = std::fs::read_to_string(&file).expect("the log");
    let events: Vec<&str> = text.lines().filter(|l| !l.starts_with("starts")).collect();
    assert_eq!(events.len(), 4, "{text}");
    let one_after_the_other = |pair: &[&str]| pair[0].replace("enters", "leaves") == pair[1];
    assert_eq!(events.chunks(2).all(one_after_the_other), !overlap, "{text}");
}

#[test]
fn work_under_the_lock_never_overlaps() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let lock = folder.path().join("lock");
    check([&lock, &lock], false);
    // With a lock each, they do overlap: each works until the other does too.
    check([&folder.path().join("one"), &folder.path().join("two")], true);
}

#[test]
fn a_lock_file_left_behind_locks_nobody_out() {
    // The file of this machine, which a build may hold: only its place is looked at.
    assert!(std::env::var_os(LOCK_VARIABLE).is_some() || path().starts_with(std::env::temp_dir()));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("lock");
    for _ in 0..2 {
        let status = Command::new(std::env::current_exe().expect("this executable"))
            .args(["--exact", "child"])
            .env(LOG, folder.path().join("log"))
            .env(LOCK_VARIABLE, &file)
            .stdout(std::process::Stdio::null())
            .status();
        assert!(status.expect("a child").success());
    }
}
