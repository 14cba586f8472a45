//! Nodes that are turned about an axis: rigid turns, and the torsion of a bar against Saint-Venant's.

mod support;

use support::{done, probe, scene};

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
