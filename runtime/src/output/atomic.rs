//! Files that appear under their final name only when they are complete, and the error of every writer.

use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Why a result could not be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The system refused.
    #[error("cannot write {}: {source}; {}", path.display(), remedy(source))]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The values do not fit the mesh or the table.
    #[error("cannot write {}: {reason}; give every array the length that its points, elements or columns ask for", path.display())]
    Shape {
        /// The file.
        path: PathBuf,
        /// Which array, its length, and the length that it should have.
        reason: String,
    },
}

impl OutputError {
    pub(super) fn io(path: &Path) -> impl FnOnce(io::Error) -> OutputError + '_ {
        move |source| OutputError::Io { path: path.to_owned(), source }
    }

    pub(super) fn shape(path: &Path, reason: String) -> OutputError {
        OutputError::Shape { path: path.to_owned(), reason }
    }
}

/// What to do about a failed write.
fn remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        ErrorKind::NotFound => "create the folder, or give another one with --out",
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            "make the folder writable, or give another one with --out"
        }
        ErrorKind::NotADirectory | ErrorKind::AlreadyExists => {
            "a file stands where a folder is needed: remove it, or give another folder with --out"
        }
        ErrorKind::IsADirectory => "a folder stands where the file goes: remove it, or give another folder with --out",
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
            "free some space, write fewer frames, or give a folder on another disk with --out"
        }
        _ => "check the folder and the disk, or give another folder with --out",
    }
}

/// Creates a folder for results, with its parents; one that exists is fine.
///
/// # Errors
/// [`OutputError::Io`] if it cannot be created.
pub fn create_folder(path: &Path) -> Result<(), OutputError> {
    fs::create_dir_all(path).map_err(OutputError::io(path))
}

/// Removes a file, if it is there.
///
/// # Errors
/// [`OutputError::Io`] if it is there and cannot be removed.
pub fn remove_file(path: &Path) -> Result<(), OutputError> {
    match fs::remove_file(path) {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(OutputError::io(path)(e)),
        _ => Ok(()),
    }
}

/// Writes a file under a temporary name in the same folder, then renames it: whoever reads `path` finds the old file or
/// the whole new one, also if the program is killed. (It does not wait for the disk, so a power failure may still lose
/// the newest files.)
///
/// # Errors
/// [`OutputError::Io`] if the file cannot be written; the temporary file is then removed.
pub fn write_atomic(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), OutputError> {
    static COUNTER: AtomicU64 = AtomicU64::new(0);
    let Some(name) = path.file_name() else {
        let source = io::Error::new(ErrorKind::IsADirectory, "the path names no file");
        return Err(OutputError::Io { path: path.to_owned(), source });
    };
    // The process and a counter in the name: neither another run nor another thread writes to the same file.
    let mut temporary = std::ffi::OsString::from(".");
    temporary.push(name);
    temporary.push(format!(".{}-{}.tmp", std::process::id(), COUNTER.fetch_add(1, Ordering::Relaxed)));
    let temporary = path.with_file_name(temporary);

    let written = (|| {
        let mut file = BufWriter::new(File::create(&temporary)?);
        content(&mut file)?;
        // Not left to drop, which would swallow the error of a full disk.
        file.into_inner().map_err(io::IntoInnerError::into_error)?;
        fs::rename(&temporary, path)
    })();
    written.map_err(|source| {
        // The first error is the one to report; the file may not even exist.
        let _ = fs::remove_file(&temporary);
        OutputError::Io { path: path.to_owned(), source }
    })
}

/// Writes a whole text as [`write_atomic`] does.
pub(super) fn write_text(path: &Path, text: &str) -> Result<(), OutputError> {
    write_atomic(path, |file| file.write_all(text.as_bytes()))
}

/// Text for an XML attribute in double quotes.
pub(super) fn escape_xml(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            // Control characters are not allowed in XML 1.0, not even escaped, but for three that a parser normalises.
            c if c.is_control() => escaped.push(' '),
            c => escaped.push(c),
        }
    }
    escaped
}
