//! Bodies that fall on obstacles, taken step by step on any backend.

use tensormass_runtime::backend::{Backend, ForceField};
use tensormass_runtime::body::Body;
use tensormass_runtime::cg::CgLimits;
use tensormass_runtime::cpu::{CpuBackend, CpuField, Precision};
use tensormass_runtime::integrate::{CentralDifference, ImplicitEuler, NewtonLimits, SolverSettings};
use tensormass_runtime::model::{Model, build};
use tensormass_runtime::scene::{Preconditioner, Scene};
use tensormass_runtime::system::{Integrator, State, System};

use super::scene;

/// A cube of 2 cm.
pub const CUBE: &str = "beam = { size = [0.02, 0.02, 0.02], cells = [3, 3, 3], origin = [-0.01, -0.01, 0] }";

/// A body that falls on a shape below it.
pub fn falling_text(body: &str, shape: &str, law: &str, precision: &str, step: f64, duration: f64) -> String {
    format!(
        "[mesh]\n{body}\n[[material]]\n\
         law = \"{law}\"\ndensity = 1000.0\nparameters = {{ young = 3e4, poisson = 0.3 }}\n[[load]]\n\
         kind = \"gravity\"\nacceleration = [0, 0, -9.81]\n[[obstacle]]\nshape = {shape}\nfriction = 0.2\n[solver]\n\
         integrator = \"central-difference\"\nstep = {step:e}\nduration = {duration:e}\nprecision = \"{precision}\"\n[[probe]]\n\
         name = \"lowest\"\nkind = \"displacement\"\nnodes = \"all\"\ncomponent = \"z\"\nstatistic = \"min\"\n[[probe]]\n\
         name = \"energy\"\nkind = \"energy\"\npart = \"total\"\n[output]\nframes = 0\nprobe_every = 100\n"
    )
}

/// As [`falling_text`], read.
pub fn falling(body: &str, shape: &str, law: &str, precision: &str, step: f64, duration: f64) -> Scene {
    scene::<&str>(&falling_text(body, shape, law, precision, step, duration), &[])
}

/// Obstacles whose highest point is 2 mm below the cube.
pub const BELOW: [&str; 5] = [
    "{ plane = { point = [0, 0, -0.002], normal = [0, 0, 1] } }",
    "{ sphere = { centre = [0.001, 0, -0.032], radius = 0.03 } }",
    "{ box = { centre = [0.004, 0.003, -0.01], size = [0.02, 0.03, 0.016] } }",
    "{ capsule = { from = [-0.03, 0.002, -0.012], to = [0.03, -0.001, -0.012], radius = 0.01 } }",
    "{ cylinder = { from = [0.002, 0, -0.022], to = [0.002, 0, -0.002], radius = 0.009 } }",
];

/// Surfaces of triangles: the box of [`BELOW`], and a sphere that is 2 mm below the cube.
pub const MESHES: [&str; 2] = [
    "{ mesh = { file = \"tests/data/box.stl\", scale = 0.001, translation = [0.004, 0.003, -0.01] } }",
    "{ mesh = { file = \"tests/data/ball.obj\", scale = 0.03, rotation = [0.3, 0, 0.2], translation = [0.001, 0, -0.032] } }",
];

/// A dish whose hollow is turned against the cube that falls into it, and meets its brim.
pub const DISH: &str = "{ mesh = { file = \"tests/data/dish.obj\", scale = 0.0006, rotation = [0.3, 0.2, 0.7], translation = [0.004, 0, -0.008] } }";

/// A model on a backend, with its time step.
pub struct Bench<B: Backend, F: ForceField<B>> {
    pub system: System<B, F>,
    pub state: State<B>,
    integrator: Box<dyn Integrator<B, F>>,
    h: f64,
    pub steps: u64,
    /// Of the scene, scaled.
    pub size: f64,
}

/// One on the CPU.
pub type OnCpu<R> = Bench<CpuBackend<R>, CpuField<R>>;

/// See [`Bench::new`].
pub fn on_cpu<R: Precision>(scene: &Scene) -> OnCpu<R> {
    Bench::new(scene, cpu)
}

fn cpu<R: Precision>(body: &Body) -> (CpuBackend<R>, CpuField<R>) {
    let backend = CpuBackend::new(body);
    let field = CpuField::new(&backend, body);
    (backend, field)
}

/// One on the CPU whose surfaces of triangles are grids, as a device has them.
#[cfg(feature = "gpu")]
pub fn tabulated<R: Precision>(scene: &Scene) -> OnCpu<R> {
    let mut model = build(scene).unwrap_or_else(|e| panic!("{e}"));
    model.body.contact = model.body.contact.map(|contact| std::sync::Arc::new(contact.baked()));
    Bench::of(model, scene, cpu)
}

/// One on the CPU that takes implicit steps, whatever the scene says.
pub fn implicit(scene: &Scene) -> OnCpu<f64> {
    let mut bench = on_cpu(scene);
    let settings = SolverSettings {
        cg: CgLimits { tolerance: 1e-10, max_iterations: 2000 },
        preconditioner: Preconditioner::Jacobi,
        newton: NewtonLimits { tolerance: 1e-8, max_iterations: 30 },
    };
    bench.integrator = Box::new(ImplicitEuler::new(&bench.system.backend, settings));
    bench
}

impl<B: Backend + 'static, F: ForceField<B> + 'static> Bench<B, F> {
    /// A scene with an obstacle at its beginning.
    pub fn new(scene: &Scene, on: impl FnOnce(&Body) -> (B, F)) -> Self {
        Self::of(build(scene).unwrap_or_else(|e| panic!("{e}")), scene, on)
    }

    /// As [`Bench::new`], of the scene's model.
    pub fn of(model: Model, scene: &Scene, on: impl FnOnce(&Body) -> (B, F)) -> Self {
        let Model { body, scale, start, .. } = model;
        let (backend, field) = on(&body);
        let size = body.contact.as_ref().expect("an obstacle").size;
        let system = System::new(backend, field, body);
        let state = system.start(&start);
        let integrator = Box::new(CentralDifference::new(&system.backend));
        let h = scene.solver.step.expect("a step") / scale.time;
        Self { system, state, integrator, h, steps: scene.solver.steps(), size }
    }

    /// The distance between surface and obstacle, negative where they overlap.
    pub fn gap(&self) -> f64 {
        self.system.gap(&self.state.u, self.state.time, self.size)
    }

    /// A step with its contact.
    pub fn step_whole(&mut self) {
        self.integrator.step(&mut self.system, &mut self.state, self.h).unwrap_or_else(|e| panic!("{e}"));
        self.state.step += 1;
        self.state.time = self.h * self.state.step as f64;
    }

    /// An explicit step; kinetic energy before and after contact.
    pub fn step(&mut self) -> [f64; 2] {
        self.system.touch.as_mut().expect("an obstacle").is_looked_for = false;
        self.integrator.step(&mut self.system, &mut self.state, self.h).unwrap_or_else(|e| panic!("{e}"));
        let before = self.system.kinetic_energy(self.state.velocity());
        self.system.touch.as_mut().expect("an obstacle").is_looked_for = true;
        self.system.meet_obstacles(&mut self.state, self.h);
        self.state.step += 1;
        self.state.time = self.h * self.state.step as f64;
        [before, self.system.kinetic_energy(self.state.velocity())]
    }
}
