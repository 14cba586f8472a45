//! A law's WGSL, run on an adapter at many states at once: one tetrahedron a state.

use tensormass_runtime::device::DeviceChoice;

use crate::subject::Subject;

pub use tensormass_runtime::device::DeviceError;

/// A state in f32, and the material there.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// The material's constants.
    pub constants: Vec<f32>,
    /// G.
    pub gradient: [f32; 9],
    /// The direction of the differential.
    pub direction: [f32; 9],
}

/// What the device computes at a state.
#[derive(Debug, Clone, PartialEq)]
pub struct Values {
    /// W as the kernel gives it, not yet counted from rest; NaN where the kernel finds the state outside the domain.
    pub energy: f64,
    /// P.
    pub stress: [f64; 9],
    /// dP in the state's direction.
    pub differential: [f64; 9],
}

/// An adapter, open.
pub struct Device(#[cfg(feature = "gpu")] gpu::Open, #[cfg(not(feature = "gpu"))] std::convert::Infallible);

impl std::fmt::Debug for Device {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Device").field(&self.name()).finish()
    }
}

#[cfg(feature = "gpu")]
impl Device {
    /// Opens the device that is chosen; none if the choice comes to the CPU.
    ///
    /// # Errors
    /// There is no such device.
    pub fn open(choice: &DeviceChoice) -> Result<Option<Self>, DeviceError> {
        Ok(tensormass_runtime::gpu::open(choice)?.map(|gpu| Self(std::sync::Arc::new(gpu))))
    }

    /// Its name, as the driver gives it.
    pub fn name(&self) -> &str {
        &self.0.info().name
    }

    /// The values at each state.
    ///
    /// # Errors
    /// The device fails.
    pub fn values(&self, subject: &Subject, points: &[Point]) -> Result<Vec<Values>, DeviceError> {
        gpu::values(&self.0, subject, points)
    }
}

#[cfg(not(feature = "gpu"))]
impl Device {
    /// Opens the device that is chosen; none if the choice comes to the CPU.
    ///
    /// # Errors
    /// A device is chosen: this build has no support for one.
    pub fn open(choice: &DeviceChoice) -> Result<Option<Self>, DeviceError> {
        match choice {
            DeviceChoice::Cpu | DeviceChoice::Auto => Ok(None),
            DeviceChoice::Gpu | DeviceChoice::Named(_) => Err(DeviceError::NoGpuSupport),
        }
    }

    /// Its name, as the driver gives it.
    pub fn name(&self) -> &str {
        match self.0 {}
    }

    /// The values at each state.
    ///
    /// # Errors
    /// The device fails.
    pub fn values(&self, _: &Subject, _: &[Point]) -> Result<Vec<Values>, DeviceError> {
        match self.0 {}
    }
}

/// The reference tetrahedron with volume 1: its gradients are the unit vectors, so that displacements u_0 = 0, u_j =
/// column j of G realise G exactly, and P is minus the forces, exactly.
#[cfg(feature = "gpu")]
mod gpu {
    use std::sync::Arc;

    use tensormass_codegen::ir::Input;
    use tensormass_codegen::print::wgsl;
    use tensormass_kernels::RestPoint;
    use tensormass_kernels::shader::{Argument, LawFunctions, PointFunction};
    use tensormass_kernels::{LawEntry, law, laws};
    use tensormass_runtime::backend::{Backend, ForceField};
    use tensormass_runtime::body::{Body, LawBatch};
    use tensormass_runtime::device::DeviceError;
    use tensormass_runtime::gpu::{Gpu, GpuBackend, GpuField, GpuOptions};

    use super::{Point, Values};
    use crate::subject::{Origin, Subject};

    pub type Open = Arc<Gpu>;

    pub fn values(gpu: &Open, subject: &Subject, points: &[Point]) -> Result<Vec<Values>, DeviceError> {
        let body = body(entry(subject), points);
        let backend = GpuBackend::new(Arc::clone(gpu), &body, GpuOptions::default())?;
        let mut field = GpuField::new(&backend, &body)?;
        let mut displacement = nodal(points, |p| &p.gradient);
        let u = backend.upload(&displacement);
        let mut force = backend.zeros();
        // Whether a state is outside is said of energies below; forces are there all the same.
        let _ = field.add_force(&backend, &u, &mut force);
        let mut differential = backend.zeros();
        field.prepare(&backend, &u);
        field.add_dforce(&backend, &backend.upload(&nodal(points, |p| &p.direction)), 1.0, &mut differential);
        let [force, differential] = [force, differential].map(|v| backend.download(&v));
        let mut outside = vec![];
        let energies = loop {
            match field.element_energies(&backend, &backend.upload(&displacement)) {
                Ok(energies) => break energies,
                // One state hides all others' energies: it is put to rest.
                Err(left) => {
                    displacement[4 * left.element as usize..][..4].fill([0.0; 3]);
                    outside.push(left.element as usize);
                }
            }
            if outside.len() > points.len() {
                break vec![f64::NAN; points.len()];
            }
        };
        backend.check()?;
        let one = |(e, energy): (usize, f64)| {
            let stress = |f: &[[f64; 3]]| std::array::from_fn(|k| -f[4 * e + 1 + k % 3][k / 3]);
            let energy = if outside.contains(&e) { f64::NAN } else { energy };
            Values { energy, stress: stress(&force), differential: stress(&differential) }
        };
        Ok(energies.into_iter().enumerate().map(one).collect())
    }

