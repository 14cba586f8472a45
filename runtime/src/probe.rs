//! Probes: numbers read off a state, by name.

use crate::body::{Constraint, LawBatch};
use crate::cpu::One;
use crate::mesh::{ElementId, MaterialPoint, Mesh, integrals};
use crate::model::place::Places;
use crate::scale::Scale;
use crate::scene::{Component, EnergyPart, Probe, Scene, SceneError, Statistic, StressComponent};

/// Energies of the whole body in J.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Energies {
    /// Of motion.
    pub kinetic: f64,
    /// Stored by deformation.
    pub elastic: f64,
    /// Potential of the loads.
    pub external: f64,
}

impl Energies {
    /// Their sum.
    pub fn total(&self) -> f64 {
        self.kinetic + self.elastic + self.external
    }
}

/// What some probes or fields read of a state.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Needs {
    /// The displacement of the nodes.
    pub displacement: bool,
    /// The velocity of the nodes.
    pub velocity: bool,
    /// Forces at the nodes.
    pub reactions: bool,
    /// Energies.
    pub energies: bool,
    /// Stresses of the elements.
    pub stresses: bool,
    /// Forces of contact.
    pub contact: bool,
}

impl Needs {
    /// What either reads.
    pub fn and(self, other: Self) -> Self {
        Self {
            displacement: self.displacement || other.displacement,
            velocity: self.velocity || other.velocity,
            reactions: self.reactions || other.reactions,
            energies: self.energies || other.energies,
            stresses: self.stresses || other.stresses,
            contact: self.contact || other.contact,
        }
    }
}

/// A state in SI units, with what was needed of it.
#[derive(Debug, Clone, Default)]
pub struct Snapshot {
    /// Displacement of each node in m, if needed.
    pub displacement: Vec<[f64; 3]>,
    /// Force that the supports exert on each node in N: what balances elements and loads, without inertia.
    pub reactions: Vec<[f64; 3]>,
    /// Energies in J.
    pub energies: Energies,
    /// Cauchy stress of each element in Pa.
    pub stresses: Vec<[f64; 9]>,
    /// Force of contact on each node in N.
    pub contact: Vec<[f64; 3]>,
}

#[derive(Debug)]
enum Reader {
    Displacement { nodes: Vec<u32>, component: Component, statistic: Statistic },
    Reaction { nodes: Vec<u32>, component: Component },
    Contact { nodes: Vec<u32>, component: Component },
    Modulus { axis: usize, fixed: Vec<u32>, moved: Vec<u32>, area: f64, length: f64 },
    Energy(EnergyPart),
    Volume(Vec<u32>),
    Stress { elements: Vec<u32>, component: StressComponent, statistic: Statistic },
    PointStress(Box<PointStress>),
}

/// The stress at a material point.
#[derive(Debug)]
struct PointStress {
    at: MaterialPoint,
    law: One,
    /// Pa in its unit of stress.
    unit: f64,
    component: StressComponent,
}

