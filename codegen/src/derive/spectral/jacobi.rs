//! Jacobi's rotations, written out as straight-line stages: eigenvalues and eigenvectors of C = F'F.
//!
//! A rotation in the plane of the axes p and q takes the angle whose tangent t is the lesser root of t^2 + 2 t d/g = 1
//! (Golub & Van Loan, Matrix Computations, 4th ed., section 8.5.2), by the form g / (d + sign(d) sqrt(d^2 + g^2)), which
//! neither cancels nor divides by zero: [`TINY`] stands under the root. A sweep turns each of the three planes once.

use crate::expr::{Expr, Rational};
use crate::quantity::{Kind, Quantities, Value};

/// Sweeps of three rotations. Three leave 2e-4 of an off-diagonal part. Four leave at most 5e-16 of |f_p| |f_q| between
/// columns of F, and 4e-18 of |A| off the diagonal of A, in f64: measured over 810,000 states, strains from 1e-8 to
/// 10, rotated and not, with distinct stretches, two or three equal ones, and relative gaps from 1e-2 to 1e-12.
const SWEEPS: usize = 4;

/// The planes in which a sweep rotates.
const PLANES: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

/// 2^-120: keeps square roots and divisors from being zero. Beside squares of numbers near 1 it rounds away, also in
/// f64; below 1e-18 it stops a rotation that would not count.
pub const TINY: Rational = Rational::new_raw(1, 1 << 120);

/// An orthonormal frame: component k of vector p is `[p][k]`.
pub type Frame = [[Expr; 3]; 3];

/// A stage of this expression, or the expression itself where it is no more than a number and a symbol.
pub fn stage(quantities: &mut Quantities, name: impl Into<String>, e: Expr) -> Expr {
    if quantities.is_simple(&e) { e } else { quantities.stage(name, e).into() }
}

/// `then` where x > y, `otherwise` elsewhere.
pub fn select(
    quantities: &mut Quantities,
    name: impl Into<String>,
    (x, y): (Expr, Expr),
    then: Expr,
    otherwise: Expr,
) -> Expr {
    let value = Value::Select { left: x, right: y, then, otherwise };
    quantities.add(name, Kind::Stage { value, partials: None }).into()
}

/// e^(n/d).
pub fn power(e: Expr, n: i128, d: i128) -> Expr {
    e.pow(Rational::new(n, d))
}

fn dot(x: &[Expr; 3], y: &[Expr; 3]) -> Expr {
    (0..3).fold(Expr::int(0), |sum, k| sum + x[k].clone() * y[k].clone())
}

fn axes() -> Frame {
    std::array::from_fn(|p| std::array::from_fn(|k| Expr::int(i128::from(p == k))))
}

/// Tangent, cosine and sine of an angle.
struct Rotation {
    t: Expr,
    c: Expr,
    s: Expr,
}

impl Rotation {
    /// The rotation that makes g zero, where d is half the difference of the diagonal.
    fn new(quantities: &mut Quantities, d: Expr, g: Expr) -> Self {
        let d = stage(quantities, "d", d);
        let g = stage(quantities, "g", g);
        let square = power(d.clone(), 2, 1) + power(g.clone(), 2, 1) + Expr::Number(TINY);
        let root = stage(quantities, "root", power(square, 1, 2));
        let positive = (d.clone(), Expr::int(0));
        let divisor = select(quantities, "divisor", positive, d.clone() + root.clone(), d - root);
        let t = stage(quantities, "t", g / divisor);
        let c = stage(quantities, "c", power(Expr::int(1) + power(t.clone(), 2, 1), -1, 2));
        let s = stage(quantities, "s", t.clone() * c.clone());
        Self { t, c, s }
    }

    fn pair(&self, quantities: &mut Quantities, name: &str, x: &Expr, y: &Expr) -> [Expr; 2] {
        let Self { c, s, .. } = self;
        let turned = [c.clone() * x.clone() - s.clone() * y.clone(), s.clone() * x.clone() + c.clone() * y.clone()];
        turned.map(|e| stage(quantities, name, e))
    }

    fn vectors(&self, quantities: &mut Quantities, name: &str, frame: &mut Frame, (p, q): (usize, usize)) {
        for k in 0..3 {
            let name = format!("{name}{k}");
            let [x, y] = self.pair(quantities, &name, &frame[p][k], &frame[q][k]);
            (frame[p][k], frame[q][k]) = (x, y);
        }
    }
}

