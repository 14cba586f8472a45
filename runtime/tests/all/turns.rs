//! Nodes that are turned about an axis: rigid turns, and the torsion of a bar against Saint-Venant's.

use crate::support::{done, probe, scene};

/// A bar whose two ends are turned, statics.
fn turned(element: &str, cells: [u32; 3], law: &str, left: &str, right: &str) -> String {
    format!(
        "[mesh]\nbeam = {{ size = [6, 1, 1], cells = {cells:?}, element = \"{element}\" }}\n[[material]]\nlaw = \"{law}\"\n\
         density = 1000.0\nparameters = {{ young = 1e6, poisson = 0.3 }}\n[[boundary]]\nnodes = \"near(x, xmin)\"\n{left}\n\
         [[boundary]]\nnodes = \"near(x, xmax)\"\n{right}\n[solver]\nintegrator = \"static\"\nstep = 0.25\nduration = 2.0\n\
         cg = {{ tolerance = 1e-10, max_iterations = 20000 }}\n[[probe]]\nname = \"elastic\"\nkind = \"energy\"\n\
         part = \"elastic\"\n[[probe]]\nname = \"volume\"\nkind = \"volume\"\n[[probe]]\nname = \"x\"\nkind = \"displacement\"\n\
         nodes = \"near(x, xmax) && near(y, ymax) && near(z, zmax)\"\ncomponent = \"x\"\n[output]\nframes = 0\n"
    )
}

/// Both ends turned by 1 rad about one skew axis: the body turns as a whole, whatever its elements, and stores nothing that
/// shows beside a strain of 1e-6; a corner is where Rodrigues' formula puts it.
#[test]
fn turned_as_a_whole() {
    let rotate = "rotate = { centre = [1, -2, 0.5], axis = [1, 2, -2], angle = { ramp = [[0, 0], [2, 1]] } }";
    for (element, law) in [("tetrahedron_p1", "st_venant_kirchhoff"), ("hexahedron_s2", "neo_hookean")] {
        let run = done(&scene::<&str>(&turned(element, [3, 1, 1], law, rotate, rotate), &[]));
        let [elastic, volume, x] = ["elastic", "volume", "x"].map(|name| probe(&run, name));
        assert!(elastic.abs() < 6.0 * 1e6 * 1e-12, "{element}: {elastic:e} J");
        assert!((volume / 6.0 - 1.0).abs() < 1e-6, "{element}: {volume} m3");
        // k = (1, 2, -2) / 3, arm = (6, 1, 1) - (1, -2, .5).
        let (k, arm) = ([1.0 / 3.0, 2.0 / 3.0, -2.0 / 3.0], [5.0, 3.0, 0.5]);
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let once = cross(k, arm);
        let wanted = 1.0_f64.sin() * once[0] + (1.0 - 1.0_f64.cos()) * cross(k, once)[0];
        assert!((x - wanted).abs() < 1e-12, "{element}: {x} m along x, {wanted} wanted");
    }
}

/// A small turn of one end: stored is G J a^2 / (2 l) with J = .140577 for a square of 1 m (Timoshenko and Goodier 1970,
/// section 109). Ends that cannot warp stiffen the bar, by less than if a half of a side's length at each did not twist.
#[test]
fn torsion_is_saint_venants() {
    let (angle, length) = (1e-3, 6.0);
    let right =
        format!("rotate = {{ centre = [6, 0.5, 0.5], axis = [1, 0, 0], angle = {{ ramp = [[0, 0], [2, {angle}]] }} }}");
    let left = "fix = [\"x\", \"y\", \"z\"]";
    let run = done(&scene::<&str>(&turned("hexahedron_s2", [12, 4, 4], "hooke", left, &right), &[]));
    let stiffness = 1e6 / 2.6 * 0.140_577;
    let wanted = stiffness * angle * angle / (2.0 * length);
    let elastic = probe(&run, "elastic");
    eprintln!("{elastic:e} J, {wanted:e} J if the ends could warp");
    assert!(elastic >= wanted && elastic <= wanted * length / (length - 1.0), "{elastic:e} J, {wanted:e} J wanted");
}

