//! Materials: which law and which constants each element has, gathered into one batch a law and kind of element.

use std::collections::BTreeMap;

use tensormass_kernels::{ElementEntry, LawEntry, law, laws};

use super::parameters::{self, Values};
use super::place::Places;
use crate::body::LawBatch;
use crate::mesh::{ElementId, Mesh};
use crate::order::{cluster_size, compact};
use crate::scale::Scale;
use crate::scene::{Scene, SceneError};

/// A material as it will be computed.
#[derive(Debug, Clone)]
pub struct MaterialReport {
    /// Its name in the scene, or `material N`.
    pub name: String,
    /// Its law.
    pub law: &'static LawEntry,
    /// How many elements are made of it.
    pub elements: usize,
    /// kg/m^3.
    pub density: f64,
    /// Whether its parameters vary from element to element.
    pub per_element: bool,
    /// The parameters, in the law's units; the first element's where they vary.
    pub parameters: Vec<f64>,
}

#[derive(Debug)]
struct Entry {
    report: MaterialReport,
    values: Values,
    members: Vec<u32>,
}

/// Every element's material.
#[derive(Debug)]
pub struct Assignment {
    entries: Vec<Entry>,
    of_element: Vec<usize>,
}

/// Assigns materials to the elements of a mesh: each element exactly one. `parts` elements are of each that the scene gives values for.
pub fn assign(scene: &Scene, places: &Places, (count, parts): (usize, usize)) -> Result<Assignment, SceneError> {
    let mut of_element: Vec<Option<usize>> = vec![None; count];
    let mut entries = Vec::new();
    for (i, material) in scene.material.iter().enumerate() {
        let Some(law) = law(&material.law) else {
            let names: Vec<&str> = laws().iter().map(|l| l.info.name).collect();
            let nearest = names.iter().max_by(|a, b| {
                strsim::jaro_winkler(a, &material.law).total_cmp(&strsim::jaro_winkler(b, &material.law))
            });
            let nearest = nearest.map(|n| format!("did you mean \"{n}\"? ")).unwrap_or_default();
            return Err(SceneError::at(
                scene.locate(&format!("material.{i}.law")),
                format!("there is no law \"{}\"", material.law),
                format!("{nearest}laws of this build: {}", names.join(", ")),
            ));
        };
        let path = format!("material.{i}.elements");
        let members = places.elements(scene, &path, &material.elements)?;
        let values = parameters::read(scene, i, material, law, (count / parts, parts))?;
        let name = material.name.clone().unwrap_or_else(|| format!("material {}", i + 1));
        for &e in &members {
            if let Some(other) = of_element[e as usize] {
                let other: &Entry = &entries[other];
                return Err(SceneError::at(
                    scene.locate(&path),
                    format!("element {e} already belongs to \"{}\"", other.report.name),
                    "let every element belong to exactly one material",
                ));
            }
            of_element[e as usize] = Some(i);
        }
        let report = MaterialReport {
            name,
            law,
            elements: members.len(),
            density: material.density,
            per_element: values.per_element,
            parameters: values.row(members[0]).to_vec(),
        };
        entries.push(Entry { report, values, members });
    }
    if let Some(e) = of_element.iter().position(Option::is_none) {
        let missing = of_element.iter().filter(|m| m.is_none()).count();
        return Err(SceneError::at(
            scene.locate("material"),
            format!("{missing} of {count} elements have no material, the first is element {e}"),
            "select them in one of the materials; elements = \"all\" selects every element",
        ));
    }
    Ok(Assignment { entries, of_element: of_element.into_iter().flatten().collect() })
}

impl Assignment {
    /// The largest parameter with the dimension of a stress (Pa).
    pub fn stiffness(&self) -> f64 {
        let mut largest = 0.0_f64;
        for entry in &self.entries {
            for row in &entry.values.rows {
                let mut components = row.iter();
                for p in entry.report.law.info.parameters {
                    for x in components.by_ref().take(p.len) {
                        if p.dimensions == [0, 1, 0] {
                            largest = largest.max(x.abs());
                        }
                    }
                }
            }
        }
        largest
    }

    /// The largest density (kg/m^3).
    pub fn density(&self) -> f64 {
        self.entries.iter().map(|e| e.report.density).fold(0.0, f64::max)
    }

    /// Each element's density (kg/m^3).
    pub fn densities(&self) -> impl Iterator<Item = f64> {
        self.of_element.iter().map(|&m| self.entries[m].report.density)
    }

    /// An element's parameters, in its law's units.
    pub fn parameters(&self, element: u32) -> &[f64] {
        self.entries[self.of_element[element as usize]].values.row(element)
    }

    /// What each material is.
    pub fn reports(&self) -> Vec<MaterialReport> {
        self.entries.iter().map(|e| e.report.clone()).collect()
    }

    /// One batch a law and kind of element, in the order of the laws' names and of the mesh's blocks; constants in scaled
    /// units.
    pub fn batches(&self, mesh: &Mesh, scale: &Scale) -> Vec<LawBatch> {
        let mut by_law: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
        for (i, entry) in self.entries.iter().enumerate() {
            by_law.entry(entry.report.law.info.name).or_default().push(i);
        }
        let mut batches = vec![];
        let centres = mesh.centres();
        for materials in by_law.into_values() {
            let mut elements: Vec<u32> =
                materials.iter().flat_map(|&m| self.entries[m].members.iter().copied()).collect();
            elements.sort_unstable();
            let kind = |e: &u32| mesh.kind(ElementId(*e));
            // The elements of a block have ascending numbers.
            let kinds = elements.chunk_by(|a, b| std::ptr::eq(kind(a), kind(b)));
            batches.extend(kinds.map(|of_kind| {
                let (mut elements, kind) = (of_kind.to_vec(), kind(&of_kind[0]));
                let size = cluster_size(kind.info.nodes, elements.len());
                compact(&mut elements, &centres, size);
                self.batch(&materials, elements, kind, scale)
            }));
        }
        batches
    }

    fn batch(
        &self,
        materials: &[usize],
        elements: Vec<u32>,
        element: &'static ElementEntry,
        scale: &Scale,
    ) -> LawBatch {
        let law = self.entries[materials[0]].report.law;
        let constants_of = |entry: &Entry, e: u32| {
            let mut row = entry.values.row(e).to_vec();
            let mut k = 0;
            for p in law.info.parameters {
                for x in &mut row[k..k + p.len] {
                    *x /= scale.unit(p.dimensions);
                }
                k += p.len;
            }
            law.constants(&row)
        };
        let one = materials.len() == 1 && !self.entries[materials[0]].values.per_element;
        let constants = if one {
            constants_of(&self.entries[materials[0]], elements[0])
        } else {
            // Materials of constant parameters are computed once, not once an element.
            let fixed: Vec<Option<Vec<f64>>> = self
                .entries
                .iter()
                .enumerate()
                .map(|(i, e)| (materials.contains(&i) && !e.values.per_element).then(|| constants_of(e, e.members[0])))
                .collect();
            elements
                .iter()
                .flat_map(|&e| {
                    let m = self.of_element[e as usize];
                    fixed[m].clone().unwrap_or_else(|| constants_of(&self.entries[m], e))
                })
                .collect()
        };
        LawBatch { law, element, elements, constants, per_element: !one }
    }
}
