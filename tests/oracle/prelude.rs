//! The law language over second-order dual numbers: what the generated oracle modules see.

use std::ops::{Add, Div, Mul, Neg, Range, Sub};

use tensormass_testing::codegen::ir::Number as _;
use tensormass_testing::rounding::Rounded;

#[path = "stretches.rs"]
mod stretches;

/// x + a e1 + b e2 + c e1 e2 with e1^2 = e2^2 = 0: value, two first derivatives, and the mixed second one.
#[derive(Clone, Copy)]
pub struct Number {
    pub x: Rounded,
    pub a: Rounded,
    pub b: Rounded,
    pub c: Rounded,
}

fn constant(x: Rounded) -> Number {
    let zero = Rounded::exact(0.0);
    Number { x, a: zero, b: zero, c: zero }
}

pub fn lit(x: f64) -> Number {
    constant(Rounded::nearest(x))
}

/// `i as f64`.
pub fn from_index(i: impl TryInto<i32>) -> Number {
    constant(Rounded::exact(f64::from(i.try_into().ok().expect("the law language's integers are small"))))
}

impl Number {
    fn chain(self, x: Rounded, first: Rounded, second: Rounded) -> Self {
        Self { x, a: first * self.a, b: first * self.b, c: first * self.c + second * self.a * self.b }
    }
    pub fn powi(self, n: i32) -> Self {
        let [m, k] = [n, n - 1].map(|n| Rounded::exact(f64::from(n)));
        match n {
            0 => lit(1.0),
            1 => self,
            _ => self.chain(self.x.powi(n), m * self.x.powi(n - 1), m * k * self.x.powi(n - 2)),
        }
    }
    /// The exponent depends on parameters alone.
    pub fn powf(self, r: Number) -> Self {
        let [one, two] = [1.0, 2.0].map(Rounded::exact);
        let power = |r: Rounded| self.x.powf(&r);
        self.chain(power(r.x), r.x * power(r.x - one), r.x * (r.x - one) * power(r.x - two))
    }
    pub fn ln(self) -> Self {
        let inverse = Rounded::exact(1.0) / self.x;
        self.chain(self.x.ln(), inverse, -(inverse * inverse))
    }
    pub fn exp(self) -> Self {
        let e = self.x.exp();
        self.chain(e, e, e)
    }
    pub fn sqrt(self) -> Self {
        let s = self.x.sqrt();
        let first = Rounded::exact(0.5) / s;
        self.chain(s, first, -(first * Rounded::exact(0.5) / self.x))
    }
}

impl Add for Number {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { x: self.x + o.x, a: self.a + o.a, b: self.b + o.b, c: self.c + o.c }
    }
}
impl Sub for Number {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self + -o
    }
}
impl Neg for Number {
    type Output = Self;
    fn neg(self) -> Self {
        Self { x: -self.x, a: -self.a, b: -self.b, c: -self.c }
    }
}
impl Mul for Number {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        let c = self.x * o.c + self.a * o.b + self.b * o.a + self.c * o.x;
        Self { x: self.x * o.x, a: self.x * o.a + self.a * o.x, b: self.x * o.b + self.b * o.x, c }
    }
}
impl Div for Number {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        self * o.powi(-1)
    }
}
impl PartialEq for Number {
    fn eq(&self, o: &Self) -> bool {
        self.x.value == o.x.value
    }
}
impl PartialOrd for Number {
    fn partial_cmp(&self, o: &Self) -> Option<std::cmp::Ordering> {
        self.x.value.partial_cmp(&o.x.value)
    }
}

/// A symmetric tensor, all nine components.
#[derive(Clone, Copy)]
pub struct Tensor(pub [Number; 9]);

impl Add for Tensor {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] + o.0[k]))
    }
}
impl Sub for Tensor {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self + -o
    }
}
impl Neg for Tensor {
    type Output = Self;
    fn neg(self) -> Self {
        Self(self.0.map(|x| -x))
    }
}
impl Mul<Number> for Tensor {
    type Output = Self;
    fn mul(self, s: Number) -> Self {
        Self(self.0.map(|x| x * s))
    }
}
impl Mul<Tensor> for Number {
    type Output = Tensor;
    fn mul(self, t: Tensor) -> Tensor {
        t * self
    }
}
impl Div<Number> for Tensor {
    type Output = Self;
    fn div(self, s: Number) -> Self {
        Self(self.0.map(|x| x / s))
    }
}

/// A unit vector.
#[derive(Clone, Copy)]
pub struct Direction(pub [Number; 3]);