    /// u_j = column j of a matrix, at nodes 1 to 3 of each element.
    fn nodal(points: &[Point], matrix: impl Fn(&Point) -> &[f32; 9]) -> Vec<[f64; 3]> {
        let nodes = |p: &Point| -> [[f64; 3]; 4] {
            let g = matrix(p).map(f64::from);
            std::array::from_fn(|n| std::array::from_fn(|i| if n == 0 { 0.0 } else { g[3 * i + n - 1] }))
        };
        points.iter().flat_map(nodes).collect()
    }

    /// Elements that share no node, with a material each.
    fn body(law: &'static LawEntry, points: &[Point]) -> Body {
        let count = points.len();
        let unit = |k: usize| if k.is_multiple_of(4) { 1.0 } else { 0.0 };
        let batch = LawBatch {
            law,
            element: tensormass_kernels::linear_tetrahedron(),
            elements: (0..count as u32).collect(),
            constants: points.iter().flat_map(|p| p.constants.iter().copied().map(f64::from)).collect(),
            per_element: true,
        };
        Body {
            elements: (0..count as u32).map(|e| [0, 1, 2, 3].map(|k| 4 * e + k)).collect(),
            rest: (0..count)
                .map(|_| [RestPoint { inverse_jacobian: std::array::from_fn(unit), weight: 1.0 }])
                .collect(),
            batches: vec![batch],
            masses: vec![1.0; 4 * count],
            mass_matrix: None,
            element_masses: vec![1.0; count],
            constraints: vec![],
            motions: vec![],
            loads: vec![],
            pressures: vec![],
            contact: None,
            moves: true,
            mass_damping: 0.0,
            stiffness_damping: 0.0,
            diameter: 1.0,
            volume: count as f64,
        }
    }

    /// The law as a runtime meets it. What this build does not have is printed, and kept until the process ends: entries
    /// live that long.
    fn entry(subject: &Subject) -> &'static LawEntry {
        if let (Origin::Build, Some(entry)) = (&subject.origin, law(subject.name())) {
            return entry;
        }
        let printed = wgsl::LawFunctions::new(&subject.law, &subject.derivation);
        let [energy, force, dforce, diagonal, cauchy] = printed.elastic.each_ref().map(function);
        let functions = LawFunctions { banner: leaked(&printed.banner), energy, force, dforce, diagonal, cauchy };
        // Element passes need no more of an entry than these; the CPU's kernels are another law's, and never called.
        let like = laws()[0];
        let mut info = like.info.clone();
        info.name = leaked(subject.name());
        info.domain = subject.law.domain.as_ref().map(|d| leaked(&d.text));
        info.constants = Box::leak(vec![""; subject.derivation.constants.len()].into_boxed_slice());
        let (info, functions) = (Box::leak(Box::new(info)), Box::leak(Box::new(functions)));
        let mut entry = like;
        (entry.info, entry.functions, entry.damping) = (info, functions, None);
        Box::leak(Box::new(entry))
    }

    fn leaked(text: &str) -> &'static str {
        Box::leak(text.to_string().into_boxed_str())
    }

    fn function(printed: &wgsl::PointFunction) -> PointFunction {
        let arguments: Vec<Argument> = printed.arguments.iter().map(argument).collect();
        PointFunction {
            name: leaked(&printed.name),
            text: leaked(&printed.text),
            arguments: Box::leak(arguments.into_boxed_slice()),
            field: printed.field,
        }
    }

    fn argument(role: &Input) -> Argument {
        match role {
            Input::Constants => Argument::Constants,
            Input::DisplacementGradient => Argument::DisplacementGradient,
            Input::GradientRate => Argument::GradientRate,
            Input::GradientIncrement => Argument::GradientIncrement,
            Input::NodeGradient => Argument::NodeGradient,
            other => unreachable!("no kernel of a law reads {other:?} at a point"),
        }
    }
}
