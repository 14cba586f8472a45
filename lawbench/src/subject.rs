//! What is examined: a law file with its derivation, of this build or from a path.

use std::path::{Path, PathBuf};

use tensormass_codegen::derivation::{self, Derivation, DerivationError};
use tensormass_codegen::law::{self, LawError, ast::Law};
use tensormass_codegen::worker::{self, WorkerError};
use tensormass_kernels::{LawEntry, laws};

/// A law and its kernels.
#[derive(Debug)]
pub struct Subject {
    /// The law file, read and checked.
    pub law: Law,
    /// Its kernels.
    pub derivation: Derivation,
    /// Where the kernels come from.
    pub origin: Origin,
}

/// Where a subject's kernels come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    /// This build has the law.
    Build,
    /// `derived/NAME.ir` beside the law file.
    Beside(PathBuf),
    /// Differentiated just now.
    Derived,
}

/// Why there is nothing to examine.
#[derive(Debug, thiserror::Error)]
pub enum SubjectError {
    /// No law of this build has the name, and it is no path.
    #[error("there is no law `{name}`; {}{}", meant(name), known())]
    Unknown {
        /// The name that was asked for.
        name: String,
    },
    /// The law file, or the derivation beside it, cannot be read.
    #[error("{}: {source}; give the path of a law file, a text as laws/README.md describes", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        #[source]
        source: std::io::Error,
    },
    /// The law file has errors.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Law(Vec<LawError>),
    /// The derivation beside the law file is of its text, and yet no derivation.
    #[error("{}: {source}; remove it, or write it again with `tensormass law derive`", path.display())]
    Derivation {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        #[source]
        source: DerivationError,
    },
    /// There is no fitting derivation, and this build cannot make one.
    #[error(
        "{}: there is no derivation of this text in {}, and this build cannot differentiate; build with `--features \
         derive`, or put the derivation there", path.display(), beside.display()
    )]
    NotDerived {
        /// The law file.
        path: PathBuf,
        /// Where its derivation is looked for.
        beside: PathBuf,
    },
    /// The differentiation failed.
    #[error(transparent)]
    Worker(#[from] WorkerError),
}

/// "did you mean `NAME`? " if a law's name is near.
fn meant(name: &str) -> String {
    let near = laws()
        .iter()
        .map(|l| (strsim::osa_distance(&name.to_lowercase(), l.info.name), l.info.name))
        .filter(|(distance, law)| *distance <= law.chars().count() / 3)
        .min();
    near.map(|(_, law)| format!("did you mean `{law}`? ")).unwrap_or_default()
}

fn known() -> String {
    let names: Vec<&str> = laws().iter().map(|l| l.info.name).collect();
    format!("the laws of this build are: {}; a law file is given by its path", names.join(", "))
}

impl Subject {
    /// A law of this build by its name, or a law file by its path (it has an extension, or a folder).
    ///
    /// A law file's kernels are those of `derived/NAME.ir` beside it where that is of the same text, and are derived
    /// otherwise.
    ///
    /// # Errors
    /// See [`SubjectError`].
    pub fn open(name_or_path: &str) -> Result<Self, SubjectError> {
        let path = Path::new(name_or_path);
        if path.extension().is_some() || name_or_path.contains(std::path::is_separator) {
            return Self::from_path(path);
        }
        match laws().iter().find(|l| l.info.name == name_or_path) {
            Some(entry) => Ok(Self::of_build(entry)),
            None => Err(SubjectError::Unknown { name: name_or_path.to_string() }),
        }
    }

    /// A law of this build.
    ///
    /// # Panics
    /// The build printed kernels from a text that is no law: it would not have compiled.
    pub fn of_build(entry: &LawEntry) -> Self {
        let path = format!("laws/{}.rs", entry.info.name);
        let law = law::parse(&path, entry.source.law).expect("the generator read the same text");
        let derivation = Derivation::from_text(entry.source.derivation).expect("the generator wrote this text");
        Self { law, derivation, origin: Origin::Build }
    }

    /// A law file and the text of its derivation.
    ///
    /// # Errors
    /// [`SubjectError::Law`] or [`SubjectError::Derivation`].
    pub fn from_texts(path: &str, law: &str, derivation: &str) -> Result<Self, SubjectError> {
        let law = law::parse(path, law).map_err(SubjectError::Law)?;
        let derivation = Derivation::from_text(derivation)
            .map_err(|source| SubjectError::Derivation { path: PathBuf::from(path), source })?;
        Ok(Self { law, derivation, origin: Origin::Beside(PathBuf::from(path)) })
    }

    fn from_path(path: &Path) -> Result<Self, SubjectError> {
        let unreadable = |path: &Path| {
            let path = path.to_path_buf();
            move |source| SubjectError::Unreadable { path, source }
        };
        let text = std::fs::read_to_string(path).map_err(unreadable(path))?;
        let law = law::parse(&path.to_string_lossy(), &text).map_err(SubjectError::Law)?;
        let beside = path.with_file_name("derived").join(format!("{}.ir", law.name));
        match std::fs::read_to_string(&beside) {
            // A derivation of an earlier text is no derivation of this one.
            Ok(derived) if derived.contains(&format!("\nhash {:016x}\n", derivation::hash(&text))) => {
                let derivation = Derivation::from_text(&derived)
                    .map_err(|source| SubjectError::Derivation { path: beside.clone(), source })?;
                return Ok(Self { law, derivation, origin: Origin::Beside(beside) });
            }
            Ok(_) => {}
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {}
            Err(e) => return Err(unreadable(&beside)(e)),
        }
        if !worker::available() {
            return Err(SubjectError::NotDerived { path: path.to_path_buf(), beside });
        }
        let scratch = tempfile::tempdir().map_err(WorkerError::Io)?;
        let derivation = worker::derive(&[(path.to_path_buf(), law.clone())], scratch.path())?.remove(0);
        Ok(Self { law, derivation, origin: Origin::Derived })
    }

    /// The law's name.
    pub fn name(&self) -> &str {
        &self.law.name
    }
}
