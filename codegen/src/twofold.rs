// Twofold numbers: unevaluated sums of two f64, with which a material's constants are computed before each is rounded
// once.
//
// Constants such as the Lame parameter of a nearly incompressible material cancel most of their digits, and no kernel
// gets them back. Algorithms of Joldes, Muller and Popescu (Tight and rigorous error bounds for basic building blocks of
// double-word arithmetic, ACM Trans. Math. Softw. 44, 2017), by their numbers there. This text is compiled twice: here,
// for the interpreter, and with the generated kernels, which it is printed beside. (No inner doc comment: it is
// included.)

/// high + low, where high is the sum rounded to f64.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Twofold {
    high: f64,
    low: f64,
}

impl Twofold {
    const LN_2: Self = Self { high: std::f64::consts::LN_2, low: 2.3190468138462996e-17 };

    /// The number nearest in f64.
    pub fn to_f64(self) -> f64 {
        self.high
    }

    /// a + b for |a| >= |b| (algorithm 1).
    fn fast_sum(a: f64, b: f64) -> Self {
        let high = a + b;
        // Infinities keep no remainder, which would be NaN.
        let low = if high.is_finite() { b - (high - a) } else { 0.0 };
        Self { high, low }
    }

    /// a + b, exactly (algorithm 2).
    fn sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let c = high - b;
        let low = if high.is_finite() { (a - c) + (b - (high - c)) } else { 0.0 };
        Self { high, low }
    }

    /// a b, exactly (algorithm 3).
    fn product(a: f64, b: f64) -> Self {
        let high = a * b;
        let low = if high.is_finite() { a.mul_add(b, -high) } else { 0.0 };
        Self { high, low }
    }

    /// x y for an f64 (algorithm 9).
    fn scaled(self, y: f64) -> Self {
        let c = Self::product(self.high, y);
        Self::fast_sum(c.high, self.low.mul_add(y, c.low))
    }

    /// 2^n x.
    fn times_power_of_two(self, n: i32) -> Self {
        // In two steps: 2^n alone may be out of range where the product is not.
        let half = n / 2;
        let (a, b) = (2f64.powi(half), 2f64.powi(n - half));
        Self { high: self.high * a * b, low: self.low * a * b }
    }

    /// Square root: that of the high part, corrected once.
    pub fn sqrt(self) -> Self {
        let root = self.high.sqrt();
        if root == 0.0 || !root.is_finite() {
            return root.into();
        }
        Self::fast_sum(root, (self - Self::product(root, root)).high / (2.0 * root))
    }

    /// Exponential: 2^n exp(r)^256 with |r| <= ln 2 / 512 by its series.
    pub fn exp(self) -> Self {
        if self.high.is_nan() || self.high.abs() >= 700.0 {
            return self.high.exp().into();
        }
        let n = (self.high / std::f64::consts::LN_2).round();
        let r = (self - Self::LN_2.scaled(n)).times_power_of_two(-8);
        // exp(r) - 1, of which no digit is lost beside 1: r (1 + r/2 (1 + r/3 (..))), the tenth term below 2^-106.
        let mut sum = Self::from(1.0);
        for k in (2..=10).rev() {
            sum = Self::from(1.0) + sum * r / Self::from(f64::from(k));
        }
        let mut less_one = sum * r;
        for _ in 0..8 {
            // (1 + x)^2 - 1 = 2 x + x^2.
            less_one = less_one.scaled(2.0) + less_one * less_one;
        }
        (less_one + Self::from(1.0)).times_power_of_two(n as i32)
    }

    /// Natural logarithm: that of the high part, corrected twice (Newton's method on exp).
    pub fn ln(self) -> Self {
        let mut y = Self::from(self.high.ln());
        if !y.high.is_finite() {
            return y;
        }
        for _ in 0..2 {
            y = y + (self * (-y).exp() - Self::from(1.0));
        }
        y
    }

    /// x to the power y, for x > 0.
    pub fn powf(self, y: Self) -> Self {
        (y * self.ln()).exp()
    }
}

impl From<f64> for Twofold {
    fn from(x: f64) -> Self {
        Self { high: x, low: 0.0 }
    }
}

impl std::ops::Neg for Twofold {
    type Output = Self;
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl std::ops::Add for Twofold {
    type Output = Self;
    /// Algorithm 6, within 3 u^2 of the sum (u is the unit round-off).
    fn add(self, y: Self) -> Self {
        let (s, t) = (Self::sum(self.high, y.high), Self::sum(self.low, y.low));
        let v = Self::fast_sum(s.high, s.low + t.high);
        Self::fast_sum(v.high, t.low + v.low)
    }
}

impl std::ops::Sub for Twofold {
    type Output = Self;
    fn sub(self, y: Self) -> Self {
        self + -y
    }
}

impl std::ops::Mul for Twofold {
    type Output = Self;
    /// Algorithm 12, within 4 u^2 of the product.
    fn mul(self, y: Self) -> Self {
        let c = Self::product(self.high, y.high);
        let low = self.low.mul_add(y.high, self.high.mul_add(y.low, self.low * y.low));
        Self::fast_sum(c.high, c.low + low)
    }
}

impl std::ops::Div for Twofold {
    type Output = Self;
    /// Algorithm 17, within 15 u^2 of the quotient.
    fn div(self, y: Self) -> Self {
        let high = self.high / y.high;
        if !high.is_finite() {
            return high.into();
        }
        let r = y.scaled(high);
        Self::fast_sum(high, ((self.high - r.high) + (self.low - r.low)) / y.high)
    }
}
