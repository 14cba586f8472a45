//! Functions that WGSL lacks or specifies too loosely for a derivative: logarithms, exponentials and powers in f32.
//!
//! The language's own `log` may be wrong by 2^-21 near 1, where the stress of a finite law needs every digit, and it has
//! neither `log1p` nor `expm1`. Errors stated in the texts are in units in the last place, for additions,
//! multiplications and divisions that round as IEEE 754 says; a device may round divisions worse (2.5 units). None
//! of them relies on infinities, NaN, subnormal numbers or on an operation not being fused or reordered: where digits
//! depend on the order of a sum, a bound that always holds (`clamp`, `max`) stands between its terms, because compilers
//! do add up constants and take out common factors otherwise.

/// A helper function; later ones may call earlier ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Helper {
    /// ln(1 + f) for f between -1/2 and 1.
    LogSeries,
    /// Natural logarithm.
    Ln,
    /// ln(1 + x).
    Log1p,
    /// The multiple of ln 2 nearest to a number.
    Octaves,
    /// exp(r) - 1 for |r| up to ln(2)/2.
    ExpSeries,
    /// Exponential.
    Exp,
    /// exp(x) - 1.
    Expm1,
    /// Power.
    Powf,
    /// x - ln(1 + x).
    Log1pmx,
    /// exp(x) - 1 - x.
    Expm1mx,
}

impl Helper {
    /// The helpers that its text calls.
    fn calls(self) -> &'static [Self] {
        match self {
            Self::LogSeries | Self::Octaves | Self::ExpSeries => &[],
            Self::Ln => &[Self::LogSeries],
            Self::Log1p => &[Self::LogSeries, Self::Ln],
            Self::Exp => &[Self::Octaves, Self::ExpSeries],
            Self::Expm1 => &[Self::Octaves, Self::ExpSeries, Self::Exp],
            Self::Powf => &[Self::Ln, Self::Exp],
            Self::Log1pmx => &[Self::Log1p],
            Self::Expm1mx => &[Self::Expm1],
        }
    }

    fn text(self) -> &'static str {
        match self {
            Self::LogSeries => LOG_SERIES,
            Self::Ln => LN,
            Self::Log1p => LOG1P,
            Self::Octaves => OCTAVES,
            Self::ExpSeries => EXP_SERIES,
            Self::Exp => EXP,
            Self::Expm1 => EXPM1,
            Self::Powf => POWF,
            Self::Log1pmx => LOG1PMX,
            Self::Expm1mx => EXPM1MX,
        }
    }
}

/// The texts of helpers and of what they call, each once.
pub fn texts(used: &[Helper]) -> String {
    let mut all = std::collections::BTreeSet::new();
    let mut waiting = used.to_vec();
    while let Some(helper) = waiting.pop() {
        if all.insert(helper) {
            waiting.extend(helper.calls());
        }
    }
    all.into_iter().map(|h| format!("\n{}", h.text())).collect()
}

/// The texts of all helpers (`ln_`, `log1p_`, `exp_`, `expm1_`, `powf_`, `log1pmx_`, `expm1mx_`) and of what they call, for
/// tests that measure them.
pub fn all() -> String {
    texts(&[Helper::Ln, Helper::Exp, Helper::Powf, Helper::Log1pmx, Helper::Expm1mx])
}

// ln(1 + f) = 2 atanh(y) with y = f / (2 + f), and 2 y = f - y f: what is small is subtracted from f itself, so that
// the errors of y hardly count.
const LOG_SERIES: &str = "\
// ln(1 + f) for -1/2 <= f <= 1, within 1.5 units in the last place: the odd series in y = f / (2 + f).
fn log_series_(f: f32) -> f32 {
    let y = f / (2.0f + f);
    let z = y * y;
    var s = fma(z, 0.13333333f, 0.15384615f);
    s = fma(z, s, 0.18181818f);
    s = fma(z, s, 0.22222222f);
    s = fma(z, s, 0.2857143f);
    s = fma(z, s, 0.4f);
    s = fma(z, s, 0.6666667f);
    return fma(-y, f - z * s, f);
}
";

const LN: &str = "\
// ln x for x > 0 (normal), within 2 units in the last place: x = m 2^k with m in [sqrt(1/2), sqrt(2)).
// Elsewhere some finite number: the margin of the law's domain tells.
fn ln_(x: f32) -> f32 {
    // 0x3f3504f3 is sqrt(1/2); the shift keeps the sign.
    let k = bitcast<i32>(bitcast<u32>(x) - 0x3f3504f3u) >> 23u;
    let m = bitcast<f32>(bitcast<u32>(x) - (bitcast<u32>(k) << 23u));
    // Within the bounds already: keeps a compiler from subtracting the 1 last.
    return fma(f32(k), 0.6931472f, log_series_(clamp(m - 1.0f, -0.5f, 0.5f)));
}
";

