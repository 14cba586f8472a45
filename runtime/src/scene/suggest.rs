//! "Did you mean": the known name nearest to a mistyped one.

/// The nearest of the known names, if it is near enough to be what was meant; the first of equals.
pub(super) fn nearest<'k>(wrong: &str, known: impl IntoIterator<Item = &'k str>) -> Option<&'k str> {
    let wrong = wrong.to_lowercase();
    let mut best: Option<(usize, &str)> = None;
    for name in known {
        let distance = strsim::osa_distance(&wrong, &name.to_lowercase());
        if distance <= name.chars().count().max(2) / 3 + 1 && best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, name));
        }
    }
    best.map(|(_, name)| name).filter(|name| wrong.chars().next().is_some() && shares_a_letter(&wrong, name))
}

fn shares_a_letter(a: &str, b: &str) -> bool {
    a.chars().any(|c| b.to_lowercase().contains(c))
}
