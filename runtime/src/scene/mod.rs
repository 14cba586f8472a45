//! Scenes: TOML text -> positioned tree -> checked against the schema -> typed [`Scene`].
//!
//! | stage | input | output |
//! |---|---|---|
//! | `document` | text, overrides | tree in which each key and value knows its place |
//! | `shape` | tree, JSON schema | the tree, with keys, types, names and ranges checked |
//! | `model`, `obstacle`, `solver`, `output` | tree | typed data, by serde |
//! | `check` | typed data, tree | what no schema can say: unique names, increasing times, .. |
//!
//! Laws, groups of the mesh and files beside the scene are looked up by later stages; they report what they miss with
//! [`Scene::locate`] and [`SceneError::at`].

mod check;
mod document;
mod error;
mod model;
mod obstacle;
mod output;
mod overrides;
mod predicate;
mod schema;
mod selection;
mod shape;
mod solver;
mod suggest;

pub use error::{Fault, Location, SceneError};
pub use model::{
    About, Axis, Beam, Boundary, History, Initial, Load, MOST_PARTS, Material, Mesh, Motion, Parameter, ParameterValue,
    PerElement, Ramp, SceneData, Torus,
};
pub use obstacle::{Angle, Friction, Obstacle, Rod, Rotate, Shape, Surface};
pub use output::{Component, EnergyPart, Field, Output, Probe, Statistic, StressComponent};
pub use overrides::Override;
pub use predicate::{ExpressionError, Predicate};
pub use schema::json_schema;
pub use selection::{BoundingBox, Selection, SelectionKind};
pub use solver::{ConjugateGradient, Integrator, Mass, Newton, Precision, Preconditioner, Solver, TangentChoice};

use document::Document;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A checked scene: its data, and the text it came from.
#[derive(Debug, Clone)]
pub struct Scene {
    data: SceneData,
    path: PathBuf,
    document: Arc<Document>,
}

impl Deref for Scene {
    type Target = SceneData;

    fn deref(&self) -> &SceneData {
        &self.data
    }
}

impl Scene {
    /// The scene file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A path written in the scene, as seen from the current folder: it is relative to the scene file.
    pub fn resolve(&self, file: &Path) -> PathBuf {
        self.path.parent().map_or_else(|| file.to_owned(), |folder| folder.join(file))
    }

    /// Where a value was written. The path is keys and indices joined by dots, such as
    /// `material.0.parameters.young`; for a value that was left out it is the place of what should hold it.
    pub fn locate(&self, path: &str) -> Location {
        self.document.at(self.document.find(path))
    }

    /// Where a key was written, for errors about the key rather than its value; else as [`Scene::locate`].
    pub fn locate_key(&self, path: &str) -> Location {
        self.document.at_key(self.document.find(path))
    }

    /// What the scene says to no effect, one sentence each.
    pub fn warnings(&self) -> Vec<String> {
        check::warnings(&self.data, &self.document)
    }
}

/// Reads a scene file and applies overrides in their order.
///
/// # Errors
/// The file cannot be read, or the first thing in it, or in an override, that is wrong.
pub fn load(path: impl AsRef<Path>, overrides: &[Override]) -> Result<Scene, SceneError> {
    let path = path.as_ref();
    let text = std::fs::read_to_string(path)
        .map_err(|source| SceneError::Read { path: path.display().to_string(), source })?;
    parse(&text, path, overrides)
}

/// As [`load`], from text; `path` names it in errors and places the files it speaks of.
///
/// # Errors
/// The first thing in the text, or in an override, that is wrong.
pub fn parse(text: &str, path: impl AsRef<Path>, overrides: &[Override]) -> Result<Scene, SceneError> {
    let path = path.as_ref();
    let mut document = Document::parse(text, &path.display().to_string())?;
    for change in overrides {
        document.apply(change)?;
    }
    shape::check(&document)?;
    let data: SceneData = serde_path_to_error::deserialize(document.root.to_json()).map_err(|error| {
        // The schema is made from the same types, so this is reached only if serde is stricter than it.
        let at = document.at(document.find(&error.path().to_string().replace('[', ".").replace(']', "")));
        SceneError::at(at, error.into_inner().to_string(), "see docs/scenes.md for what is expected here")
    })?;
    check::check(&data, &document)?;
    Ok(Scene { data, path: path.to_owned(), document: Arc::new(document) })
}
