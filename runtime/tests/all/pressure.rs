//! Pressure: its resultants on closed surfaces, its work, a body that it presses on all sides, and a device.

use crate::support::{Random, done, probe, scene};
use tensormass_runtime::body::PressedFace;
use tensormass_runtime::elements;
use tensormass_runtime::mesh::{Mesh, beam_of, tangents};
use tensormass_runtime::scene::Scene;

/// The faces of a body's surface.
fn surface(mesh: &Mesh) -> Vec<PressedFace> {
    let pressed = |face| {
        let (kind, nodes) = (mesh.face_kind(face), mesh.face_nodes(face));
        let positions = mesh.positions(&nodes);
        let tangents = kind.points.iter().map(|p| tangents(p.gradients, &positions)).collect();
        PressedFace { kind, nodes: nodes.iter().map(|n| n.0).collect(), tangents }
    };
    mesh.boundary().into_iter().map(pressed).collect()
}

/// The forces on all nodes.
fn forces(faces: &[PressedFace], u: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut all = vec![[0.0; 3]; u.len()];
    for face in faces {
        let own: Vec<[f64; 3]> = face.nodes.iter().map(|n| u[*n as usize]).collect();
        for (node, force) in face.nodes.iter().zip(face.forces(1.0, &own)) {
            (0..3).for_each(|i| all[*node as usize][i] += force[i]);
        }
    }
    all
}

/// Of every solid element, displaced at random: a unit pressure on the whole surface has no resultant; and its work is the
/// volume that it takes, by central differences of the volume, whose own error at these steps is 1e-9. Straight faces only:
/// rules of curved ones are as coarse as their element's.
#[test]
fn closed_surfaces() {
    let mut rng = Random(7);
    for element in elements().iter().filter(|e| e.info.dimension == 3 && e.info.order == 1) {
        let mesh = beam_of(element, [2.0, 1.0, 1.0], [2, 2, 1], [0.3, 0.0, -1.0]).unwrap_or_else(|e| panic!("{e}"));
        let faces = surface(&mesh);
        let mut random = |size: f64| -> Vec<[f64; 3]> {
            mesh.nodes().iter().map(|_| std::array::from_fn(|_| size * rng.next())).collect()
        };
        let (u, v) = (random(0.05), random(1.0));
        let f = forces(&faces, &u);
        for i in 0..3 {
            let sum: f64 = f.iter().map(|f| f[i]).sum();
            assert!(sum.abs() < 1e-13, "{}: {sum:e} along {i}", element.info.name);
        }
        let volume = |t: f64| {
            let moved =
                u.iter().zip(&v).map(|(u, v)| std::array::from_fn(|i| u[i] + t * v[i])).collect::<Vec<[f64; 3]>>();
            mesh.elements().map(|e| tensormass_runtime::probe::current_volume(&mesh, e.index(), &moved)).sum::<f64>()
        };
        let taken = (volume(1e-4) - volume(-1e-4)) / 2e-4;
        let work: f64 = f.as_flattened().iter().zip(v.as_flattened()).map(|(f, v)| f * v).sum();
        assert!((work + taken).abs() < 1e-7, "{}: work {work}, volume {taken}", element.info.name);
    }
}

/// A block under pressure on all sides, held by the least that holds it.
fn pressed(element: &str, solver: &str) -> String {
    format!(
        "[mesh]\nbeam = {{ size = [2, 1, 1], cells = [2, 1, 1], element = \"{element}\" }}\n[[material]]\nlaw = \"hooke\"\n\
         density = 1000.0\nparameters = {{ young = 1e6, poisson = 0.3 }}\n[[boundary]]\nnodes = \"near(x, xmin)\"\n\
         fix = [\"x\"]\n[[boundary]]\nnodes = \"near(y, ymin)\"\nfix = [\"y\"]\n[[boundary]]\nnodes = \"near(z, zmin)\"\n\
         fix = [\"z\"]\n[[load]]\nkind = \"pressure\"\nfaces = \"near(x, xmax) || near(y, ymax) || near(z, zmax)\"\n\
         value = 1000.0\n{solver}\n[[probe]]\nname = \"x\"\nkind = \"displacement\"\nnodes = \"near(x, xmax)\"\n\
         component = \"x\"\nstatistic = \"max\"\n[[probe]]\nname = \"stress\"\nkind = \"stress\"\ncomponent = \"pressure\"\n\
         [output]\nframes = 0\n"
    )
}

