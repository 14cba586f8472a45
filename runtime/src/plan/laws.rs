//! The kernels of a plan's laws, each with its operations an element.

use tensormass_kernels::{ElementInfo, LawEntry, LawInfo, pairs};

use crate::body::LawBatch;
use crate::tangent::Tangent;

/// One law of a plan.
#[derive(Debug, Clone)]
pub struct PlannedLaw {
    /// The law.
    pub info: &'static LawInfo,
    /// The kind of element.
    pub element: &'static ElementInfo,
    /// Elements.
    pub elements: usize,
    /// Constants stored: for each element, or once.
    pub per_element: bool,
    /// How products with the tangent are computed; none where there are none.
    pub tangent: Option<Tangent>,
    /// The kernels that will run, each with its operations an element.
    pub kernels: Vec<(&'static str, u32)>,
}

impl PlannedLaw {
    /// A law of a body whose products with the tangent are computed in this way, if there are any.
    pub(super) fn new(batch: &LawBatch, tangent: Option<Tangent>, damping: Damping) -> Self {
        let (info, element) = (batch.law.info, batch.element.info);
        let point = |name: &str| point_operations(info, name);
        let gathers = if info.structure.linear { 1 } else { 2 };
        let mut kernels = vec![("force", operations(element, 1, point("force") + element.contract_operations))];
        // What does not depend on the increment is computed once, and stored if it is anything.
        if tangent == Some(Tangent::Stored) {
            if info.stored > 0 {
                kernels.push(("linearize", operations(element, 1, point("linearize"))));
            }
            kernels.push(("apply", operations(element, 1, tangent_operations(info) + element.contract_operations)));
        }
        if tangent == Some(Tangent::Assembled) {
            kernels.push(("assemble", operations(element, 1, assembly_operations(info, element))));
        }
        if tangent == Some(Tangent::Recomputed) || damping.is_proportional {
            kernels.push(("dforce", operations(element, gathers, point("dforce") + element.contract_operations)));
        }
        if tangent.is_some() {
            kernels.push(("diagonal", operations(element, 1, element.nodes as u32 * point("diagonal"))));
        }
        let of_damping = damping_kernels(batch.law, element);
        let runs = |name: &str| damping.is_viscous && (tangent.is_some() || name == "damping");
        kernels.extend(of_damping.filter(|(name, _)| runs(name)));
        Self { info, element, elements: batch.elements.len(), per_element: batch.per_element, tangent, kernels }
    }

    /// Operations of a kernel an element; 0 where it does not run.
    pub fn operations(&self, kernel: &str) -> u32 {
        self.kernels.iter().find(|(name, _)| *name == kernel).map_or(0, |(_, operations)| *operations)
    }
}

/// What damps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Damping {
    /// Dissipations of laws.
    pub is_viscous: bool,
    /// Rayleigh's part that is proportional to the stiffness.
    pub is_proportional: bool,
}

/// Operations of an element: those of its points, each with some gradients, its law, and what follows.
pub(crate) fn operations(element: &ElementInfo, gradients: u32, then: u32) -> u32 {
    element.points.len() as u32 * (gradients * element.gradient_operations + then)
}

/// Operations of a law's kernel at a point; 0 where it has none of this name.
pub(crate) fn point_operations(law: &LawInfo, kernel: &str) -> u32 {
    law.operations.iter().find(|o| o.kernel == kernel).map_or(0, |o| o.arithmetic())
}

/// Operations of dP at a point from what is stored of the state: G, if there is no kernel of its own.
pub(crate) fn tangent_operations(law: &LawInfo) -> u32 {
    let own = law.operations.iter().find(|o| o.kernel == "apply");
    own.map_or_else(|| point_operations(law, "dforce"), |o| o.arithmetic())
}

/// Operations of the blocks of the tangent between an element's nodes at a point: dP for each unit gradient, from what
/// [`tangent_operations`] begins with; its products with the gradient of each node, and theirs with that of each other.
fn assembly_operations(law: &LawInfo, element: &ElementInfo) -> u32 {
    let (nodes, pairs) = (element.nodes as u32, pairs(element.nodes).count() as u32);
    point_operations(law, "linearize") + 9 * tangent_operations(law) + (nodes - 1) * (3 + 27 * 5) + pairs * 27 * 2
}

/// The kernels of a law's damping, each with its operations an element.
fn damping_kernels(law: &LawEntry, element: &'static ElementInfo) -> impl Iterator<Item = (&'static str, u32)> {
    let (info, linear) = (law.info, law.damping.map(|damping| damping.linear));
    let point = |name: &str| point_operations(info, name);
    let gathers = if linear == Some(true) { 2 } else { 3 };
    let (contract, nodes) = (element.contract_operations, element.nodes as u32);
    let kernels = [
        ("damping", operations(element, 2, point("damping") + contract)),
        ("ddamping", operations(element, gathers, point("ddamping") + contract)),
        ("damping_diagonal", operations(element, gathers - 1, nodes * point("damping_diagonal"))),
    ];
    kernels.into_iter().filter(move |_| linear.is_some())
}