const LOG1P: &str = "\
// ln(1 + x) for x > -1, within 2 units in the last place.
fn log1p_(x: f32) -> f32 {
    if x > -0.5f && x < 1.0f {
        return log_series_(x);
    }
    return ln_(1.0f + x);
}
";

const OCTAVES: &str = "\
// The integer k nearest to x / ln 2, and x - k ln 2. The first part of ln 2 has 15 bits: its multiples are exact.
fn octaves_(x: f32) -> vec2<f32> {
    let k = round(x * 1.442695f);
    // Within the bounds already: keeps a compiler from adding up the two parts.
    let r = clamp(fma(k, -0.69314575f, x), -0.5f, 0.5f);
    return vec2<f32>(k, fma(k, -0.0000014286068f, r));
}
";

const EXP_SERIES: &str = "\
// exp(r) - 1 for |r| <= ln(2) / 2, within 1 unit in the last place.
fn exp_series_(r: f32) -> f32 {
    var s = fma(r, 0.000024801588f, 0.0001984127f);
    s = fma(r, s, 0.0013888889f);
    s = fma(r, s, 0.008333333f);
    s = fma(r, s, 0.041666667f);
    s = fma(r, s, 0.16666667f);
    s = fma(r, s, 0.5f);
    return fma(r * r, s, r);
}
";

const EXP: &str = "\
// exp x, within 2 units in the last place; at most the largest f32, and 0 where the result would not be normal.
fn exp_(x: f32) -> f32 {
    let t = octaves_(clamp(x, -88.0f, 88.72283f));
    let k = i32(t.x);
    // Two factors, because 2^128 is no f32.
    let half = k / 2;
    let a = bitcast<f32>(bitcast<u32>(half + 127) << 23u);
    let b = bitcast<f32>(bitcast<u32>(k - half + 127) << 23u);
    let y = (1.0f + exp_series_(t.y)) * a * b;
    return select(y, 0.0f, x < -87.33654f);
}
";

const EXPM1: &str = "\
// exp(x) - 1, within 3 units in the last place: 2^k (exp(r) - 1) + (2^k - 1).
fn expm1_(x: f32) -> f32 {
    if abs(x) > 17.0f {
        return exp_(x) - 1.0f;
    }
    let t = octaves_(x);
    let scale = bitcast<f32>(bitcast<u32>(i32(t.x) + 127) << 23u);
    // At least -1 already: keeps a compiler from subtracting the 1 last.
    return fma(scale, exp_series_(t.y), max(scale - 1.0f, -1.0f));
}
";

const LOG1PMX: &str = "\
// x - ln(1 + x) for x > -1, within 4 units in the last place: y (x - 2 y^2 (1/3 + y^2/5 + ..)), y = x / (2 + x).
fn log1pmx_(x: f32) -> f32 {
    if x > -0.5f && x < 1.0f {
        let y = x / (2.0f + x);
        let z = y * y;
        var s = fma(z, 0.05882353f, 0.06666667f);
        s = fma(z, s, 0.07692308f);
        s = fma(z, s, 0.09090909f);
        s = fma(z, s, 0.11111111f);
        s = fma(z, s, 0.14285715f);
        s = fma(z, s, 0.2f);
        s = fma(z, s, 0.33333334f);
        return y * fma(-2.0f * z, s, x);
    }
    return x - log1p_(x);
}
";

const EXPM1MX: &str = "\
// exp(x) - 1 - x, within 4 units in the last place: x^2 (1/2 + x/6 + ..) up to |x| = 1.
fn expm1mx_(x: f32) -> f32 {
    if x > -1.0f && x < 1.0f {
        var s = fma(x, 2.5052108e-08f, 2.755732e-07f);
        s = fma(x, s, 2.7557319e-06f);
        s = fma(x, s, 2.4801588e-05f);
        s = fma(x, s, 0.0001984127f);
        s = fma(x, s, 0.0013888889f);
        s = fma(x, s, 0.008333334f);
        s = fma(x, s, 0.041666668f);
        s = fma(x, s, 0.16666667f);
        s = fma(x, s, 0.5f);
        return x * x * s;
    }
    return expm1_(x) - x;
}
";

const POWF: &str = "\
// a to the power b for a > 0 (normal), within 3 + 5 |b ln a| units in the last place.
fn powf_(a: f32, b: f32) -> f32 {
    return exp_(b * ln_(a));
}
";
