//! 3 by 3 matrices, row by row, of numbers that know their rounding error.

use crate::rounding::Rounded;

/// Component 3 i + j is row i, column j.
pub type Matrix = [Rounded; 9];

/// A matrix of numbers that are exact in the working precision.
pub fn exact(a: &[f64; 9]) -> Matrix {
    a.map(Rounded::exact)
}

/// The values alone.
pub fn values(a: &Matrix) -> [f64; 9] {
    a.map(|x| x.value)
}

/// A B.
pub fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|k| (0..3).map(|m| a[3 * (k / 3) + m] * b[3 * m + k % 3]).sum())
}

/// A'.
pub fn transpose(a: &Matrix) -> Matrix {
    std::array::from_fn(|k| a[3 * (k % 3) + k / 3])
}

/// A + s 1.
pub fn shifted(a: &Matrix, s: f64) -> Matrix {
    std::array::from_fn(|k| if k % 4 == 0 { a[k] + Rounded::exact(s) } else { a[k] })
}

/// A : B.
pub fn ddot(a: &Matrix, b: &Matrix) -> Rounded {
    (0..9).map(|k| a[k] * b[k]).sum()
}

/// det A, by the first row.
pub fn det(a: &Matrix) -> Rounded {
    a[0] * (a[4] * a[8] - a[5] * a[7]) + a[1] * (a[5] * a[6] - a[3] * a[8]) + a[2] * (a[3] * a[7] - a[4] * a[6])
}

/// The greatest magnitude among the components.
pub fn magnitude(a: &Matrix) -> f64 {
    a.iter().fold(0.0, |m, x| m.max(x.value.abs()))
}

/// The rotation of a quaternion, which need not have length one: exact but for the rounding that is kept.
pub fn rotation(q: [f64; 4]) -> Matrix {
    let [w, x, y, z] = q.map(Rounded::exact);
    let s = Rounded::exact(2.0) / (w * w + x * x + y * y + z * z);
    let one = Rounded::exact(1.0);
    [
        one - s * (y * y + z * z),
        s * (x * y - w * z),
        s * (x * z + w * y),
        s * (x * y + w * z),
        one - s * (x * x + z * z),
        s * (y * z - w * x),
        s * (x * z - w * y),
        s * (y * z + w * x),
        one - s * (x * x + y * y),
    ]
}
