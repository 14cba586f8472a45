//! Whether a run's last states satisfy the equations that its integrator solves, by code that shares nothing with the solver: the
//! law's textbook form in exact arithmetic, on each tetrahedron by itself.

use tensormass_codegen::ir::{Input, Number};
use tensormass_lawbench::evaluate::{constants, textbook};
use tensormass_lawbench::number::Exact;
use tensormass_lawbench::subject::Subject;
use tensormass_runtime::mesh::ElementId;
use tensormass_runtime::model::Model;
use tensormass_runtime::scene::{Integrator, Scene};

/// The residual of the last step, as a part of the greatest of its terms: of inertia, of elements, of loads; or how far an imposed
/// component is from its place, as a part of the greatest displacement, if that is more. None where there are not
/// the states for it, the law has a dissipation, or a step is linearised of a law that is not linear.
///
/// `u` are the displacements (m) before, at the beginning and at the end of the last step; of equilibrium the last one counts.
pub fn residual(scene: &Scene, model: &Model, subject: &Subject, u: [&[[f64; 3]]; 3]) -> Option<f64> {
    let linearised = scene.solver.newton.max_iterations == 1 && !model.body.is_linear();
    if model.body.is_viscous() || linearised {
        return None;
    }
    let implicit = !scene.solver.integrator.is_explicit();
    let inertia = scene.solver.integrator != Integrator::Static;
    let (scale, nodes) = (model.scale, model.mesh.nodes().len());
    let at = if implicit { u[2] } else { u[1] };
    let (forces, greatest) = element_forces(model, subject, at)?;
    let mut loads = vec![[0.0; 3]; nodes];
    let steps = scene.solver.steps();
    let step = scene.solver.step? / scale.time;
    let time = step * (steps - u64::from(!implicit)) as f64;
    for load in &model.body.loads {
        let factor = load.history.at(time);
        for (sum, f) in loads.iter_mut().zip(&load.forces) {
            (0..3).for_each(|i| sum[i] += factor * f[i] * scale.force());
        }
    }
    let seconds = scene.solver.step?;
    let unit = scale.density() * scale.length.powi(3);
    let imposed = model.body.motions_at(step * steps as f64);
    let greatest_move = u[2].as_flattened().iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let mut held = vec![[false; 3]; nodes];
    let mut misplaced = 0.0_f64;
    for c in &model.body.constraints {
        let (node, component) = (c.node as usize, c.component as usize);
        held[node][component] = true;
        misplaced = misplaced.max((u[2][node][component] - scale.length * imposed[c.motion]).abs());
    }
    // Where nothing moves nothing is misplaced.
    let misplaced = if misplaced == 0.0 { 0.0 } else { misplaced / greatest_move };
    let (mut off, mut size) = (0.0_f64, greatest);
    for n in 0..nodes {
        for i in (0..3).filter(|i| !held[n][*i]) {
            let second = (u[2][n][i] - u[1][n][i]) - (u[1][n][i] - u[0][n][i]);
            let inertial = if inertia { model.body.masses[n] * unit * second / (seconds * seconds) } else { 0.0 };
            let terms = [inertial, -forces[n][i], -loads[n][i]];
            off = off.max(terms.iter().sum::<f64>().abs());
            size = terms.iter().fold(size, |size, x| size.max(x.abs()));
        }
    }
    Some(misplaced.max(if off == 0.0 { 0.0 } else { off / size }))
}

/// Forces smaller than this part of what the displacements' gradient would cause, if it were strain, are roundings: a body that
/// turns as a whole has no others.
const ROUNDINGS: f64 = 1e-6;
/// Textbook forms of gradients below this lose digits in f64.
const SMALL: f64 = 0.01;

/// The forces of the elements on their nodes in N, and the greatest that one element exerts; none where an element is outside its
/// law's domain.
fn element_forces(model: &Model, subject: &Subject, u: &[[f64; 3]]) -> Option<(Vec<[f64; 3]>, f64)> {
    let (mut forces, mut greatest) = (vec![[0.0; 3]; u.len()], 0.0_f64);
    for batch in &model.body.batches {
        for element in &batch.elements {
            let nodes = &model.body.elements[*element as usize];
            let rest: Vec<[f64; 3]> = nodes.iter().map(|n| model.mesh.nodes()[*n as usize]).collect();
            let (slopes, volume) = linear(&rest)?;
            let mut g = [0.0; 9];
            for (n, slope) in nodes.iter().zip(&slopes) {
                for k in 0..9 {
                    g[k] += u[*n as usize][k / 3] * slope[k % 3];
                }
            }
            let size = g.iter().map(|x| x * x).sum::<f64>().sqrt();
            let parameters = model.parameters(ElementId(*element));
            let stress = if size < SMALL {
                stress::<Exact>(subject, parameters, &g)?.iter().map(Exact::to_f64).collect()
            } else {
                stress::<f64>(subject, parameters, &g)?
            };
            for (n, slope) in nodes.iter().zip(&slopes) {
                for k in 0..9 {
                    let part = volume * stress[k] * slope[k % 3];
                    let turning = ROUNDINGS * model.scale.stress * volume * size * slope[k % 3];
                    greatest = greatest.max(part.abs()).max(turning.abs());
                    forces[*n as usize][k / 3] -= part;
                }
            }
        }
    }
    Some((forces, greatest))
}

/// P in Pa by the law's textbook form; none outside its domain.
fn stress<T: Number + From<f64> + Positive>(subject: &Subject, parameters: &[f64], g: &[f64; 9]) -> Option<Vec<T>> {
    let parameters: Vec<T> = parameters.iter().copied().map(T::from).collect();
    let constants = constants(&subject.derivation, &parameters);
    let g: Vec<T> = g.iter().copied().map(T::from).collect();
    let inputs = [(Input::Constants, &constants[..]), (Input::DisplacementGradient, &g[..])];
    let found = textbook(&subject.derivation, "force", &inputs);
    found.margin.is_none_or(|m| m.is_positive_number()).then_some(found.value)
}

/// Numbers that can be above 0.
trait Positive {
    fn is_positive_number(&self) -> bool;
}

impl Positive for f64 {
    fn is_positive_number(&self) -> bool {
        *self > 0.0
    }
}

impl Positive for Exact {
    fn is_positive_number(&self) -> bool {
        self.is_positive()
    }
}

/// The slopes of the functions of a linear tetrahedron's nodes, and its volume: Cramer's rule.
fn linear(x: &[[f64; 3]]) -> Option<(Vec<[f64; 3]>, f64)> {
    let [a, b, c, d] = x else { return None };
    let minus = |p: &[f64; 3], q: &[f64; 3]| -> [f64; 3] { std::array::from_fn(|i| p[i] - q[i]) };
    let cross =
        |p: [f64; 3], q: [f64; 3]| [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
    let (u, v, w) = (minus(b, a), minus(c, a), minus(d, a));
    let six: f64 = cross(u, v).iter().zip(w).map(|(p, q)| p * q).sum();
    let slopes = [cross(v, w), cross(w, u), cross(u, v)].map(|s| s.map(|x| x / six));
    let first: [f64; 3] = std::array::from_fn(|i| -(slopes[0][i] + slopes[1][i] + slopes[2][i]));
    Some((vec![first, slopes[0], slopes[1], slopes[2]], six / 6.0))
}
