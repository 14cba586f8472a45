//! A build script's whole work: law files in, one file of Rust kernels out.

use std::path::{Path, PathBuf};

use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use crate::derivation::{self, Derivation, DerivationError};
use crate::element;
use crate::ir::Input;
use crate::law::ast::Law;
use crate::law::{self, LawError};
use crate::print::{rust, wgsl};
use crate::worker::{self, WorkerError};

/// Why kernels could not be generated.
#[derive(Debug, thiserror::Error)]
pub enum GenerateError {
    /// A file cannot be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        #[source]
        source: std::io::Error,
    },
    /// Law files with errors.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Law(Vec<LawError>),
    /// Without the feature `derive`, a law's committed derivation is missing or out of date.
    #[error(
        "laws/{law}.rs: its derivation laws/derived/{law}.ir is {state}, and this build cannot differentiate. Remedies: \
         build with `--features derive` (differentiates at build time), or `cargo xtask law accept {law}` (writes the \
         derivation)"
    )]
    Derivation {
        /// The law.
        law: String,
        /// Missing, stale or unreadable.
        state: String,
    },
    /// The differentiation failed.
    #[error(transparent)]
    Worker(#[from] WorkerError),
    /// An element's declaration is refused.
    #[error(transparent)]
    Element(#[from] element::ElementError),
    /// A printed text is not Rust: a defect of the generator.
    #[error("the generated text is not Rust (please report this): {0}")]
    Print(#[from] syn::Error),
}

fn io(path: &Path) -> impl FnOnce(std::io::Error) -> GenerateError {
    let path = path.to_path_buf();
    move |source| GenerateError::Io { path, source }
}

/// A law with its derivation.
#[derive(Debug)]
pub struct GeneratedLaw {
    /// The law file.
    pub law: Law,
    /// Its kernels.
    pub derivation: Derivation,
    /// Whether the committed derivation exists and is the one for this text.
    pub reviewed: bool,
}

/// Build script entry: generates `OUT_DIR/kernels.rs` from the law files in `laws` (relative to the package) and ends
/// the process with a message if that fails.
///
/// ```no_run
/// fn main() {
///     tensormass_codegen::build("laws");
/// }
/// ```
#[allow(clippy::needless_doctest_main, reason = "the example is a whole build script")]
pub fn build(laws: &str) {
    worker::run_if_requested();
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed={laws}");
    let out = std::env::var_os("OUT_DIR").map(PathBuf::from).expect("cargo sets OUT_DIR for build scripts");
    println!("cargo::rustc-env=TENSORMASS_GENERATED={}", out.display());
    if let Err(error) = generate(Path::new(laws), &out) {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

/// Generates `kernels.rs`, what the kernels crate shares with this one (`remainder.rs`, `twofold.rs`), the fresh derivations (`derived/NAME.ir`) and the law files as plain Rust
/// (`oracle/NAME.rs`, and `oracle/all.rs` with a module and a table entry for each; see [`crate::oracle`]).
///
/// # Errors
/// See [`GenerateError`].
pub fn generate(laws: &Path, out: &Path) -> Result<Vec<GeneratedLaw>, GenerateError> {
    generate_from(laws, out, worker::available())
}

/// As [`generate`] in a build without the feature `derive`: prints the committed derivations and differentiates nothing.
///
/// # Errors
/// See [`GenerateError`].
pub fn generate_committed(laws: &Path, out: &Path) -> Result<Vec<GeneratedLaw>, GenerateError> {
    generate_from(laws, out, false)
}

fn generate_from(laws: &Path, out: &Path, derive: bool) -> Result<Vec<GeneratedLaw>, GenerateError> {
    let parsed = read_laws(laws)?;
    let fresh = out.join("derived");
    if fresh.exists() {
        std::fs::remove_dir_all(&fresh).map_err(io(&fresh))?;
    }
    let committed: Vec<Result<Derivation, String>> =
        parsed.iter().map(|(_, law)| committed(laws, law)).collect::<Result<_, _>>()?;
    let derivations = if derive {
        worker::derive(&parsed, &fresh)?
    } else {
        committed
            .iter()
            .zip(&parsed)
            .map(|(c, (_, law))| c.clone().map_err(|state| GenerateError::Derivation { law: law.name.clone(), state }))
            .collect::<Result<_, _>>()?
    };
    let mut generated = Vec::new();
    for (((_, law), derivation), committed) in parsed.into_iter().zip(derivations).zip(committed) {
        generated.push(GeneratedLaw { law, derivation, reviewed: committed.is_ok() });
    }
    let kernels = out.join("kernels.rs");
    std::fs::write(&kernels, print(&generated)?).map_err(io(&kernels))?;
    for (name, text) in [("remainder.rs", include_str!("remainder.rs")), ("twofold.rs", include_str!("twofold.rs"))] {
        let path = out.join(name);
        std::fs::write(&path, text).map_err(io(&path))?;
    }
    let oracle = out.join("oracle");
    std::fs::create_dir_all(&oracle).map_err(io(&oracle))?;
    let write = |file: &str, text: String| {
        let path = oracle.join(file);
        std::fs::write(&path, text).map_err(io(&path))
    };
    for g in &generated {
        write(&format!("{}.rs", g.law.name), crate::oracle::module(&g.law.text)?)?;
    }
    let names: Vec<&str> = generated.iter().map(|g| g.law.name.as_str()).collect();
    let dissipative = generated.iter().filter(|g| g.derivation.is_dissipative());
    let dissipative: Vec<&str> = dissipative.map(|g| g.law.name.as_str()).collect();
    write("all.rs", crate::oracle::table(&names, &dissipative)?)?;
    Ok(generated)
}

fn read_laws(folder: &Path) -> Result<Vec<(PathBuf, Law)>, GenerateError> {
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(io(folder))? {
        let path = entry.map_err(io(folder))?.path();
        if path.extension().is_some_and(|e| e == "rs") {
            paths.push(path);
        }
    }
    paths.sort();
    let (mut laws, mut errors) = (Vec::new(), Vec::new());
    for path in paths {
        let text = std::fs::read_to_string(&path).map_err(io(&path))?;
        match law::parse(&path.to_string_lossy(), &text) {
            Ok(law) => laws.push((std::path::absolute(&path).map_err(io(&path))?, law)),
            Err(e) => errors.extend(e),
        }
    }
    if errors.is_empty() { Ok(laws) } else { Err(GenerateError::Law(errors)) }
}

/// The committed derivation of a law, or why it cannot be used.
fn committed(laws: &Path, law: &Law) -> Result<Result<Derivation, String>, GenerateError> {
    let path = laws.join("derived").join(format!("{}.ir", law.name));
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Err("missing".into())),
        Err(e) => return Err(io(&path)(e)),
    };
    Ok(match Derivation::from_text(&text) {
        Ok(d) if d.law == law.name && d.hash == derivation::hash(&law.text) => Ok(d),
        Ok(_) => Err("stale (derived from another text of the law)".into()),
        Err(e) => Err(unreadable(&e)),
    })
}

fn unreadable(e: &DerivationError) -> String {
    format!("unreadable ({e})")
}

/// The text of `kernels.rs`.
///
/// # Errors
/// A defect of the generator: an element or a text that it refuses itself.
pub fn print(laws: &[GeneratedLaw]) -> Result<String, GenerateError> {
    let elements = element::declarations()?.iter().map(element::kernels).collect::<Result<Vec<_>, _>>()?;
    let modules: Vec<TokenStream> = laws.iter().map(|g| rust::law_module(&g.law, &g.derivation, g.reviewed)).collect();
    let names: Vec<_> = laws.iter().map(|g| format_ident!("{}", g.law.name)).collect();
    let printed: Vec<_> = laws.iter().map(|g| wgsl::LawFunctions::new(&g.law, &g.derivation)).collect();
    let functions = printed.iter().map(wgsl::LawFunctions::expression);
    let sources = laws.iter().map(|g| {
        let (law, derivation) = (&g.law.text, g.derivation.to_text());
        quote!(::tensormass_kernels::LawSource { law: #law, derivation: #derivation })
    });
    // What a law without a dissipation is printed as does not know of them.
    let damping = laws.iter().zip(&names).zip(&printed).map(|((g, name), functions)| {
        functions.damping_expression().map(|functions| {
            let linear = !g.derivation.kernel("ddamping").reads(Input::GradientRate);
            quote!(.with_damping::<#name::Law>(#linear, &#functions))
        })
    });
    let damping: Vec<Option<TokenStream>> = damping.collect();
    let names_of_elements: Vec<_> = elements.iter().map(|e| format_ident!("{}", e.declaration.name)).collect();
    let element_functions = elements.iter().map(wgsl::element_functions);
    let elements = elements.iter().map(rust::element_module);
    let tokens = quote! {
        #(#elements)*
        /// Every element, by name.
        pub static ELEMENTS: &[::tensormass_kernels::ElementEntry] =
            &[#(::tensormass_kernels::ElementEntry::new::<#names_of_elements::Element>(
                &#names_of_elements::INFO, &#element_functions,
            )),*];
        #(#modules)*
        /// Every law of the folder, by name.
        pub static LAWS: &[::tensormass_kernels::LawEntry] =
            &[#(::tensormass_kernels::LawEntry::new::<#names::Law>(&#names::INFO, &#sources, &#functions) #damping),*];
    };
    let text = rust::format(tokens)?;
    Ok(format!("// Generated by tensormass-codegen {}; do not edit.\n\n{text}", env!("CARGO_PKG_VERSION")))
}