/// Of a symmetric A, given by its components 00, 11, 22, 01, 02, 12: eigenvalues to an absolute error of a few units of
/// round-off times |A|, and eigenvectors. Of A = 0: zeros exactly, and the axes.
pub fn of_symmetric(quantities: &mut Quantities, a: [Expr; 6]) -> ([Expr; 3], Frame) {
    let mut scale = Expr::Number(TINY);
    for x in &a {
        let minus = Expr::int(-1) * x.clone();
        scale = scale + select(quantities, "abs", (x.clone(), Expr::int(0)), x.clone(), minus);
    }
    // Angles are scale-free: of scaled numbers, so that no square leaves the range at tiny strains.
    let inverse = stage(quantities, "per_scale", power(scale, -1, 1));
    let [xx, yy, zz, xy, xz, yz] = a;
    let (mut diagonal, mut off) = ([xx, yy, zz], [xy, xz, yz]);
    let mut frame = axes();
    for _ in 0..SWEEPS {
        for (plane, (p, q)) in PLANES.into_iter().enumerate() {
            let g = off[plane].clone();
            let d = Expr::ratio(1, 2) * inverse.clone() * (diagonal[q].clone() - diagonal[p].clone());
            let rotation = Rotation::new(quantities, d, inverse.clone() * g.clone());
            let step = stage(quantities, "step", rotation.t.clone() * g);
            diagonal[p] = stage(quantities, format!("a{p}"), diagonal[p].clone() - step.clone());
            diagonal[q] = stage(quantities, format!("a{q}"), diagonal[q].clone() + step);
            off[plane] = Expr::int(0);
            // The components between the third axis r and the two.
            let r = 3 - p - q;
            let at = |x: usize, y: usize| x + y - 1;
            let [x, y] = rotation.pair(quantities, "off", &off[at(p, r)], &off[at(q, r)]);
            (off[at(p, r)], off[at(q, r)]) = (x, y);
            rotation.vectors(quantities, "v", &mut frame, (p, q));
        }
    }
    let squares = squared_lengths(quantities, &frame);
    (diagonal, of_unit_length(quantities, &frame, &squares))
}

fn squared_lengths(quantities: &mut Quantities, frame: &Frame) -> [Expr; 3] {
    std::array::from_fn(|p| stage(quantities, format!("vv{p}"), dot(&frame[p], &frame[p])))
}

/// Vectors whose squared lengths are 1 but for a few roundings, of unit length: one step of Newton's. A rotation whose
/// cosine and sine are rounded is a rotation times a number near 1, so that lengths drift and angles do not.
fn of_unit_length(quantities: &mut Quantities, frame: &Frame, squares: &[Expr; 3]) -> Frame {
    std::array::from_fn(|p| {
        let factor = stage(quantities, "unit", Expr::ratio(3, 2) - Expr::ratio(1, 2) * squares[p].clone());
        std::array::from_fn(|k| stage(quantities, format!("n{k}"), factor.clone() * frame[p][k].clone()))
    })
}

/// Of C = F'F, from F row by row: the columns of F are rotated until they are orthogonal (Hestenes 1958); their squared
/// lengths are the eigenvalues, each to a few units of round-off of itself, great and small alike.
pub fn of_columns(quantities: &mut Quantities, f: [Expr; 9]) -> ([Expr; 3], Frame) {
    let mut columns: Frame = std::array::from_fn(|p| std::array::from_fn(|k| f[3 * k + p].clone()));
    let mut frame = axes();
    for _ in 0..SWEEPS {
        for (p, q) in PLANES {
            let (x, y) = (&columns[p], &columns[q]);
            let (d, g) = (dot(y, y), dot(x, y));
            let square = stage(quantities, "xx", dot(x, x));
            let d = Expr::ratio(1, 2) * (stage(quantities, "yy", d) - square);
            let rotation = Rotation::new(quantities, d, g);
            rotation.vectors(quantities, "f", &mut columns, (p, q));
            rotation.vectors(quantities, "v", &mut frame, (p, q));
        }
    }
    // The columns' lengths have drifted as those of the vectors did: 1 / (1 + e) = 1 - e there.
    let lengths = squared_lengths(quantities, &frame);
    let squares = std::array::from_fn(|p| {
        let drift = Expr::int(2) - lengths[p].clone();
        stage(quantities, format!("c{p}"), dot(&columns[p], &columns[p]) * drift)
    });
    (squares, of_unit_length(quantities, &frame, &lengths))
}
