//! Material points: found wherever an element is, whose functions' gradients they have; the stress there.

use crate::support::elements::{distorted, unit};
use crate::support::{CANTILEVER, Random, done, probe, scene};
use tensormass_kernels::{ElementEntry, elements};
use tensormass_runtime::mesh::Locator;
use tensormass_runtime::model::build;

/// A random place in an element's shape, of a corner's coordinates or further inside.
fn inside(element: &ElementEntry, rng: &mut Random) -> [f64; 3] {
    let reference = element.info.reference;
    let weights: Vec<f64> = reference.iter().map(|_| rng.next().abs()).collect();
    let sum: f64 = weights.iter().sum();
    std::array::from_fn(|c| reference.iter().zip(&weights).map(|(x, w)| x[c] * w / sum).sum())
}

/// Points of every element of a distorted mesh are found, and displacements that are polynomials of the element's order have
/// their gradients there: exactly but for roundings, of linear ones in distorted elements, of quadratic ones in regular ones.
#[test]
fn gradients_are_those_of_the_displacement() {
    let mut rng = Random(11);
    for element in elements().iter().filter(|e| e.info.dimension > 1) {
        let plane = element.info.dimension == 2;
        for (mesh, order) in [(distorted(&unit(element, 2), 0.2, 3), 1), (unit(element, 2), element.info.order)] {
            let a: [[f64; 3]; 3] = std::array::from_fn(|_| rng.vector(1.0));
            let b = if order == 2 { rng.vector(1.0) } else { [0.0; 3] };
            // u_i = a_i . X + b_i X_0 X_1
            let u: Vec<[f64; 3]> = mesh
                .nodes()
                .iter()
                .map(|x| std::array::from_fn(|i| (0..3).map(|k| a[i][k] * x[k]).sum::<f64>() + b[i] * x[0] * x[1]))
                .collect();
            let locator = Locator::new(&mesh);
            let mut found = vec![0; mesh.len()];
            for e in mesh.elements() {
                for _ in 0..10 {
                    let xi = inside(element, &mut rng);
                    let (values, _) = element.info.functions_at(xi);
                    let nodes = mesh.positions(mesh.element_nodes(e));
                    let x: [f64; 3] =
                        std::array::from_fn(|c| nodes.iter().zip(&values).map(|(x, value)| x[c] * value).sum());
                    assert_eq!(locator.find(x), mesh.material_point(x), "{}: {x:?}", element.info.name);
                    let point = mesh.material_point(x).unwrap_or_else(|| panic!("{}: {x:?}", element.info.name));
                    found[e.0 as usize] += usize::from(point.element == e);
                    let here = point.displacement(&mesh, &u);
                    for i in 0..3 {
                        let wanted = (0..3).map(|k| a[i][k] * x[k]).sum::<f64>() + b[i] * x[0] * x[1];
                        let plane = if plane { a[i][2] * x[2] } else { 0.0 };
                        assert!((here[i] - wanted + plane).abs() < 1e-12, "{}, {x:?}: {here:?}", element.info.name);
                    }
                    let g = point.displacement_gradient(&mesh, &u);
                    for k in 0..9 {
                        let (i, j) = (k / 3, k % 3);
                        let bent = [b[i] * x[1], b[i] * x[0], 0.0][j];
                        let wanted = if plane && j == 2 { 0.0 } else { a[i][j] + bent };
                        let name = element.info.name;
                        assert!((g[k] - wanted).abs() < 1e-12, "{name}, {x:?}, {i} {j}: {:e} for {wanted:e}", g[k]);
                    }
                }
            }
            // But where it lies on a side of one before.
            assert!(found.iter().all(|n| *n >= 9), "{}: {found:?}", element.info.name);
            let [low, high] = mesh.bounding_box();
            let beyond = std::array::from_fn(|c| high[c] + 0.1 * (high[c] - low[c]));
            assert_eq!(mesh.material_point(beyond), None, "{}", element.info.name);
        }
    }
}

/// The stress at a point of a linear tetrahedron is its element's, of any law's state; that of a bent beam of quadratic elements
/// is the textbook's, M z / I, to 1 % away from its ends.
#[test]
fn stresses_are_those_of_the_point() {
    let point = |name: &str, at: [f64; 3], component: &str| {
        format!("[[probe]]\nname = \"{name}\"\nkind = \"point_stress\"\npoint = {at:?}\ncomponent = \"{component}\"\n")
    };
    let text = CANTILEVER.replace("law = \"hooke\"", "law = \"neo_hookean\"");
    for component in ["xx", "xz", "von_mises", "pressure"] {
        // The centre of a tetrahedron alone is in this box.
        let at = [4.875, 0.75, 0.625];
        let of_element = format!(
            "[[probe]]\nname = \"element\"\nkind = \"stress\"\nelements = {{ box = {{ min = [4.87, 0.74, 0.62], max = [4.88, 0.76, \
             0.63] }} }}\ncomponent = \"{component}\"\n"
        );
        let scene = scene(
            &[&text, &of_element, &point("point", at, component)].map(String::as_str).concat(),
            &["solver.precision=f64"],
        );
        let run = done(&scene);
        let [found, wanted] = ["point", "element"].map(|name| probe(&run, name));
        assert!((found - wanted).abs() <= 1e-9 * wanted.abs(), "{component}: {found:e} for {wanted:e}");
    }
    for (z, element) in [(0.9, "hexahedron_s2"), (0.1, "tetrahedron_p2"), (0.5, "hexahedron_s2")] {
        let set = [format!("mesh.beam.element={element}")];
        let run = done(&scene(&format!("{CANTILEVER}{}", point("bent", [5.0, 0.5, z], "xx")), &set));
        // A force of 1 N upwards at x = 10: compressed above.
        let (found, wanted) = (probe(&run, "bent"), -5.0 * (z - 0.5) * 12.0);
        assert!((found - wanted).abs() <= 0.01 * 30.0, "{element}, z {z}: {found:e} for {wanted:e}");
    }
}

/// Points outside are refused where they are given.
#[test]
fn points_outside_are_refused() {
    let text = CANTILEVER.to_string()
        + "[[probe]]\nname = \"p\"\nkind = \"point_stress\"\npoint = [11, 0.5, 0.5]\ncomponent = \"xx\"\n";
    let refused = build(&scene::<&str>(&text, &[])).expect_err("it is outside").to_string();
    assert!(refused.contains("no element contains the point (11, 0.5, 0.5)"), "{refused}");
    assert!(refused.starts_with("test.toml:47:9"), "{refused}");
}
