// The remainders of the logarithm and the exponential, x - ln(1 + x) and exp(x) - 1 - x, accurate for every x.
//
// Energies are of second order at rest, where x and ln(1 + x) agree in all their digits. This text is compiled twice:
// here, for the interpreter, and with the generated kernels, which it is printed beside. (No inner doc comment: it is
// included.)

/// Remainders of the logarithm and the exponential.
pub trait Remainder: Copy {
    /// x - ln(1 + x) for x > -1, within 4 units in the last place.
    fn log1pmx(self) -> Self;
    /// exp(x) - 1 - x, within 4 units in the last place.
    fn expm1mx(self) -> Self;
}

macro_rules! remainder {
    ($t:ty, $log_terms:literal, $exp_terms:literal) => {
        impl Remainder for $t {
            #[inline]
            fn log1pmx(self) -> Self {
                if self > -0.5 && self < 1.0 {
                    // ln(1 + x) = 2 atanh(y), y = x / (2 + x), hence x - ln(1 + x) = x y - 2 y^3 (1/3 + y^2/5 + ...).
                    let y = self / (2.0 + self);
                    let z = y * y;
                    let mut sum: $t = 0.0;
                    let mut k: i32 = $log_terms;
                    while k > 0 {
                        sum = sum * z + 1.0 / (2 * k + 1) as $t;
                        k -= 1;
                    }
                    y * (self - 2.0 * z * sum)
                } else {
                    self - self.ln_1p()
                }
            }
            #[inline]
            fn expm1mx(self) -> Self {
                if self > -1.0 && self < 1.0 {
                    // x^2/2 (1 + x/3 (1 + x/4 (...))).
                    let mut sum: $t = 1.0;
                    let mut k: i32 = $exp_terms;
                    while k > 2 {
                        sum = 1.0 + sum * self / k as $t;
                        k -= 1;
                    }
                    0.5 * self * self * sum
                } else {
                    self.exp_m1() - self
                }
            }
        }
    };
}
// Terms until the next one is below half a unit in the last place at the ends of the ranges (|y| <= 1/3, |x| <= 1).
remainder!(f32, 8, 11);
remainder!(f64, 17, 19);
