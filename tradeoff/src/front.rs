//! Settings that none beats, and the cheapest that is accurate enough.

use crate::experiment::Measured;
use crate::reference::Reference;
use crate::trajectory::Metric;

/// The settings than which none is both cheaper and more accurate, by ascending time.
pub fn front(measured: &[Measured], metric: Metric) -> Vec<&Measured> {
    let mut done: Vec<(&Measured, f64)> =
        measured.iter().filter_map(|m| Some((m, m.errors?.of(metric)))).filter(|(_, e)| e.is_finite()).collect();
    done.sort_by(|(a, x), (b, y)| a.wall().total_cmp(&b.wall()).then(x.total_cmp(y)));
    let mut least = f64::INFINITY;
    done.retain(|(_, error)| {
        let is_better = *error < least;
        least = least.min(*error);
        is_better
    });
    done.into_iter().map(|(m, _)| m).collect()
}

/// The cheapest setting measured that has at most this error, whatever the reference's uncertainty does to it: the two add up to
/// no more.
pub fn cheapest<'a>(
    measured: &'a [Measured],
    reference: &Reference,
    metric: Metric,
    target: f64,
) -> Option<&'a Measured> {
    let uncertainty = reference.uncertainty().of(metric);
    let fits = |m: &&Measured| m.errors.is_some_and(|e| e.of(metric) + uncertainty <= target);
    measured.iter().filter(fits).min_by(|a, b| a.wall().total_cmp(&b.wall()))
}