/// A strain of -p (1 - 2 nu) / E in each direction, on every solid element, but for what its square makes of the areas.
#[test]
fn pressed_on_all_sides() {
    for element in elements().iter().filter(|e| e.info.dimension == 3) {
        let run = done(&scene::<&str>(&pressed(element.info.name, "[solver]\nintegrator = \"static\""), &[]));
        let [x, stress] = ["x", "stress"].map(|name| probe(&run, name));
        let wanted = -2.0 * 1000.0 * 0.4 / 1e6;
        assert!((x / wanted - 1.0).abs() < 2e-3, "{}: {x:e}, {wanted:e} wanted", element.info.name);
        assert!((stress / 1000.0 - 1.0).abs() < 2e-3, "{}: {stress:e} Pa", element.info.name);
    }
}

/// A plate that pressure bends by more than its thickness turns its faces: the pressure stays normal, and pulls its free end in
/// more than a traction of the same size, which keeps its direction.
fn plate(load: &str, precision: &str) -> Scene {
    let text = format!(
        "[mesh]\nbeam = {{ size = [4, 1, 0.25], cells = [8, 2, 1] }}\n[[material]]\nlaw = \"st_venant_kirchhoff\"\n\
         density = 1000.0\nparameters = {{ young = 1e6, poisson = 0.3 }}\n[[boundary]]\nnodes = \"near(x, xmin)\"\n\
         fix = [\"x\", \"y\", \"z\"]\n[[load]]\n{load}\nfaces = \"near(z, zmin)\"\nramp = [[0, 0], [1, 1]]\n[solver]\n\
         integrator = \"central-difference\"\nstep = 1e-3\nduration = 1.5\nmass_damping = 5.0\nprecision = \"{precision}\"\n\
         [[probe]]\nname = \"x\"\nkind = \"displacement\"\nnodes = \"near(x, xmax)\"\ncomponent = \"x\"\n[[probe]]\n\
         name = \"z\"\nkind = \"displacement\"\nnodes = \"near(x, xmax)\"\ncomponent = \"z\"\n[output]\nframes = 0\n\
         probe_every = 100\n"
    );
    scene::<&str>(&text, &[])
}

const PRESSURE: &str = "kind = \"pressure\"\nvalue = 1500.0";

#[test]
fn pressure_follows_the_surface() {
    let [followed, kept] =
        [PRESSURE, "kind = \"traction\"\nvalue = [0, 0, 1500.0]"].map(|load| done(&plate(load, "f64")));
    let at = |name| [probe(&followed, name), probe(&kept, name)];
    eprintln!("x {:?}, z {:?}: pressure, traction", at("x"), at("z"));
    let ([x, without], [z, _]) = (at("x"), at("z"));
    assert!(z > 0.5, "bent by {z}");
    assert!(x < without - 0.01, "{x} with pressure, {without} with a traction");
}

#[cfg(feature = "gpu")]
#[test]
fn a_device_presses_as_the_cpu() {
    use std::sync::Arc;
    use tensormass_runtime::gpu::GpuOptions;
    use tensormass_runtime::simulate::{Silent, run_on};
    use tensormass_runtime::target::Target;
    let Some(gpu) = crate::support::gpu::test_device() else { return };
    let on_device = |scene: &Scene| {
        run_on(&Target::Gpu(Arc::clone(&gpu), GpuOptions::default()), scene, None, &mut Silent)
            .unwrap_or_else(|e| panic!("{e}"))
    };
    let check = |what: &str, scene: &Scene| {
        let (device, cpu) = (on_device(scene), done(scene));
        for ((name, _, value), (_, _, wanted)) in device.probes.iter().zip(&cpu.probes) {
            assert!((value - wanted).abs() <= 1e-4 * wanted.abs(), "{what}, {name}: {value:e} for {wanted:e}");
        }
    };
    check("plate", &plate(PRESSURE, "f32"));
    let solver = "[solver]\nintegrator = \"static\"\nprecision = \"f32\"\nnewton = { tolerance = 1e-5 }";
    for element in elements().iter().filter(|e| e.info.dimension == 3) {
        check(element.info.name, &scene::<&str>(&pressed(element.info.name, solver), &[]));
    }
}