/// A body that begins turned and spinning: its gradient is a rotation, which stores nothing; its kinetic energy is that of a
/// rigid body about its centre of mass, plus that of its travel; and without forces it keeps both momenta.
#[test]
fn begins_turned_and_spinning() {
    // A quarter turn about z, about the corner at the origin; 3 rad/s about x.
    let text = "[mesh]\nbeam = { size = [2, 1, 1], cells = [2, 1, 1] }\n[[material]]\nlaw = \"neo_hookean\"\n\
        density = 1000.0\nparameters = { young = 1e7, poisson = 0.3 }\n[initial]\nvelocity = [0, 0, 2]\n\
        angular_velocity = [3, 0, 0]\ngradient = [[-1, -1, 0], [1, -1, 0], [0, 0, 0]]\nabout = [0, 0, 0]\n[solver]\n\
        integrator = \"central-difference\"\nstep = 1e-4\nduration = 0.1\n[output]\nframes = 0\n";
    let scene = scene::<&str>(text, &[]);
    let model = tensormass_runtime::model::build(&scene).unwrap_or_else(|e| panic!("{e}"));
    let start = &model.start;
    let (u, v) = (start.displacement.as_ref().expect("turned"), start.velocities.as_ref().expect("spinning"));
    let (length, time) = (model.scale.length, model.scale.time);
    let masses = &model.body.masses;
    let whole: f64 = masses.iter().sum();
    let moved: Vec<[f64; 3]> = model.mesh.nodes().iter().map(|[x, y, z]| [-y, *x, *z]).collect();
    let centre: [f64; 3] =
        std::array::from_fn(|i| moved.iter().zip(masses).map(|(x, m)| x[i] * m).sum::<f64>() / whole);
    let mut kinetic = 0.0;
    for (((rest, moved), (u, v)), mass) in model.mesh.nodes().iter().zip(&moved).zip(u.iter().zip(v)).zip(masses) {
        let wanted = [0.0, -3.0 * (moved[2] - centre[2]), 2.0 + 3.0 * (moved[1] - centre[1])];
        for i in 0..3 {
            assert!((u[i] * length - (moved[i] - rest[i])).abs() < 1e-14, "{u:?} at {rest:?}");
            assert!((v[i] * length / time - wanted[i]).abs() < 1e-13, "{v:?} at {rest:?}");
        }
        kinetic += 0.5 * mass * model.scale.density() * length.powi(3) * wanted.map(|x| x * x).iter().sum::<f64>();
    }
    struct Samples(Vec<tensormass_runtime::simulate::Sample>);
    impl tensormass_runtime::simulate::Observer for Samples {
        fn warning(&mut self, _: &str) {}
        fn limits(&mut self, _: tensormass_runtime::step_limit::StepLimits) {}
        fn progress(&mut self, _: u64, _: u64) {}
        fn interrupted(&self) -> bool {
            false
        }
        fn samples(&self, steps: u64) -> Vec<u64> {
            vec![0, steps]
        }
        fn sample(&mut self, sample: tensormass_runtime::simulate::Sample) {
            self.0.push(sample);
        }
    }
    let mut samples = Samples(vec![]);
    tensormass_runtime::simulate::run(&scene, None, &mut samples).unwrap_or_else(|e| panic!("{e}"));
    let [first, last] = &samples.0[..] else { panic!("two samples") };
    assert!((first.energies.kinetic / kinetic - 1.0).abs() < 1e-12, "{} J, {kinetic} J", first.energies.kinetic);
    assert!(first.energies.elastic.abs() < 1e-20 * 1e7, "{} J", first.energies.elastic);
    // It is stretched by its spin, and gives that back: all of it is kept.
    let total = last.energies.total();
    assert!((total / kinetic - 1.0).abs() < 1e-4, "{total} J, {kinetic} J");
    // It travels as its centre does.
    let centre = |s: &tensormass_runtime::simulate::Sample| {
        s.displacement.iter().zip(masses).map(|(u, m)| u[2] * m).sum::<f64>() / whole
    };
    let way = centre(last) - centre(first);
    assert!((way - 0.2).abs() < 1e-12, "{way} m");
}