/// a . T . b.
fn between(a: Direction, t: Tensor, b: Direction) -> Number {
    (1..9).fold(a.0[0] * t.0[0] * b.0[0], |sum, k| sum + a.0[k / 3] * t.0[k] * b.0[k % 3])
}

/// C^2, of a symmetric C.
fn square(c: Tensor) -> Tensor {
    let at = |i: usize, j: usize| c.0[3 * i + j];
    Tensor(std::array::from_fn(|k| {
        let (i, j) = (k / 3, k % 3);
        at(i, 0) * at(0, j) + at(i, 1) * at(1, j) + at(i, 2) * at(2, j)
    }))
}

#[derive(Clone, Copy)]
#[allow(non_snake_case)] // the names of the law language
pub struct Strain {
    pub eps: Tensor,
    pub E: Tensor,
    pub C: Tensor,
    pub I1: Number,
    pub I2: Number,
    pub I3: Number,
    pub J: Number,
    pub I1bar: Number,
    pub I2bar: Number,
}

impl Strain {
    pub fn of(g: [Number; 9]) -> Self {
        let half = lit(0.5);
        let f = Tensor(g) + identity();
        let at = |i: usize, j: usize| f.0[3 * i + j];
        let c = Tensor(std::array::from_fn(|k| {
            let (i, j) = (k / 3, k % 3);
            at(0, i) * at(0, j) + at(1, i) * at(1, j) + at(2, i) * at(2, j)
        }));
        let eps = Tensor(std::array::from_fn(|k| half * (g[k] + g[3 * (k % 3) + k / 3])));
        let (i1, j) = (tr(c), det(f));
        let i2 = half * (i1 * i1 - ddot(c, c));
        // |J|^(2/3), also where a law without a domain is asked about inverted states.
        let square = (j * j).powf(lit(1.0) / lit(3.0));
        let (i1bar, i2bar) = (i1 / square, i2 / (square * square));
        let e = (c - identity()) * half;
        Self { eps, E: e, C: c, I1: i1, I2: i2, I3: j * j, J: j, I1bar: i1bar, I2bar: i2bar }
    }
}

/// The rates of what [`Strain`] has.
#[derive(Clone, Copy)]
#[allow(non_snake_case)] // the names of the law language
pub struct StrainRate {
    /// The strain that changes.
    at: Strain,
    pub eps: Tensor,
    pub E: Tensor,
    pub C: Tensor,
    pub I1: Number,
    pub I2: Number,
    pub I3: Number,
    pub J: Number,
    pub I1bar: Number,
    pub I2bar: Number,
}

impl StrainRate {
    /// At G, where G changes by `rate`.
    pub fn of(g: [Number; 9], rate: [Number; 9]) -> Self {
        let (half, two, three) = (lit(0.5), lit(2.0), lit(3.0));
        let s = Strain::of(g);
        let (f, l) = (Tensor(g) + identity(), Tensor(rate));
        let at = |t: &Tensor, i: usize, j: usize| t.0[3 * i + j];
        let column = |i: usize, j: usize| {
            let term = |k: usize| at(&f, k, i) * at(&l, k, j) + at(&l, k, i) * at(&f, k, j);
            term(0) + term(1) + term(2)
        };
        let c = Tensor(std::array::from_fn(|k| column(k / 3, k % 3)));
        let i1 = tr(c);
        let i2 = s.I1 * i1 - ddot(s.C, c);
        // dJ/dt: the determinants with one row of F replaced by that of its rate.
        let row = |i: usize| det(Tensor(std::array::from_fn(|k| if k / 3 == i { l.0[k] } else { f.0[k] })));
        let j = row(0) + row(1) + row(2);
        let share = j / s.J;
        let square = (s.J * s.J).powf(lit(1.0) / three);
        let eps = Tensor(std::array::from_fn(|k| half * (rate[k] + rate[3 * (k % 3) + k / 3])));
        Self {
            at: s,
            eps,
            E: c * half,
            C: c,
            I1: i1,
            I2: i2,
            I3: two * s.J * j,
            J: j,
            I1bar: i1 / square - two / three * s.I1bar * share,
            I2bar: i2 / (square * square) - lit(4.0) / three * s.I2bar * share,
        }
    }
}

impl Strain {
    /// The sum of the principal stretches to a power that depends on parameters alone.
    pub fn stretch_sum(self, exponent: Number) -> Number {
        stretches::trace_of_power(self.C, exponent.x * Rounded::exact(0.5))
    }
}

