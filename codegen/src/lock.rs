//! The machine-wide lock of the computer algebra system.
//!
//! Symbolica's free licence allows one process a machine, and a second one aborts. Whoever has a child process
//! differentiate holds this lock until the child is gone, so that two builds, or a build beside the tests, wait for each
//! other instead.

use std::fs::{File, OpenOptions};
use std::path::PathBuf;

/// Names another lock file, for machines whose temporary folder is not shared by all users.
pub const LOCK_VARIABLE: &str = "TENSORMASS_SYMBOLICA_LOCK";

/// Where the lock lies: `TENSORMASS_SYMBOLICA_LOCK`, or a file in the system's temporary folder.
pub fn path() -> PathBuf {
    match std::env::var_os(LOCK_VARIABLE) {
        Some(path) if !path.is_empty() => PathBuf::from(path),
        _ => std::env::temp_dir().join("tensormass-symbolica.lock"),
    }
}

/// The lock, held until the value is dropped or the process ends.
#[derive(Debug)]
pub struct MachineLock(#[allow(dead_code, reason = "the open file is the lock")] File);

impl MachineLock {
    /// Waits until no other process holds the lock, then takes it.
    ///
    /// # Errors
    /// The lock file cannot be opened or locked.
    pub fn acquire() -> std::io::Result<Self> {
        // An existing file is opened without O_CREAT where possible: a sticky temporary folder may refuse O_CREAT on
        // another user's file.
        let path = path();
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .open(&path)
            .or_else(|_| OpenOptions::new().create(true).append(true).open(&path))?;
        file.lock()?;
        Ok(Self(file))
    }
}
