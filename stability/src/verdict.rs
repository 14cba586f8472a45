//! What came of a specimen.

use tensormass_runtime::mesh::{Mesh, NodeId};
use tensormass_runtime::scene::Precision;

use crate::reference::Reference;
use crate::run::{End, Look, Ran};

/// What came of a specimen.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// Right within this part of the greatest value.
    Right(f64),
    /// Another solution of the same equations, which are satisfied to this part of their terms: where bodies buckle there are several.
    Other(f64),
    /// Off by more, and the program says so.
    Told(f64, String),
    /// Stopped with a reason, its results kept.
    Stopped(String),
    /// Refused with a message.
    Refused(String),
    /// Stopped by the suite, for want of time.
    Unfinished,
    /// There is nothing to compare it with, and why.
    Unjudged(String),
    /// Wrong by this part, and why.
    Wrong(f64, String),
}

/// The greatest error that counts as right: what tolerances of solvers and roundings come to.
fn right(precision: Precision) -> f64 {
    match precision {
        Precision::F32 => 5e-3,
        Precision::F64 => 1e-5,
    }
}

/// The part of its energy that a body may lose or gain in a drift. Energies of explicit steps of a tenth of the critical one, 2 / omega,
/// swing by up to (omega h)^2 / 4 of what the stiffest mode has.
const KEPT: f64 = 1e-2;
/// What tells where no warning does.
const ESTIMATE: &str = "the estimate of the error in summary.json";
/// An error that a run estimates itself may be so many times greater.
const ESTIMATED: f64 = 3.0;

/// Judges a run of a specimen that is `rest` at rest, in units of length; `unsolved` is by how much of their terms its states miss
/// the equations of equilibrium.
pub fn judge(
    ran: &Ran,
    reference: &Reference,
    rest: &Mesh,
    (precision, keeps_energy): (Precision, bool),
    unsolved: impl FnOnce() -> Option<f64>,
) -> Verdict {
    let finite = |look: &Look| look.displacement.iter().flatten().all(|x| x.is_finite());
    if !ran.looks.iter().all(finite) {
        return Verdict::Wrong(f64::INFINITY, "a state that is not a number".into());
    }
    match &ran.end {
        End::Refused(why) => return Verdict::Refused(why.clone()),
        End::Stopped(why) => return Verdict::Stopped(why.clone()),
        End::Unfinished => return Verdict::Unfinished,
        End::Done => {}
    }
    let limit = if matches!(reference, Reference::Energy) { KEPT } else { right(precision) };
    let error = match reference {
        Reference::Exact { stretches, reaction, energy } => exact(ran, rest.nodes(), *stretches, [*reaction, *energy]),
        Reference::Twin(looks) => apart(&ran.looks, looks),
        Reference::Energy => drift(&ran.looks, keeps_energy),
        Reference::None(why) => {
            return told(ran).map_or_else(|| Verdict::Unjudged(why.clone()), |t| Verdict::Told(f64::NAN, t));
        }
        Reference::Unsolved(off) => {
            let estimate = ran.estimate.filter(|estimate| *estimate > right(precision));
            let said = told(ran).or(estimate.map(|_| ESTIMATE.to_string()));
            return match said {
                Some(said) => Verdict::Told(*off, said),
                None => Verdict::Wrong(*off, "the twin in f64 does not solve its equations".into()),
            };
        }
    };
    let is_inverted = ran.looks.iter().any(|look| inverted(rest, &look.displacement));
    if is_inverted && !ran.warnings.iter().any(|w| w.contains("inside out")) {
        return Verdict::Wrong(error, "elements are inside out, and nothing says so".into());
    }
    if error <= limit {
        return Verdict::Right(error);
    }
    if let (Reference::Exact { .. }, Some(off)) = (reference, unsolved())
        && off <= limit
    {
        return Verdict::Other(off);
    }
    let estimated = ran.estimate.filter(|estimate| ESTIMATED * estimate >= error);
    let estimated = estimated.map(|_| ESTIMATE.to_string());
    match told(ran).or(estimated) {
        Some(warning) => Verdict::Told(error, warning),
        None => Verdict::Wrong(error, "nothing says so".into()),
    }
}

/// A warning that the results may be off: not of what is only slow, nor of what elements are whatever happens.
fn told(ran: &Ran) -> Option<String> {
    let others = ["software device", "is a sliver", "lock where volume"];
    ran.warnings.iter().find(|w| !others.iter().any(|other| w.contains(other))).cloned()
}

/// Whether a tetrahedron is inside out, by more than roundings.
fn inverted(rest: &Mesh, u: &[[f64; 3]]) -> bool {
    let volume = |x: &dyn Fn(usize) -> [f64; 3], nodes: &[NodeId; 4]| {
        let [a, b, c, d] = nodes.map(|n| x(n.index()));
        let edge = |p: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| p[i] - a[i]) };
        let ([p, q, r], [s, t, v], [l, m, n]) = (edge(b), edge(c), edge(d));
        p * (t * n - v * m) - q * (s * n - v * l) + r * (s * m - t * l)
    };
    let at_rest = |n: usize| rest.nodes()[n];
    let moved = |n: usize| -> [f64; 3] { std::array::from_fn(|i| rest.nodes()[n][i] + u[n][i]) };
    rest.tets().iter().any(|nodes| volume(&moved, nodes) < -1e-6 * volume(&at_rest, nodes))
}

fn exact(ran: &Ran, rest: &[[f64; 3]], stretches: [f64; 3], [reaction, energy]: [f64; 2]) -> f64 {
    let (Some(last), Some(found)) = (ran.looks.last(), ran.reaction) else { return f64::INFINITY };
    let greatest = stretches.iter().fold(0.0_f64, |m, g| m.max(g.abs()));
    let off = last.displacement.iter().zip(rest).flat_map(|(u, x)| (0..3).map(|i| (u[i] - stretches[i] * x[i]).abs()));
    let off = off.fold(0.0, f64::max) / greatest;
    off.max((found / reaction - 1.0).abs()).max((last.energy / energy - 1.0).abs())
}

/// The greatest distance of displacements, as a part of the greatest displacement.
fn apart(found: &[Look], wanted: &[Look]) -> f64 {
    if found.len() != wanted.len() {
        return f64::INFINITY;
    }
    let (mut off, mut size) = (0.0_f64, 0.0_f64);
    for (a, b) in found.iter().zip(wanted) {
        for (a, b) in a.displacement.iter().flatten().zip(b.displacement.iter().flatten()) {
            off = off.max((a - b).abs());
            size = size.max(b.abs());
        }
    }
    if off == 0.0 { 0.0 } else { off / size }
}

/// The part of its energy that a body has gained, or lost too if nothing dissipates.
fn drift(looks: &[Look], keeps_energy: bool) -> f64 {
    let (Some(first), Some(last)) = (looks.first(), looks.last()) else { return f64::INFINITY };
    let gained = (last.energy - first.energy) / first.energy.abs();
    if keeps_energy { gained.abs() } else { gained.max(0.0) }
}
