//! The names that the law language offers, and "did you mean" for those that it does not.

/// What the `Strain` argument offers.
pub(super) const STRAIN: &[&str] = &["eps", "E", "C", "I1", "I2", "I3", "J", "I1bar", "I2bar"];

/// Methods of the `Strain` argument, as they are called.
pub(super) const STRAIN_METHODS: &[&str] = &["stretch_sum(a)"];
/// The strain's methods, as they are called: invariants with fibre directions.
pub(super) const FIBRE: &[&str] = &["I4(p.a)", "I5(p.a)", "I8(p.a, p.b)", "I4bar(p.a)", "I5bar(p.a)"];

/// Methods of a scalar, as they are called.
pub(super) const METHODS: &[&str] = &["powi(n)", "powf(a)", "ln()", "exp()", "sqrt()"];

/// Free functions, as they are called; the number of arguments is read off.
pub(super) const FUNCTIONS: &[&str] = &[
    "ln(x)",
    "exp(x)",
    "sqrt(x)",
    "powi(x, n)",
    "powf(x, a)",
    "pos(x)",
    "select(a > b, x, y)",
    "sum(0..N, |i| x)",
    "tr(A)",
    "ddot(A, B)",
    "det(A)",
    "identity()",
    "shear_modulus(E, nu)",
    "lame_lambda(E, nu)",
    "bulk_modulus(E, nu)",
];

/// `ln` of `ln(x)`.
pub(super) fn bare(usage: &str) -> &str {
    usage.split('(').next().unwrap_or_default()
}

/// Number of arguments of a usage: 2 for `powi(x, n)`.
pub(super) fn arity(usage: &str) -> usize {
    if usage.ends_with("()") { 0 } else { usage.matches(',').count() + 1 }
}

/// The usage of a built-in function, if there is one of that name.
pub(super) fn function(name: &str) -> Option<&'static str> {
    FUNCTIONS.iter().copied().find(|usage| bare(usage) == name)
}

/// The method of the strain of that name, as it is called.
pub(super) fn fibre_invariant(name: &str) -> Option<&'static str> {
    FIBRE.iter().copied().find(|usage| bare(usage) == name)
}

/// What to write for a name that means fibres; `None` if it does not.
pub(super) fn fibre_remedy(name: &str) -> Option<String> {
    let lower = name.to_ascii_lowercase();
    let numbered = lower.strip_prefix('i').and_then(|rest| rest.chars().next()).filter(|c| {
        ('4'..='8').contains(c) && lower.chars().skip(2).all(|c| c.is_ascii_digit() || c == '_' || "bar".contains(c))
    });
    let fibres = ["fibre", "fiber", "direction"].iter().any(|word| lower.contains(word));
    let all = || format!("declare a parameter `a: Direction` and call a method of the strain: {}", FIBRE.join(", "));
    match (fibre_invariant(name), numbered) {
        (Some(usage), _) => Some(format!("write `s.{usage}`, with a parameter `a: Direction`")),
        // The second family's numbers, in the usual counting.
        (None, Some('6')) => Some(String::from("write `s.I4(p.b)`, with the second family's direction `b: Direction`")),
        (None, Some('7')) => Some(String::from("write `s.I5(p.b)`, with the second family's direction `b: Direction`")),
        (None, Some(_)) => Some(all()),
        (None, None) => fibres.then(all),
    }
}

/// The remedy for a name of principal stretches that the language does not have: the one form that it has.
pub(super) fn stretch_remedy(name: &str) -> Option<&'static str> {
    name.to_ascii_lowercase()
        .contains("stretch")
        .then_some("write `s.stretch_sum(a)`, the sum of the principal stretches to the power a")
}

/// Names from elsewhere, with ours.
const ALIASES: &[(&str, &str)] = &[
    ("log", "ln"),
    ("pow", "powf"),
    ("max", "pos"),
    ("trace", "tr"),
    ("inner", "ddot"),
    ("dot", "ddot"),
    ("eye", "identity"),
];

/// "did you mean `x`? " for the nearest of `offered`, if one is near; then the list of all, after `intro`.
pub(super) fn suggest(name: &str, offered: &[&str], intro: &str) -> String {
    let distance =
        |usage: &str| strsim::damerau_levenshtein(&bare(usage).to_ascii_lowercase(), &name.to_ascii_lowercase());
    let nearest = offered.iter().copied().min_by_key(|usage| distance(usage));
    let list = if offered.is_empty() { String::from("nothing") } else { offered.join(", ") };
    let known = offered.iter().copied().find(|usage| ALIASES.contains(&(name, bare(usage))));
    match known.or(nearest.filter(|usage| distance(usage) <= name.len() / 3)) {
        Some(usage) => format!("did you mean `{}`? {intro} {list}", bare(usage)),
        None => format!("{intro} {list}"),
    }
}