#[allow(non_snake_case)] // the names of the law language
impl Strain {
    pub fn I4(self, a: Direction) -> Number {
        between(a, self.C, a)
    }
    pub fn I5(self, a: Direction) -> Number {
        between(a, square(self.C), a)
    }
    pub fn I8(self, a: Direction, b: Direction) -> Number {
        between(a, self.C, b)
    }
    pub fn I4bar(self, a: Direction) -> Number {
        self.I4(a) / self.I3.powf(lit(1.0) / lit(3.0))
    }
    pub fn I5bar(self, a: Direction) -> Number {
        self.I5(a) / self.I3.powf(lit(2.0) / lit(3.0))
    }
}

#[allow(non_snake_case)] // the names of the law language
impl StrainRate {
    /// The rate of the sum of the principal stretches to a power: part by part of the rate of C, in which it is linear.
    pub fn stretch_sum(self, exponent: Number) -> Number {
        let along = |part: fn(Number) -> Rounded| {
            let moving = |k: usize| Number { a: part(self.C.0[k]), ..constant(self.at.C.0[k].x) };
            stretches::trace_of_power(Tensor(std::array::from_fn(moving)), exponent.x * Rounded::exact(0.5)).a
        };
        Number { x: along(|n| n.x), a: along(|n| n.a), b: along(|n| n.b), c: along(|n| n.c) }
    }
    pub fn I4(self, a: Direction) -> Number {
        between(a, self.C, a)
    }
    pub fn I5(self, a: Direction) -> Number {
        // Of a . C^2 . a, with the symmetric C and its rate.
        let [c, rate] = [self.at.C, self.C]
            .map(|t| [0, 1, 2].map(|i| (0..3).map(|j| t.0[3 * i + j] * a.0[j]).reduce(|x, y| x + y)));
        (0..3).map(|i| lit(2.0) * c[i].expect("three") * rate[i].expect("three")).reduce(|x, y| x + y).expect("three")
    }
    pub fn I8(self, a: Direction, b: Direction) -> Number {
        between(a, self.C, b)
    }
    pub fn I4bar(self, a: Direction) -> Number {
        let share = self.I3 / self.at.I3;
        self.I4(a) / self.at.I3.powf(lit(1.0) / lit(3.0)) - share / lit(3.0) * self.at.I4bar(a)
    }
    pub fn I5bar(self, a: Direction) -> Number {
        let share = self.I3 / self.at.I3;
        self.I5(a) / self.at.I3.powf(lit(2.0) / lit(3.0)) - lit(2.0) * share / lit(3.0) * self.at.I5bar(a)
    }
}

pub fn identity() -> Tensor {
    Tensor(std::array::from_fn(|k| constant(Rounded::exact(if k % 4 == 0 { 1.0 } else { 0.0 }))))
}
pub fn tr(t: Tensor) -> Number {
    t.0[0] + t.0[4] + t.0[8]
}
pub fn ddot(a: Tensor, b: Tensor) -> Number {
    (1..9).fold(a.0[0] * b.0[0], |sum, k| sum + a.0[k] * b.0[k])
}
pub fn det(t: Tensor) -> Number {
    let t = t.0;
    t[0] * (t[4] * t[8] - t[5] * t[7]) + t[1] * (t[5] * t[6] - t[3] * t[8]) + t[2] * (t[3] * t[7] - t[4] * t[6])
}
pub fn ln(x: Number) -> Number {
    x.ln()
}
pub fn exp(x: Number) -> Number {
    x.exp()
}
pub fn sqrt(x: Number) -> Number {
    x.sqrt()
}
pub fn powi(x: Number, n: i32) -> Number {
    x.powi(n)
}
pub fn powf(x: Number, r: Number) -> Number {
    x.powf(r)
}
pub fn select(condition: bool, then: Number, otherwise: Number) -> Number {
    if condition { then } else { otherwise }
}
pub fn pos(x: Number) -> Number {
    select(x > lit(0.0), x, lit(0.0))
}
pub fn sum(range: Range<usize>, term: impl Fn(usize) -> Number) -> Number {
    range.map(term).reduce(|a, b| a + b).expect("the law language's sums have terms")
}
pub fn shear_modulus(young: Number, poisson: Number) -> Number {
    young / (lit(2.0) * (lit(1.0) + poisson))
}
pub fn lame_lambda(young: Number, poisson: Number) -> Number {
    young * poisson / ((lit(1.0) + poisson) * (lit(1.0) - lit(2.0) * poisson))
}
pub fn bulk_modulus(young: Number, poisson: Number) -> Number {
    young / (lit(3.0) * (lit(1.0) - lit(2.0) * poisson))
}
/// A parameter: it does not change with the state.
pub fn parameter(x: Rounded) -> Number {
    constant(x)
}
pub fn seeded(x: f64, a: f64, b: f64) -> Number {
    let [x, a, b] = [x, a, b].map(Rounded::exact);
    Number { a, b, ..constant(x) }
}
