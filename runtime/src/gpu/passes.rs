//! The passes over elements and nodes that a device has compiled for a body: when first needed, and until they are let go.

use std::collections::HashMap;
use std::rc::Rc;

use tensormass_kernels::shader::{Binding, Pass, Shader, Unit, element_pass, node_product, node_sum};
use tensormass_kernels::{ElementEntry, LawEntry};

use super::GpuOptions;
use super::recorder::{Kernel, Recorder};
use super::shaders::Access;

/// A pass that the device has compiled.
pub(super) struct Compiled {
    pub kernel: Rc<Kernel>,
    pub bindings: Vec<Binding>,
}

/// See the module.
pub(super) struct Passes {
    recorder: Rc<Recorder>,
    /// By law, kind, the stride of constants and what an invocation computes: a scene has those of its pairs.
    of_elements: HashMap<(&'static str, &'static str, u32, Pass, Unit), Rc<Compiled>>,
    /// By whether they make a product.
    of_nodes: HashMap<bool, Rc<Compiled>>,
    work_group_size: u32,
    elements_per_invocation: u32,
}

impl Passes {
    /// None yet.
    pub fn new(recorder: &Rc<Recorder>, options: &GpuOptions) -> Self {
        Self {
            recorder: Rc::clone(recorder),
            of_elements: HashMap::new(),
            of_nodes: HashMap::new(),
            work_group_size: options.work_group_size,
            elements_per_invocation: options.elements_per_invocation,
        }
    }

    /// How many over elements there are.
    pub fn of_elements(&self) -> usize {
        self.of_elements.len()
    }

    /// The pass of a law on a kind of element.
    pub fn element(
        &mut self,
        (law, element, unit): (&LawEntry, &ElementEntry, Unit),
        stride: u32,
        pass: Pass,
    ) -> Rc<Compiled> {
        let key = (law.info.name, element.info.name, stride, pass, unit);
        if let Some(made) = self.of_elements.get(&key) {
            return Rc::clone(made);
        }
        let shader = element_pass(law, element, pass, unit).expect("damping runs over laws with a dissipation");
        let label = format!("{}: {}, {}, {unit:?}", name(pass), law.info.name, element.info.name);
        let made = Rc::new(self.compiled(shader, stride, &label));
        self.of_elements.insert(key, Rc::clone(&made));
        made
    }

    /// The pass over nodes that makes a product, or that which adds sums.
    pub fn node(&mut self, product: bool) -> Rc<Compiled> {
        if let Some(made) = self.of_nodes.get(&product) {
            return Rc::clone(made);
        }
        let (shader, label) = if product { (node_product(), "product at nodes") } else { (node_sum(), "sum of slots") };
        let made = Rc::new(self.compiled(shader, 0, label));
        self.of_nodes.insert(product, Rc::clone(&made));
        made
    }

    /// Lets go of those of products with the tangent and of its diagonal.
    pub fn forget_tangent(&mut self) {
        let of_tangent = [Pass::DForce, Pass::DDamping, Pass::Diagonal, Pass::DampingDiagonal];
        self.of_elements.retain(|(_, _, _, pass, _), _| !of_tangent.contains(pass));
        self.of_nodes.remove(&true);
    }

    fn compiled(&self, shader: Shader, stride: u32, label: &str) -> Compiled {
        let access = |b: &Binding| match (b.is_uniform(), b.is_written()) {
            (true, _) => Access::Uniform,
            (false, true) => Access::Write,
            (false, false) => Access::Read,
        };
        let accesses: Vec<Access> = shader.bindings.iter().map(access).collect();
        let mut constants = vec![("work_group_size", f64::from(self.work_group_size))];
        if shader.bindings.contains(&Binding::ElementPass) {
            constants.push(("elements_per_invocation", f64::from(self.elements_per_invocation)));
        }
        if shader.bindings.contains(&Binding::Constants) {
            constants.push(("constants_stride", f64::from(stride)));
        }
        let kernel = self.recorder.kernel(label, &shader.text, &accesses, &constants);
        Compiled { kernel, bindings: shader.bindings }
    }
}

/// The name of a pass, as its kernel's on a CPU.
fn name(pass: Pass) -> &'static str {
    match pass {
        Pass::Energy => "energy",
        Pass::Force => "force",
        Pass::DForce => "dforce",
        Pass::Diagonal => "diagonal",
        Pass::Cauchy => "cauchy",
        Pass::Damping => "damping",
        Pass::DDamping => "ddamping",
        Pass::DampingDiagonal => "damping_diagonal",
    }
}
