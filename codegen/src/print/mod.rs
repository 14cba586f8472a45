//! Printers: text from validated kernels, and expressions for the reader.

mod naming;
pub mod rust;
pub mod wgsl;

#[cfg(feature = "derive")]
pub(crate) fn expression(e: &crate::expr::Expr, quantities: &crate::quantity::Quantities) -> String {
    use crate::expr::Expr;
    let text = |e: &Expr| expression(e, quantities);
    let tight = |e: &Expr| match e {
        Expr::Number(q) if q.is_integer() && *q.numer() >= 0 => text(e),
        Expr::Symbol(_) | Expr::Ln(_) | Expr::Exp(_) | Expr::Log1p(_) | Expr::Expm1(_) => text(e),
        _ => format!("({})", text(e)),
    };
    match e {
        Expr::Number(q) => q.to_string(),
        Expr::Symbol(s) => quantities.get(*s).name.clone(),
        Expr::Sum(xs) => xs.iter().map(text).collect::<Vec<_>>().join(" + "),
        Expr::Product(xs) => xs
            .iter()
            .map(|x| if matches!(x, Expr::Sum(_) | Expr::Number(_)) { tight(x) } else { text(x) })
            .collect::<Vec<_>>()
            .join(" * "),
        Expr::Power(a, b) => format!("{}^{}", tight(a), tight(b)),
        Expr::Ln(a) => format!("ln({})", text(a)),
        Expr::Exp(a) => format!("exp({})", text(a)),
        Expr::Log1p(a) => format!("log1p({})", text(a)),
        Expr::Expm1(a) => format!("expm1({})", text(a)),
    }
}
