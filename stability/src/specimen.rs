//! A small body, what drives it and how it is solved, written as a scene in any units: those of one are twins of each other.

use std::fmt::Write as _;
use std::path::Path;

use tensormass_lawbench::material::Material;
use tensormass_runtime::scene::{Integrator, Precision, Scene, SceneError, parse};
use tensormass_runtime::{LawEntry, ParameterInfo};

use crate::sliver;

/// Units of a scene: lengths, stresses and densities are multiples of these; the unit of time follows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    /// In m.
    pub length: f64,
    /// In Pa: Young's modulus at rest.
    pub stress: f64,
    /// In kg/m3.
    pub density: f64,
}

impl Units {
    /// Those of most specimens.
    pub const USUAL: Self = Self { length: 1.0, stress: 1e6, density: 1e3 };

    /// In s: what a wave along a bar takes for a unit of length.
    pub fn time(&self) -> f64 {
        self.length * (self.density / self.stress).sqrt()
    }

    /// The units of a twin: factors that are no powers of two, so that nothing rounds as before; within what laws allow.
    pub fn of_twin(&self) -> Self {
        let stress = if self.stress < 1e6 { 1.3 * self.stress } else { 0.7 * self.stress };
        Self { length: 1.7 * self.length, stress, density: 0.7 * self.density }
    }
}

/// What moves a specimen. Lengths in units of length, times in units of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// A beam held at one end sags under its weight, which is given as a part of Young's modulus over its length.
    Weight(f64),
    /// A block between planes is stretched along x, its sides free: the same everywhere.
    Stretch(f64),
    /// A free block that begins with a gradient of displacement, row by row.
    Start([[f64; 3]; 3]),
    /// A free block that spins, rad for each unit of time.
    Spin(f64),
    /// Both.
    Begun([[f64; 3]; 3], f64),
}

/// What it is made of, beside a uniform body of cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fabric {
    /// One material.
    Uniform,
    /// The half with greater x is so many times as stiff and as dense.
    Halves(f64, f64),
    /// One material, and one element squeezed to this part of its height.
    Sliver(f64),
}

/// How exactly systems are solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerances {
    /// Of conjugate gradients.
    pub linear: f64,
    /// Of Newton's method.
    pub nonlinear: f64,
}

impl Tolerances {
    /// As a user might set them in a precision.
    pub fn usual(precision: Precision) -> Self {
        match precision {
            Precision::F32 => Self { linear: 1e-6, nonlinear: 1e-6 },
            Precision::F64 => Self { linear: 1e-8, nonlinear: 1e-9 },
        }
    }

    /// For references.
    pub const TIGHT: Self = Self { linear: 1e-11, nonlinear: 1e-11 };
}

/// A body, what drives it and how.
#[derive(Debug, Clone)]
pub struct Specimen<'a> {
    /// Its law.
    pub law: &'a LawEntry,
    /// Its material, in any unit of stress.
    pub material: &'a Material,
    /// Its units.
    pub units: Units,
    /// What it is made of.
    pub fabric: Fabric,
    /// What moves it.
    pub drive: Drive,
    /// The integrator.
    pub integrator: Integrator,
    /// Whether implicit steps are linearised: one iteration of Newton's method.
    pub linearised: bool,
    /// The step, in units of time.
    pub step: f64,
    /// The number of steps.
    pub steps: u64,
}

/// A viscosity, as a part of Young's modulus times the unit of time.
const VISCOSITY: f64 = 0.02;

