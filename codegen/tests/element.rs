//! Elements: what a declaration must satisfy, and what the generated gather and contraction do.

use tensormass_codegen::element::{ElementDeclaration, declarations, kernels, tetrahedron_p1};
use tensormass_codegen::ir::{Input, Rational, ValidKernel};

fn q(numerator: i128, denominator: i128) -> Rational {
    Rational::new(numerator, denominator)
}

/// The text of a declaration.
fn text(name: &str) -> String {
    let path = format!("{}/elements/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).expect("the element is declared")
}

/// A declaration with one place changed, and the message that refuses it.
fn check(name: &str, old: &str, new: &str, expected: &str) {
    let text = text(name);
    assert!(text.contains(old), "{name} has no `{old}`");
    let all = declarations().expect("accepted");
    let changed = ElementDeclaration::parse(name, &text.replacen(old, new, 1));
    let refused = changed.and_then(|element| element.check_faces(&all)).expect_err(expected).to_string();
    assert_eq!(refused, format!("element `{name}`: {expected}"));
}

#[test]
fn a_wrong_declaration_is_refused() {
    let [p1, p2, hexahedron] = ["tetrahedron_p1", "tetrahedron_p2", "hexahedron_s2"];
    check(p1, "1 - x - y - z", "1 - x - y", "its interpolation functions do not sum to 1");
    check(p1, "order = 1", "order = 2", "a polynomial of order 2 is not reproduced");
    check(
        p1,
        "\"x\"",
        "\"x^2\"",
        "`x^2`: write sums and products of x, y, z and whole numbers, divided by whole numbers",
    );
    check(p1, "\"z\",\n", "", "it has 4 nodes and 3 interpolation functions");
    check(p1, "\"1, 0, 0\"", "\"1, 0\"", "`1, 0` has 2 coordinates, the shape 3");
    check(p1, "\"1, 0, 0\"", "\"2, 0, 0\"", "node 1 is outside the shape");
    check(p1, "1 / 6", "1 / 5", "its quadrature is not exact for polynomials of degree 0");
    check(p1, "degree = 1", "degree = 2", "its quadrature is not exact for polynomials of degree 2");
    check(p1, "1 / 4, 1 / 4", "1 / 4, 1 / 1", "a quadrature point is outside the shape, or a weight is not positive");
    check(
        p1,
        "tetrahedron\"",
        "cone\"",
        "there is no shape `cone`; the shapes are `segment`, `triangle`, `quadrangle`, `tetrahedron`, `hexahedron`, `prism`",
    );
    check(p1, "[0, 2, 1]", "[0, 1, 2]", "the normal of face 3 points inwards");
    check(p1, "[0, 2, 1]", "[0, 2]", "face 3 does not name 3 nodes of the element");
    check(p1, "triangle_p1", "triangle_p3", "face 0 is an element `triangle_p3`, which is not declared");
    // Summed rows of the quadratic tetrahedron's mass are negative at its corners.
    check(p2, "diagonal", "row_sum", "a node bears no or a negative lumped mass; declare `lumping = \"diagonal\"`");
    check(p2, "7, 9, 8]\n\n", "7, 9, 9]\n\n", "its gmsh order does not name each of its 10 nodes once");
    // One face stands twice.
    check(p1, "[0, 1, 3]", "[1, 2, 3]", "its faces do not enclose it");
    // Two mid-side nodes of a face change places.
    check(
        p2,
        "[0, 2, 1, 6, 5, 4]",
        "[0, 2, 1, 5, 6, 4]",
        "on face 3 the function of node 0 is not that of `triangle_p2`",
    );
    // Two functions change places.
    let (first, second) = ("\"4 * x * y\"", "\"4 * y * (1 - x - y - z)\"");
    check(
        p2,
        &format!("{first},\n    {second}"),
        &format!("{second},\n    {first}"),
        "a polynomial of order 1 is not reproduced",
    );
    check(hexahedron, "degree = 5", "degree = 6", "its quadrature is not exact for polynomials of degree 6");
}

/// Reduced integration leaves hourglass modes, as many as the literature counts: 12 of the trilinear hexahedron with one
/// point, 6 of the serendipity hexahedron with eight; in the plane 2 and 1.
#[test]
fn reduced_integration_is_refused() {
    let rule = |name: &str| {
        let text = text(name);
        let start = text.find("[quadrature]").expect("a rule");
        let end = start + text[start..].find("[vtk]").expect("what follows it");
        text[start..end].to_string()
    };
    let one =
        |x: &str, weight: u32| format!("[quadrature]\ndegree = 1\npoints = [\"{x}\"]\nweights = [\"{weight}\"]\n\n");
    let cases = [
        ("hexahedron_q1", one("0, 0, 0", 8), 12, 1),
        ("hexahedron_s2", rule("hexahedron_q1"), 6, 8),
        ("quadrangle_q1", one("0, 0", 4), 2, 1),
        ("quadrangle_s2", rule("quadrangle_q1"), 1, 4),
    ];
    for (name, reduced, modes, points) in cases {
        let refused = format!(
            "{modes} motions that are not rigid have no strain at its {points} quadrature points (hourglass modes): \
             declare a rule of more points"
        );
        check(name, &rule(name), &reduced, &refused);
    }
}

/// The Kronecker property is one of its own: eight functions have more freedom than the six polynomials of second order.
/// Multiples c_j of one function with sum_j c_j p(x_j) = 0 for all of these change nothing that is reproduced.
#[test]
fn functions_are_one_at_their_node_and_zero_at_others() {
    let name = "quadrangle_s2";
    let declared = declarations().expect("accepted").into_iter().find(|e| e.name == name).expect("declared");
    let mut text = text(name);
    for (x, c) in declared.nodes.iter().zip([-1, -1, 1, 1, 2, 0, -2, 0]) {
        // Of the node, by its place among the functions.
        let j = declared.nodes.iter().position(|y| y == x).expect("a node");
        let lines: Vec<&str> = text.lines().collect();
        let first = lines.iter().position(|l| *l == "functions = [").expect("a list") + 1;
        let line = lines[first + j].trim().trim_matches(['"', ',']);
        text = text.replacen(&format!("\"{line}\""), &format!("\"{line} + {c} / 8\""), 1);
    }
    let refused = ElementDeclaration::parse(name, &text).expect_err("refused").to_string();
    assert_eq!(refused, format!("element `{name}`: the function of node 0 is 7/8 at node 0, not 1"));
}

/// The element of docs/adding-an-element.md, which is not shipped, is accepted as it stands there.
#[test]
fn the_documented_element_is_accepted() {
    let path = format!("{}/../docs/adding-an-element.md", env!("CARGO_MANIFEST_DIR"));
    let doc = std::fs::read_to_string(path).expect("the page");
    let (_, rest) = doc.split_once("```toml\n").expect("the file");
    let (text, _) = rest.split_once("```").expect("its end");
    let all = declarations().expect("accepted");
    let element = ElementDeclaration::parse("prism_s2", text).unwrap_or_else(|e| panic!("{e}"));
    element.check_faces(&all).unwrap_or_else(|e| panic!("{e}"));
    let kernels = kernels(&element).expect("kernels");
    assert_eq!((kernels.nodes, kernels.is_linear_simplex), (15, false));
}

/// What the checks of declarations prove by polynomials, once more by numbers, and what they take as given.
#[test]
fn declared_elements_are_what_the_literature_says() {
    let all = declarations().expect("accepted");
    let of = |name: &str| all.iter().find(|e| e.name == name).expect("declared");
    // Nodes, order, quadrature points, and the lumped masses of a corner and of a mid-side node.
    let known = [
        ("segment_p1", 2, 1, 1, (q(1, 2), None)),
        ("segment_p2", 3, 2, 2, (q(1, 6), Some(q(2, 3)))),
        ("triangle_p1", 3, 1, 1, (q(1, 3), None)),
        ("triangle_p2", 6, 2, 3, (q(1, 19), Some(q(16, 57)))),
        ("quadrangle_q1", 4, 1, 4, (q(1, 4), None)),
        ("quadrangle_s2", 8, 2, 9, (q(3, 76), Some(q(4, 19)))),
        ("tetrahedron_p1", 4, 1, 1, (q(1, 4), None)),
        ("tetrahedron_p2", 10, 2, 4, (q(1, 36), Some(q(4, 27)))),
        ("hexahedron_q1", 8, 1, 8, (q(1, 8), None)),
        ("hexahedron_s2", 20, 2, 27, (q(0, 1), None)),
        ("prism_p1", 6, 1, 6, (q(1, 6), None)),
    ];
    for (name, nodes, order, points, (corner, side)) in known {
        let element = of(name);
        let found = (element.nodes.len(), element.order, element.quadrature.points.len());
        assert_eq!(found, (nodes, order, points), "{name}");
        let whole: Rational = element.lumping.iter().sum();
        assert_eq!(whole, q(1, 1), "{name}");
        if corner != q(0, 1) {
            assert_eq!(element.lumping[0], corner, "{name}: a corner");
            assert_eq!(side.map(|_| *element.lumping.last().expect("a node")), side, "{name}: a side");
        }
        assert!(!element.docs.is_empty() && !element.source.is_empty(), "{name}");
        assert_eq!(element.vtk.order.len(), nodes, "{name}");
    }
}

#[test]
fn the_declared_tetrahedron_is_linear() {
    let element = tetrahedron_p1();
    assert_eq!(element.quadrature.weights, [1.0 / 6.0], "the volume of the reference tetrahedron");
    assert!(kernels(&element).expect("accepted").is_linear_simplex, "its kernels are specialised");
}

fn run(kernel: &ValidKernel, inputs: &[(Input, &[f64])]) -> Vec<f64> {
    kernel.interpret(inputs).expect("the element's inputs").remove(0)
}

/// A tetrahedron whose gradients are small dyadic numbers, so that every sum below is exact: rows are the gradients of
/// the functions of nodes 1, 2, 3, and `edges` the inverse, whose columns are the edges from node 0.
const SHAPE: [f64; 9] = [1.0, -0.5, 0.0, 0.0, 1.0, -0.25, 0.0, 0.0, 2.0];
const EDGES: [f64; 9] = [1.0, 0.5, 0.0625, 0.0, 1.0, 0.125, 0.0, 0.0, 0.5];
const G: [f64; 9] = [0.25, -0.5, 1.0, 0.125, 2.0, -1.0, 0.75, -0.25, 0.5];
const TRANSLATION: [f64; 3] = [1024.0, -512.0, 4096.0];

/// Nodal displacements of u = G X + t.
fn displacements(g: &[f64; 9]) -> Vec<f64> {
    let mut u = TRANSLATION.to_vec();
    for node in 0..3 {
        u.extend((0..3).map(|i| TRANSLATION[i] + (0..3).map(|k| g[3 * i + k] * EDGES[3 * k + node]).sum::<f64>()));
    }
    u
}

#[test]
fn linear_displacements_give_their_gradient_exactly() {
    for row in 0..3 {
        for node in 0..3 {
            let unit: f64 = (0..3).map(|k| SHAPE[3 * row + k] * EDGES[3 * k + node]).sum();
            assert_eq!(unit, f64::from(u8::from(row == node)), "the test's own geometry");
        }
    }
    let element = kernels(&tetrahedron_p1()).expect("accepted");
    let inputs = [(Input::NodalDisplacement, &*displacements(&G)), (Input::ShapeGradients, &SHAPE)];
    assert_eq!(run(&element.gradient, &inputs), G);
    // A translation of any size is no strain: each component's differences vanish before they are multiplied.
    let far: Vec<f64> = [1e17, 1.0, -3e8].repeat(4);
    assert_eq!(run(&element.gradient, &[(Input::NodalDisplacement, &far), (Input::ShapeGradients, &SHAPE)]), [0.0; 9]);
}

#[test]
fn forces_are_in_balance_and_do_the_work_of_the_stress() {
    let element = kernels(&tetrahedron_p1()).expect("accepted");
    let stress = [3.0, -1.0, 0.5, 2.0, 7.0, -4.0, 0.25, 1.5, -2.0];
    let weight = 0.125;
    let inputs = [(Input::StressIn, stress.as_slice()), (Input::ShapeGradients, &SHAPE), (Input::Weight, &[weight])];
    let f = run(&element.contract, &inputs);
    assert_eq!(f.len(), 12);
    for i in 0..3 {
        assert_eq!(f[i] + f[3 + i] + f[6 + i] + f[9 + i], 0.0, "component {i} of the resultant");
    }
    // f_j = -w P grad Lambda_j, for the first of the nodes with a gradient of its own.
    let expected: Vec<f64> =
        (0..3).map(|i| -weight * (0..3).map(|k| stress[3 * i + k] * SHAPE[k]).sum::<f64>()).collect();
    assert_eq!(&f[3..6], expected);
    // Virtual work, f . du = -w P : dG: all numbers are dyadic, so that it is exact too.
    let power: f64 = f.iter().zip(displacements(&G)).map(|(f, u)| f * u).sum();
    let internal: f64 = (0..9).map(|k| stress[k] * G[k]).sum();
    assert_eq!(power, -weight * internal);
}

#[test]
fn the_gradients_of_all_nodes_sum_to_zero() {
    let element = kernels(&tetrahedron_p1()).expect("accepted");
    let all = run(&element.node_gradients, &[(Input::ShapeGradients, &SHAPE)]);
    assert_eq!(all[3..], SHAPE);
    for k in 0..3 {
        assert_eq!(all[k] + all[3 + k] + all[6 + k] + all[9 + k], 0.0);
    }
}
