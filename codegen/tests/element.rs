//! Elements: what a declaration must satisfy, and what the generated gather and contraction do.

use tensormass_codegen::element::{ElementDeclaration, kernels, tetrahedron_p1};
use tensormass_codegen::ir::{Input, Rational, ValidKernel};

fn q(numerator: i128, denominator: i128) -> Rational {
    Rational::new(numerator, denominator)
}

/// Changes the declaration of the linear tetrahedron and compares the message.
fn check(change: impl FnOnce(&mut ElementDeclaration), expected: &str) {
    let mut element = tetrahedron_p1();
    change(&mut element);
    assert_eq!(kernels(&element).expect_err("refused").to_string(), expected);
}

#[test]
fn a_wrong_declaration_is_refused() {
    let unity = "element `tetrahedron_p1`: its interpolation functions do not sum to 1";
    check(|e| e.functions[0][0].0 = q(2, 1), unity);
    check(|e| e.functions[1][0].0 = q(1, 2), unity);
    check(|e| e.functions[3].push((q(1, 1), [1, 1, 0])), unity);
    check(|e| drop(e.functions.pop()), unity);
    let constant = "element `tetrahedron_p1`: only elements with constant gradients and one quadrature point are \
                    supported by this version";
    check(|e| e.quadrature.push(([q(1, 4); 3], q(0, 1))), constant);
    // x y moved from one function to another: the sum is still one, the gradients vary.
    let bubble = |e: &mut ElementDeclaration| {
        e.functions[0].push((q(-1, 1), [1, 1, 0]));
        e.functions[1].push((q(1, 1), [1, 1, 0]));
    };
    check(bubble, constant);
}

#[test]
fn the_declared_tetrahedron_is_linear() {
    let element = tetrahedron_p1();
    let weight: Rational = element.quadrature.iter().map(|(_, w)| *w).sum();
    assert_eq!(weight, q(1, 6), "the volume of the reference tetrahedron");
    let rows: Vec<[i128; 3]> =
        kernels(&element).expect("accepted").reference_gradients.iter().map(|r| r.map(|x| x.to_integer())).collect();
    assert_eq!(rows, [[-1, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1]]);
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
