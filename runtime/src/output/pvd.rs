//! The PVD index: which VTU file shows which time.

use super::atomic::{OutputError, escape_xml, write_text};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Writes a PVD file anew after each frame, so that a running or killed simulation can be opened in ParaView.
#[derive(Debug)]
pub struct PvdWriter {
    path: PathBuf,
    /// The lines of the frames so far.
    frames: String,
}

impl PvdWriter {
    /// Writes an index without frames: an unwritable folder shows before the first step, and no frames of an earlier
    /// run stay listed.
    ///
    /// # Errors
    /// [`OutputError::Io`] if it cannot be written.
    pub fn create(path: &Path) -> Result<PvdWriter, OutputError> {
        let writer = PvdWriter { path: path.to_owned(), frames: String::new() };
        writer.write()?;
        Ok(writer)
    }

    /// Goes on with an index, of which frames after a time are dropped; how many are left.
    ///
    /// # Errors
    /// [`OutputError::Io`] if it cannot be read or written.
    pub fn resume(path: &Path, until: f64) -> Result<(PvdWriter, u32), OutputError> {
        let before = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(e) => return Err(OutputError::io(path)(e)),
        };
        let time = |line: &str| line.split("timestep=\"").nth(1)?.split('"').next()?.parse::<f64>().ok();
        let kept: Vec<&str> = before.lines().filter(|line| time(line).is_some_and(|t| t <= until)).collect();
        let frames = kept.iter().map(|line| format!("{line}\n")).collect();
        let writer = PvdWriter { path: path.to_owned(), frames };
        writer.write()?;
        Ok((writer, kept.len() as u32))
    }

    /// Adds a frame: its time (s) and its file, relative to the index's folder. Call it once that file is complete.
    ///
    /// # Errors
    /// [`OutputError::Io`] if the index cannot be written.
    pub fn push(&mut self, time: f64, file: &str) -> Result<(), OutputError> {
        let file = escape_xml(file);
        writeln!(self.frames, "    <DataSet timestep=\"{time:?}\" part=\"0\" file=\"{file}\"/>")
            .expect("writing to a String cannot fail");
        self.write()
    }

    fn write(&self) -> Result<(), OutputError> {
        let text = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n  \
             <Collection>\n{}  </Collection>\n</VTKFile>\n",
            self.frames
        );
        write_text(&self.path, &text)
    }
}