impl Specimen<'_> {
    /// Edge lengths and numbers of cells.
    pub fn beam(&self) -> ([f64; 3], [u32; 3]) {
        match self.drive {
            Drive::Weight(_) => ([4.0, 1.0, 1.0], [4, 2, 2]),
            Drive::Stretch(_) => ([1.0; 3], [2; 3]),
            Drive::Start(_) | Drive::Spin(_) => ([2.0, 1.0, 1.0], [4, 2, 2]),
            Drive::Begun(..) => ([2.0, 1.0, 1.0], [2, 1, 1]),
        }
    }

    /// The components of all parameters with another stiffness.
    fn parameters(&self, units: Units, stiffer: f64) -> Vec<Vec<f64>> {
        let young = self.material.moduli.young();
        let mut values = self.material.parameters.iter();
        let of = |info: &ParameterInfo, value: f64| {
            let [length, stress, time] = info.dimensions;
            let unit = units.length.powi(length) * units.time().powi(time);
            let value = match time {
                0 => value * unit * (stiffer * units.stress / young).powi(stress),
                _ => VISCOSITY * unit * (stiffer * units.stress).powi(stress),
            };
            // What is meant to be at an end of its range is not beyond by a rounding.
            let (low, high) = info.range;
            let within = value.clamp(low, high);
            if (within / value - 1.0).abs() < 1e-12 { within } else { value }
        };
        let info = self.law.info;
        info.parameters.iter().map(|p| values.by_ref().take(p.len).map(|x| of(p, *x)).collect()).collect()
    }

    /// The scene's text; a mesh that has to be made is written into the folder.
    fn text(&self, units: Units, precision: Precision, tolerances: Tolerances, folder: &Path) -> String {
        let (l, t) = (units.length, units.time());
        let (size, cells) = self.beam();
        let mesh = match self.fabric {
            Fabric::Sliver(height) => {
                let file = format!("sliver-{height:e}-{l:e}.msh");
                // What cannot be written cannot be read: the scene says so.
                let _ = sliver::write(&folder.join(&file), size, cells, height, l);
                format!("file = {file:?}")
            }
            _ => format!("beam = {{ size = {:?}, cells = {cells:?} }}", size.map(|x| x * l)),
        };
        let mut text = format!("[mesh]\n{mesh}\n");
        let halves = match self.fabric {
            Fabric::Halves(stiffer, denser) => {
                let middle = 0.5 * size[0] * l;
                vec![(format!("x < {middle:?}"), 1.0, 1.0), (format!("x > {middle:?}"), stiffer, denser)]
            }
            _ => vec![("all".to_string(), 1.0, 1.0)],
        };
        for (elements, stiffer, denser) in halves {
            let names = self.law.info.parameters.iter().zip(self.parameters(units, stiffer));
            let parameters: Vec<String> = names
                .map(
                    |(p, v)| {
                        if p.len == 1 { format!("{} = {:?}", p.name, v[0]) } else { format!("{} = {v:?}", p.name) }
                    },
                )
                .collect();
            let _ = write!(
                text,
                "[[material]]\nlaw = {:?}\ndensity = {:?}\nelements = {elements:?}\nparameters = {{ {} }}\n",
                self.law.info.name,
                denser * units.density,
                parameters.join(", ")
            );
        }
        let duration = self.step * self.steps as f64 * t;
        text += &self.boundary(l, duration);
        if let Drive::Weight(part) = self.drive {
            let g = part * units.stress / (units.density * l);
            let _ = writeln!(text, "[[load]]\nkind = \"gravity\"\nacceleration = [0.0, 0.0, {:?}]", -g);
            if self.integrator == Integrator::Static {
                let _ = writeln!(text, "ramp = [[0.0, 0.0], [{duration:?}, 1.0]]");
            }
        }
        let (gradient, speed) = match self.drive {
            Drive::Start(gradient) => (Some(gradient), None),
            Drive::Spin(speed) => (None, Some(speed)),
            Drive::Begun(gradient, speed) => (Some(gradient), Some(speed)),
            Drive::Weight(_) | Drive::Stretch(_) => (None, None),
        };
        if gradient.is_some() || speed.is_some() {
            text += "[initial]\n";
        }
        if let Some(gradient) = gradient {
            let _ = writeln!(text, "gradient = {gradient:?}");
        }
        if let Some(speed) = speed {
            let _ = writeln!(text, "angular_velocity = [0.0, 0.0, {:?}]", speed / t);
        }
        let name = |value: &dyn std::fmt::Debug| format!("{value:?}").to_lowercase();
        let integrator = match self.integrator {
            Integrator::ImplicitEuler => "implicit-euler",
            Integrator::SemiImplicitEuler => "semi-implicit-euler",
            Integrator::CentralDifference => "central-difference",
            Integrator::Static => "static",
        };
        let _ = write!(
            text,
            "[solver]\nintegrator = {integrator:?}\nprecision = {:?}\nstep = {:?}\nduration = {duration:?}\nthreads = 1\n",
            name(&precision),
            self.step * t,
        );
        if !self.integrator.is_explicit() {
            let Tolerances { linear, nonlinear } = tolerances;
            let iterations = if self.linearised { 1 } else { 60 };
            let _ = write!(
                text,
                "cg = {{ tolerance = {linear:?}, max_iterations = 20000 }}\nnewton = {{ tolerance = {nonlinear:?}, \
                 max_iterations = {iterations} }}\n"
            );
        }
        if matches!(self.drive, Drive::Stretch(_)) {
            text +=
                "[[probe]]\nname = \"reaction\"\nkind = \"reaction\"\nnodes = \"near(x, xmax)\"\ncomponent = \"x\"\n";
        }
        text + "[output]\nframes = 0\n"
    }

    fn boundary(&self, l: f64, duration: f64) -> String {
        let fix = |nodes: &str, components: &str| format!("[[boundary]]\nnodes = {nodes:?}\nfix = {components}\n");
        let pulled = |stretch: f64| {
            let ramp = format!("[[0.0, 0.0], [{duration:?}, {:?}]]", (stretch - 1.0) * self.beam().0[0] * l);
            format!("[[boundary]]\nnodes = \"near(x, xmax)\"\nmove = {{ x = {{ ramp = {ramp} }} }}\n")
        };
        match self.drive {
            Drive::Weight(_) => fix("near(x, xmin)", "[\"x\", \"y\", \"z\"]"),
            Drive::Stretch(stretch) => {
                let planes = ["x", "y", "z"].map(|c| fix(&format!("near({c}, {c}min)"), &format!("[{c:?}]")));
                format!("{}{}", planes.concat(), pulled(stretch))
            }
            Drive::Start(_) | Drive::Spin(_) | Drive::Begun(..) => String::new(),
        }
    }

    /// The scene in some units.
    ///
    /// # Errors
    /// The program refuses it.
    pub fn scene(
        &self,
        units: Units,
        precision: Precision,
        tolerances: Tolerances,
        folder: &Path,
    ) -> Result<Scene, SceneError> {
        parse(&self.text(units, precision, tolerances, folder), folder.join("specimen.toml"), &[])
    }
}