/// The probes of a scene, resolved on its mesh.
#[derive(Debug)]
pub struct Recorder {
    names: Vec<(String, &'static str)>,
    readers: Vec<Reader>,
    volumes: Vec<f64>,
}

impl Recorder {
    /// Resolves the probes of a scene.
    pub(crate) fn new(
        scene: &Scene,
        mesh: &Mesh,
        places: &Places,
        constraints: &[Constraint],
        batches: &[LawBatch],
        scale: &Scale,
    ) -> Result<Self, SceneError> {
        let held = |node: u32| constraints.iter().any(|c| c.node == node);
        let supported = |path: &str, nodes: &[u32]| {
            if nodes.iter().any(|&n| held(n)) {
                return Ok(());
            }
            Err(SceneError::at(
                scene.locate(path),
                format!("no node of `{path}` has a boundary condition: there is no support force to record"),
                "select nodes of a [[boundary]]",
            ))
        };
        let mut readers = Vec::new();
        for (i, probe) in scene.probe.iter().enumerate() {
            let path = |key: &str| format!("probe.{i}.{key}");
            let reader = match probe {
                Probe::Displacement { nodes, component, statistic, .. } => {
                    let nodes = places.nodes(scene, &path("nodes"), nodes)?;
                    Reader::Displacement { nodes, component: *component, statistic: *statistic }
                }
                Probe::Reaction { nodes, component, .. } => {
                    let nodes = places.nodes(scene, &path("nodes"), nodes)?;
                    supported(&path("nodes"), &nodes)?;
                    Reader::Reaction { nodes, component: *component }
                }
                Probe::ContactForce { nodes, component, .. } => {
                    if scene.obstacle.is_empty() {
                        return Err(SceneError::at(
                            scene.locate(&path("kind")),
                            "there is no contact force to record: the scene has no [[obstacle]]",
                            "add an [[obstacle]], or record a reaction",
                        ));
                    }
                    Reader::Contact { nodes: places.nodes(scene, &path("nodes"), nodes)?, component: *component }
                }
                Probe::ApparentYoungModulus { axis, fixed, moved, .. } => {
                    let fixed = places.nodes(scene, &path("fixed"), fixed)?;
                    let moved = places.nodes(scene, &path("moved"), moved)?;
                    supported(&path("moved"), &moved)?;
                    let axis = axis.index();
                    let mean = |nodes: &[u32]| mean(nodes, |n| mesh.nodes()[n as usize][axis]);
                    let length = mean(&moved) - mean(&fixed);
                    let area = end_area(mesh, &moved);
                    if length == 0.0 || area == 0.0 {
                        return Err(SceneError::at(
                            scene.locate(&path("moved")),
                            "the two ends have no distance along the axis, or the moved end covers no face of the boundary",
                            "select the nodes of two opposite end faces",
                        ));
                    }
                    Reader::Modulus { axis, fixed, moved, area, length }
                }
                Probe::Energy { part, .. } => Reader::Energy(*part),
                Probe::Volume { elements, .. } => {
                    Reader::Volume(places.elements(scene, &path("elements"), elements)?)
                }
                Probe::Stress { elements, component, statistic, .. } => Reader::Stress {
                    elements: places.elements(scene, &path("elements"), elements)?,
                    component: *component,
                    statistic: *statistic,
                },
                Probe::PointStress { point, component, .. } => {
                    let at = mesh.material_point(*point).ok_or_else(|| {
                        let [x, y, z] = point;
                        SceneError::at(
                            scene.locate(&path("point")),
                            format!("no element contains the point ({x}, {y}, {z})"),
                            "give a point inside the body at rest, in m",
                        )
                    })?;
                    let law = law_at(at.element, batches).expect("each element has a law");
                    Reader::PointStress(Box::new(PointStress { at, law, unit: scale.stress, component: *component }))
                }
            };
            readers.push(reader);
        }
        let names = scene.probe.iter().map(|p| (p.name().to_string(), p.unit())).collect();
        let volumes = mesh.elements().map(|e| mesh.volume(e)).collect();
        Ok(Self { names, readers, volumes })
    }

    /// Name and unit of each probe.
    pub fn names(&self) -> &[(String, &'static str)] {
        &self.names
    }

    /// What the probes read.
    pub fn needs(&self) -> Needs {
        let mut needs = Needs::default();
        for reader in &self.readers {
            match reader {
                Reader::Displacement { .. } | Reader::Volume(_) | Reader::PointStress { .. } => {
                    needs.displacement = true
                }
                Reader::Reaction { .. } => needs.reactions = true,
                Reader::Contact { .. } => needs.contact = true,
                Reader::Modulus { .. } => {
                    needs.displacement = true;
                    needs.reactions = true;
                }
                Reader::Energy(_) => needs.energies = true,
                Reader::Stress { .. } => needs.stresses = true,
            }
        }
        needs
    }

    /// The value of each probe.
    pub fn read(&self, mesh: &Mesh, state: &Snapshot) -> Vec<f64> {
        self.readers.iter().map(|r| self.value(r, mesh, state)).collect()
    }

    fn value(&self, reader: &Reader, mesh: &Mesh, state: &Snapshot) -> f64 {
        match reader {
            Reader::Displacement { nodes, component, statistic } => {
                let values = nodes.iter().map(|&n| (of_vector(state.displacement[n as usize], *component), 1.0));
                reduce(values, *statistic)
            }
            Reader::Reaction { nodes, component } => of_vector(total(nodes, &state.reactions), *component),
            Reader::Contact { nodes, component } => of_vector(total(nodes, &state.contact), *component),
            Reader::Modulus { axis, fixed, moved, area, length } => {
                let mean = |nodes: &[u32]| mean(nodes, |n| state.displacement[n as usize][*axis]);
                let strain = (mean(moved) - mean(fixed)) / length;
                let reaction = total(moved, &state.reactions)[*axis] * length.signum();
                // Before anything has moved there is no modulus to speak of.
                if strain == 0.0 { f64::NAN } else { reaction / area / strain }
            }
            Reader::Energy(part) => match part {
                EnergyPart::Kinetic => state.energies.kinetic,
                EnergyPart::Elastic => state.energies.elastic,
                EnergyPart::External => state.energies.external,
                EnergyPart::Total => state.energies.total(),
            },
            Reader::Volume(elements) => {
                elements.iter().map(|&e| current_volume(mesh, e as usize, &state.displacement)).sum()
            }
            Reader::Stress { elements, component, statistic } => {
                let values = elements
                    .iter()
                    .map(|&e| (of_stress(&state.stresses[e as usize], *component), self.volumes[e as usize]));
                reduce(values, *statistic)
            }
            Reader::PointStress(point) => {
                let PointStress { at, law, unit, component } = &**point;
                let g = at.displacement_gradient(mesh, &state.displacement);
                of_stress(&law.cauchy(&g).map(|x| x * unit), *component)
            }
        }
    }
}

/// The law of an element, alone.
fn law_at(element: ElementId, batches: &[LawBatch]) -> Option<One> {
    batches.iter().find_map(|batch| {
        let index = batch.elements.iter().position(|e| *e == element.0)?;
        let count = batch.law.info.constants.len();
        let start = if batch.per_element { index * count } else { 0 };
        Some(One::point(batch.law, &batch.constants[start..start + count]))
    })
}

fn mean(nodes: &[u32], value: impl Fn(u32) -> f64) -> f64 {
    nodes.iter().map(|&n| value(n)).sum::<f64>() / nodes.len() as f64
}

fn total(nodes: &[u32], values: &[[f64; 3]]) -> [f64; 3] {
    std::array::from_fn(|c| nodes.iter().map(|&n| values[n as usize][c]).sum())
}

fn of_vector(v: [f64; 3], component: Component) -> f64 {
    match component {
        Component::X => v[0],
        Component::Y => v[1],
        Component::Z => v[2],
        Component::Magnitude => v.iter().map(|x| x * x).sum::<f64>().sqrt(),
    }
}

fn reduce(values: impl Iterator<Item = (f64, f64)>, statistic: Statistic) -> f64 {
    match statistic {
        Statistic::Mean => {
            let (sum, weight) = values.fold((0.0, 0.0), |(s, w), (x, v)| (s + x * v, w + v));
            sum / weight
        }
        Statistic::Max => values.map(|(x, _)| x).fold(f64::NEG_INFINITY, f64::max),
        Statistic::Min => values.map(|(x, _)| x).fold(f64::INFINITY, f64::min),
    }
}

/// A component or invariant of a Cauchy stress, of its symmetric part.
pub fn of_stress(s: &[f64; 9], component: StressComponent) -> f64 {
    let (xy, yz, xz) = (0.5 * (s[1] + s[3]), 0.5 * (s[5] + s[7]), 0.5 * (s[2] + s[6]));
    match component {
        StressComponent::Xx => s[0],
        StressComponent::Yy => s[4],
        StressComponent::Zz => s[8],
        StressComponent::Xy => xy,
        StressComponent::Yz => yz,
        StressComponent::Xz => xz,
        StressComponent::VonMises => {
            let normal = (s[0] - s[4]).powi(2) + (s[4] - s[8]).powi(2) + (s[8] - s[0]).powi(2);
            (0.5 * normal + 3.0 * (xy * xy + yz * yz + xz * xz)).sqrt()
        }
        StressComponent::Pressure => -(s[0] + s[4] + s[8]) / 3.0,
    }
}

/// The volume of an element displaced by u (m^3), the integral of det F; negative where it is inside out.
pub fn current_volume(mesh: &Mesh, e: usize, u: &[[f64; 3]]) -> f64 {
    let element = ElementId(e as u32);
    let (info, nodes) = (mesh.kind(element).info, mesh.element_nodes(element));
    let first = u[nodes[0].index()];
    let mut volume = 0.0;
    for (at, rest) in info.points.iter().zip(mesh.rest(element)) {
        let mut f = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for (node, slopes) in nodes.iter().zip(at.gradients).skip(1) {
            let u = u[node.index()];
            for k in 0..3 {
                let gradient: f64 = (0..info.dimension).map(|a| slopes[a] * rest.inverse_jacobian[3 * a + k]).sum();
                for i in 0..3 {
                    f[i][k] += (u[i] - first[i]) * gradient;
                }
            }
        }
        let [a, b, c] = f;
        let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
        volume += rest.weight * a.iter().zip(cross).map(|(x, y)| x * y).sum::<f64>();
    }
    volume
}

/// The area at rest of the boundary faces whose nodes are all selected.
fn end_area(mesh: &Mesh, nodes: &[u32]) -> f64 {
    let selected: std::collections::HashSet<u32> = nodes.iter().copied().collect();
    let faces = mesh.boundary().into_iter().map(|face| (face, mesh.face_nodes(face)));
    let inside = faces.filter(|(_, nodes)| nodes.iter().all(|n| selected.contains(&n.0)));
    inside.map(|(face, nodes)| integrals(mesh.face_kind(face), &mesh.positions(&nodes)).iter().sum::<f64>()).sum()
}
