//! What the runs say about the paper's errors. Every judgement is a comparison of numbers, made here.

use super::chain::{Rounding, Stored, traction, way_error};
use super::document::{paper_reference, percent, signed_percent};
use super::experiments::{DAMPING, Experiment};
use super::paper::{ADD_FORCE, DENSITY, ELONGATION, LENGTH, ROWS, Row, TABLE_4_TOTAL, YOUNG, spread};
use super::runs::{DURATION, Measured, RAMP, Spec};
use super::series::{Series, wave_period};
use super::{Ours, Results};

/// The last section of the page.
pub fn conclusions(results: &Results) -> String {
    let parts = [
        shape(),
        ours(results),
        step(&results.cpu.rows),
        narrow(results),
        transient(results),
        dissipation(&results.cpu.rows),
        tolerance(results),
        positions(),
        verdict(results),
    ];
    parts.join("\n\n")
}

fn end(ours: &Ours) -> f64 {
    ours.measured.young.end / YOUNG - 1.0
}

fn mean(ours: &Ours) -> f64 {
    ours.measured.young.mean / YOUNG - 1.0
}

fn left(ours: &Ours) -> f64 {
    ours.measured.young.left / YOUNG
}

fn ends(experiment: &Experiment) -> Vec<f64> {
    experiment.runs.iter().map(|(_, _, measured)| measured.young.end / YOUNG - 1.0).collect()
}

/// Numbers in percent, with their signs.
fn list(errors: &[f64]) -> String {
    errors.iter().map(|&e| signed_percent(e)).collect::<Vec<_>>().join(", ")
}

fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().map(f64::abs).fold(0.0, f64::max)
}

/// Largest less smallest.
fn range(values: &[f64]) -> f64 {
    values.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b)) - values.iter().fold(f64::INFINITY, |a, &b| a.min(b))
}

/// Whether an effect is of the size of what it should explain: at least a third of it.
pub fn reaches(effect: f64, wanted: f64) -> bool {
    effect.abs() >= wanted.abs() / 3.0
}

/// Whether magnitudes grow from the last to the first: rows are in the order of growing steps.
pub fn grows_as_steps_shrink(errors: &[f64]) -> bool {
    errors.windows(2).all(|pair| pair[0].abs() > pair[1].abs())
}

fn yes(answer: bool) -> &'static str {
    if answer { "yes" } else { "no" }
}

/// Error x h of rows in 1e-6 s.
fn losses(rows: &[Row]) -> Vec<f64> {
    rows.iter().map(|row| row.error() * row.step * 1e6).collect()
}

fn words(values: &[f64]) -> String {
    values.iter().map(|v| format!("{v:+.2}")).collect::<Vec<_>>().join(", ")
}

fn shape() -> String {
    let (first, second) = (losses(&ROWS[..3]), losses(&ROWS[3..]));
    format!(
        "**The shape of the errors.** Error x h, in 1e-6 s and in the order of growing h: Table 1 {}; Table 2 {}. Table 2's \
         six lie within a factor of {:.1} of each other while h varies by a factor of {:.0}: the error is close to a constant \
         loss in every step. Table 1's first two agree within a factor of {:.2}, and its third does not fit. At the same \
         step the errors of Table 2 are {:.1}, {:.1} and {:.0} times those of Table 1.",
        words(&first),
        words(&second),
        spread(second.iter().copied()),
        ROWS[8].step / ROWS[3].step,
        spread(first[..2].iter().copied()),
        (second[0] / first[0]).abs(),
        (second[1] / first[1]).abs(),
        (second[2] / first[2]).abs()
    )
}

fn ours(results: &Results) -> String {
    let rows = &results.cpu.rows;
    let mut text = format!(
        "**Ours.** The mean over the hold errs by at most {} % in any row. Read at the end, Table 2's steps of 0.04 s and \
         more err by at most {} % (the paper: {} %), and steps of 0.0002 s and less by up to {} %: what still vibrates.",
        percent(largest(rows.iter().map(mean))),
        percent(largest(rows[6..].iter().map(end))),
        percent(largest(ROWS[6..].iter().map(Row::error))),
        percent(largest(rows[..6].iter().map(end)))
    );
    if let Ok(gpu) = &results.gpu {
        let apart = |of: &dyn Fn(&Ours) -> f64| largest(rows.iter().zip(&gpu.rows).map(|(a, b)| of(a) - of(b)));
        text += &format!(
            " The device's means differ from the CPU's by at most {} %, its last values by at most {} %.",
            percent(apart(&mean)),
            percent(apart(&end))
        );
    }
    text
}

/// What the means move by between the three smallest steps, with both schemes, and what Table 1 moves by.
fn step_moves(rows: &[Ours]) -> (f64, f64, f64) {
    let moved = |rows: &[Ours]| range(&rows.iter().map(mean).collect::<Vec<_>>());
    let wanted = range(&ROWS[..3].iter().map(Row::error).collect::<Vec<_>>());
    (moved(&rows[..3]), moved(&rows[3..6]), wanted)
}

fn step(rows: &[Ours]) -> String {
    let (explicit, implicit, wanted) = step_moves(rows);
    format!(
        "**The time step itself.** Between steps of 0.00005 and 0.0002 s the mean moves by {} % (semi-implicit) and {} % \
         (implicit); Table 1 moves by {} %. Enough: {}.",
        percent(explicit),
        percent(implicit),
        percent(wanted),
        yes(reaches(explicit.max(implicit), wanted))
    )
}

/// For runs of an experiment with one of the tables' schemes and steps: the row's place, and the last value's change.
fn changes(results: &Results, experiment: &Experiment) -> Vec<(usize, f64)> {
    let of = |(_, spec, measured): &(String, Spec, Measured)| {
        let place = ROWS.iter().position(|row| row.scheme == spec.scheme && row.step == spec.step)?;
        Some((place, measured.young.end / YOUNG - 1.0 - end(&results.cpu.rows[place])))
    };
    experiment.runs.iter().filter_map(of).collect()
}

/// Whether a change reaches its row's printed error anywhere.
fn any_reaches(changes: &[(usize, f64)]) -> bool {
    changes.iter().any(|&(place, change)| reaches(change, ROWS[place].error()))
}

/// Changes by a looser tolerance at small steps.
fn loosened(results: &Results) -> Vec<(usize, f64)> {
    changes(results, &results.experiments.tolerance).into_iter().filter(|c| ROWS[c.0].step < 0.01).collect()
}

fn narrow(results: &Results) -> String {
    let changes = changes(results, &results.experiments.precision);
    format!(
        "**f32 with stored displacements.** f64 changes the last value by {} % in the rows where it was tried (the paper's \
         errors there: {} %). Enough in any: {}.",
        list(&changes.iter().map(|c| c.1).collect::<Vec<_>>()),
        list(&changes.iter().map(|c| ROWS[c.0].error()).collect::<Vec<_>>()),
        yes(any_reaches(&changes))
    )
}

fn transient(results: &Results) -> String {
    let (rows, tried) = (&results.cpu.rows, &results.experiments);
    let speed = (YOUNG / DENSITY).sqrt();
    let bound = |ramp: f64| 2.0 * LENGTH / (speed * ramp);
    let mut ramps: Vec<(f64, f64)> =
        tried.ramp.runs.iter().map(|(_, spec, measured)| (spec.ramp, measured.young.amplitude / YOUNG)).collect();
    ramps.push((RAMP, rows[1].measured.young.amplitude / YOUNG));
    ramps.sort_by(|a, b| a.0.total_cmp(&b.0));
    let seen: Vec<String> =
        ramps.iter().map(|&(ramp, a)| format!("{ramp} s: {} % ({} %)", percent(a), percent(bound(ramp)))).collect();
    let explicit: Vec<f64> = rows[..3].iter().map(end).collect();
    let no_hold = ends(&tried.no_hold);
    let damped = ends(&tried.damping);
    format!(
        "**A transient, read at an instant.** A ramp's start and end send waves that nothing damps. Amplitude after ramps of \
         several lengths, and in brackets 2 L / (c ramp), where the two waves of a bar add up: {}. Such a reading errs by \
         anything up to the amplitude: enough for Table 1's {} %: {}. At one instant the three explicit steps read {} % \
         after the hold and {} % at the end of a ramp of {DURATION} s, so they differ by {} and {} % although their means \
         do not: presumably short waves, which the step shifts, pass at that instant. Does the error grow as h falls: after \
         the hold {}, without one {}. Sign and size come from the instant. Of the instants of the hold that the three steps \
         share: Table 1, {}; Table 2's three smallest steps, {}. With a damping of {DAMPING}/s the same rows read {} %: the \
         effect is the transient's, as nothing is left of it then.",
        seen.join(", "),
        percent(largest(ROWS[..3].iter().map(Row::error))),
        yes(reaches(rows[1].measured.young.amplitude / YOUNG, largest(ROWS[..3].iter().map(Row::error)))),
        list(&explicit),
        list(&no_hold[..3]),
        percent(range(&explicit)),
        percent(range(&no_hold[..3])),
        yes(grows_as_steps_shrink(&explicit)),
        yes(grows_as_steps_shrink(&no_hold[..3])),
        other_instants(&rows[..3], &ROWS[..3]),
        other_instants(&rows[3..6], &ROWS[3..6]),
        list(&damped)
    )
}

/// At how many of the instants that three steps share errors fall in the order of the paper's three and as widely, the
/// number of instants, and the closest to all three: its largest distance, and its errors.
fn instants(shared: &[[f64; 3]], paper: &[f64]) -> (usize, usize, f64, [f64; 3]) {
    let similar = |e: &&[f64; 3]| e[0] < e[1] && e[1] < e[2] && e[2] - e[0] >= paper[2] - paper[0];
    let distance = |e: &[f64; 3]| largest((0..3).map(|i| e[i] - paper[i]));
    let closest = shared.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or([f64::NAN; 3]);
    (shared.iter().filter(similar).count(), shared.len(), distance(&closest), closest)
}

/// What other instants of the hold would have given, for three rows.
fn other_instants(rows: &[Ours], paper: &[Row]) -> String {
    let at = |i: usize| rows[i].measured.series.every(paper[2].step, RAMP);
    let (first, second, third) = (at(0), at(1), at(2));
    let shared: Vec<[f64; 3]> = third
        .iter()
        .filter_map(|(k, &c)| Some([*first.get(k)?, *second.get(k)?, c].map(|young| young / YOUNG - 1.0)))
        .collect();
    let errors: Vec<f64> = paper.iter().map(Row::error).collect();
    let (similar, all, distance, closest) = instants(&shared, &errors);
    format!(
        "at {similar} of {all} ({:.1} %) the three errors are in the paper's order and as far apart; the closest instant \
         has {} % for the paper's {} %, {} % off",
        100.0 * similar as f64 / all as f64,
        list(&closest),
        list(&errors),
        percent(distance)
    )
}

fn dissipation(rows: &[Ours]) -> String {
    let frequency = std::f64::consts::TAU / wave_period();
    let rest: Vec<String> = [3, 4, 5]
        .map(|i| (-frequency * frequency * ROWS[i].step / 2.0 * (DURATION - RAMP)).exp())
        .map(percent)
        .to_vec();
    let (remaining, ratios) = remains(rows);
    let smaller = (0..3).all(|i| left(&rows[i + 3]) < left(&rows[i]));
    format!(
        "**Dissipation that depends on h.** Implicit Euler damps the first mode at a rate of omega^2 h / 2: {} % of it are left \
         at the end of the hold for the three smallest steps. Left of all modes together: {} %, against {} % with the \
         semi-implicit scheme. What is left of the implicit scheme's grows as h falls: {}; our last values, {} %, are \
         instants within it. The paper's errors in these three rows are {} times what is left, so they {} it, with a transient \
         that is so many times ours: a shorter ramp or hold. Two facts speak against: dissipation only takes away (less is left \
         than with the semi-implicit scheme in all three rows: {}), while the paper's implicit errors are the larger ones, \
         so its explicit readings would all have to fall near a zero of their wave; and at 0.04 s and more nothing of a \
         transient is left (ours err by at most {} %, the paper's by {} %).",
        rest.join(", "),
        rows[3..6].iter().map(|r| percent(left(r))).collect::<Vec<_>>().join(", "),
        rows[..3].iter().map(|r| percent(left(r))).collect::<Vec<_>>().join(", "),
        yes(grows_as_steps_shrink(&remaining)),
        list(&rows[3..6].iter().map(end).collect::<Vec<_>>()),
        ratios.iter().map(|r| format!("{r:.1}")).collect::<Vec<_>>().join(", "),
        if follows(&ratios) { "follow" } else { "do not follow" },
        yes(smaller),
        percent(largest(rows[6..].iter().map(end))),
        percent(largest(ROWS[6..].iter().map(Row::error)))
    )
}

/// What is left of the implicit transient in Table 2's three smallest steps, and the paper's errors over it.
fn remains(rows: &[Ours]) -> (Vec<f64>, Vec<f64>) {
    let remaining: Vec<f64> = rows[3..6].iter().map(left).collect();
    let ratios = remaining.iter().zip(&ROWS[3..6]).map(|(l, row)| row.error().abs() / l).collect();
    (remaining, ratios)
}

/// Whether ratios are nearly the same.
fn follows(ratios: &[f64]) -> bool {
    spread(ratios.iter().copied()) < 1.5
}

fn tolerance(results: &Results) -> String {
    let runs = &results.experiments.tolerance.runs;
    let small = loosened(results);
    let large: Vec<String> = runs
        .iter()
        .filter(|(_, spec, _)| spec.step > 0.01)
        .map(|(what, spec, measured)| {
            let read = signed_percent(measured.young.end / YOUNG - 1.0);
            format!("{what} at {} s: {read} % with {:.0} products", spec.step, measured.products)
        })
        .collect();
    let allowed: Vec<String> =
        ROWS[3..].iter().map(|row| format!("{:.0}", row.step_cost() / paper_reference())).collect();
    format!(
        "**Tolerance of conjugate gradients.** At small steps the matrix is nearly the mass: 1e-1 instead of 1e-6 changes \
         the last value by {} % (Table 2's errors there: {} %). Enough: {}. At large steps: {}. The explicit scheme, which has \
         no linear system, shows its error too. What stays open: a step of Table 2 cost as much as {} semi-implicit steps \
         (growing h), and Table 4 counts {:.1} times as long for tangent products as for forces, so the paper can hardly \
         have made more products than that in a step (a product costs no less than a force), where ours \
         makes {:.0} to {:.0} at 1e-6 and steps of 0.04 s and more.",
        list(&small.iter().map(|c| c.1).collect::<Vec<_>>()),
        list(&small.iter().map(|c| ROWS[c.0].error()).collect::<Vec<_>>()),
        yes(any_reaches(&small)),
        large.join("; "),
        allowed.join(", "),
        ADD_FORCE.1 / ADD_FORCE.0,
        results.cpu.rows[6..].iter().map(|r| r.measured.products).fold(f64::INFINITY, f64::min),
        largest(results.cpu.rows[6..].iter().map(|r| r.measured.products))
    )
}

/// The largest loss a second of ramp that rounding to nearest can make, as error x h in s.
fn most_by_rounding() -> f64 {
    0.5 * 4.0 * f64::from(f32::EPSILON) / ELONGATION
}

/// The ramp in s above which rounding to nearest could make the largest error x h of some rows.
pub fn ramp_needed(rows: &[Row]) -> f64 {
    largest(rows.iter().map(|row| row.error() * row.step)) / most_by_rounding()
}

fn positions() -> String {
    let mean = |series: &Series| series.hold(RAMP, wave_period()).mean / YOUNG - 1.0;
    let of = |stored| {
        let (nominal, _) = traction(ROWS[0].step, RAMP, DURATION, stored, Rounding::TowardsZero);
        mean(&nominal)
    };
    let (advanced, imposed) = (of(Stored::Position), of(Stored::PositionEndImposed));
    let lost: Vec<f64> = ROWS[..3].iter().map(|row| way_error(row.step, RAMP, Rounding::Nearest)).collect();
    format!(
        "**f32 with stored positions.** This loses the same in every step, and so has the shape of all of Table 2. The loss \
         is in the way of the moved end: in the chain at {} s, rounding towards zero makes {} % if the end is advanced by \
         x + h v, and {} % if it is put in its place; rounding within the beam does not add up, because forces undo it. To \
         nearest, the sign depends on step and ramp ({} % for our ramp at the three smallest steps). The size needs a ramp of \
         at least {:.1} s for Table 1 and {:.1} s for Table 2 (half of that towards zero), against the {:.1} s or so that \
         Table 4 suggests. It shows only if the strain is taken as 5 %, not as it resulted.",
        ROWS[0].step,
        signed_percent(advanced),
        signed_percent(imposed),
        list(&lost),
        ramp_needed(&ROWS[..3]),
        ramp_needed(&ROWS[3..]),
        1.0 / TABLE_4_TOTAL * ROWS[8].step
    )
}

fn verdict(results: &Results) -> String {
    let rows = &results.cpu.rows;
    let (_, ratios) = remains(rows);
    let amplitude = rows[1].measured.young.amplitude / YOUNG;
    let of_transient = if reaches(amplitude, largest(ROWS[..3].iter().map(Row::error))) {
        "reaches the size with our ramp, and makes readings depend on h where means do not; whether they fall in the paper's \
         order is a matter of the instant"
    } else {
        "does not reach the size with our ramp, but would with a shorter one"
    };
    let table_2 = if follows(&ratios) {
        "Table 2 up to 0.0002 s: both have the shape, and the printed numbers do not decide between them. The transient, \
         which implicit Euler damps the less the smaller h is, does not reach to the large steps. The rounding of the moved end \
         does, but loses the same with both schemes, and the paper's losses differ."
    } else {
        "Table 2 up to 0.0002 s: what dissipation leaves of our transient does not have the shape; the rounding of the moved \
         end has it, but loses the same with both schemes, and the paper's losses differ."
    };
    let roundings = [Rounding::Nearest, Rounding::TowardsZero];
    let rounded = largest(ROWS[6..].iter().flat_map(|row| {
        roundings.into_iter().flat_map(|r| [1.0, 2.0, 5.0].map(|ramps| way_error(row.step, ramps * RAMP, r)))
    }));
    let large = results.experiments.tolerance.runs.iter().filter(|(_, spec, _)| spec.step > 0.01);
    let loose: Vec<f64> = large.map(|(_, _, measured)| measured.young.end / YOUNG - 1.0).collect();
    let (explicit, implicit, wanted) = step_moves(rows);
    let judged = [
        ("the time step as such", reaches(explicit.max(implicit), wanted)),
        ("f32 with stored displacements", any_reaches(&changes(results, &results.experiments.precision))),
        ("the tolerance at small steps", any_reaches(&loosened(results))),
    ];
    let named = |holds: bool| {
        let names: Vec<&str> = judged.iter().filter(|j| j.1 == holds).map(|j| j.0).collect();
        if names.is_empty() { "none".to_string() } else { names.join(", ") }
    };
    format!(
        "**Verdict.** Table 1: two candidates. An undamped transient, read at an instant, {of_transient}. A moved end whose \
         f32 position is advanced by x + h v reaches it with a ramp of {:.1} s or more. {table_2} Table 2 from 0.04 s: errors of \
         {} %; such a rounding makes up to {} % there for ramps of {RAMP} to {:.1} s, the tolerances that were tried {} to {} \
         %: either may be it, neither is shown to be. Of the others, not large enough: {}; large enough somewhere: {}. What \
         is certain: neither scheme has such an error of its own. With stored displacements, the mean over the hold is Young's \
         modulus to {} % in every row of Table 1 and to {} % in every row of Table 2. So the tables do not show that the \
         implicit scheme is the more precise one: at equal steps its printed errors are the larger, and at large steps, \
         where ours reads the modulus to {} % at the end, it has damped the transient.",
        ramp_needed(&ROWS[..3]),
        list(&ROWS[6..].iter().map(Row::error).collect::<Vec<_>>()),
        percent(rounded),
        5.0 * RAMP,
        percent(loose.iter().fold(f64::INFINITY, |a, e| a.min(e.abs()))),
        percent(largest(loose)),
        named(false),
        named(true),
        percent(largest(rows[..3].iter().map(mean))),
        percent(largest(rows[3..].iter().map(mean))),
        percent(largest(rows[6..].iter().map(end)))
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn judgements_compare_as_they_say() {
        assert!(grows_as_steps_shrink(&[-3.0, 2.0, -1.0]) && !grows_as_steps_shrink(&[1.0, 2.0, 0.5]));
        assert!(reaches(-0.4, 1.2) && !reaches(0.39, -1.2));
        assert_eq!(range(&[-1.0, 2.0, 0.5]), 3.0);
    }

    #[test]
    fn instants_are_counted_and_the_closest_found() {
        // Two are alike; the others are too close together, or in another order.
        let alike = [[-3.0, -2.0, 1.0], [-1.0, -0.5, 0.0]];
        let others = [[-1.0, -0.8, -0.6], [1.0, 0.5, 0.0], [-1.0, -1.5, 0.5], [-1.0, 0.5, 0.4]];
        let shared = [&alike[..], &others[..]].concat();
        assert_eq!(instants(&shared, &[-1.0, -0.5, 0.0]), (2, 6, 0.0, [-1.0, -0.5, 0.0]));
    }

    #[test]
    fn rounding_needs_a_longer_ramp_for_table_2_than_for_table_1() {
        // Half a unit, 2.384e-7 m, of 0.25 m for each step; Table 2's largest error x h is 2.64e-6 s, at 0.04 s.
        assert!((ramp_needed(&ROWS[3..]) - 2.64e-6 * 0.25 / 2.384e-7).abs() < 1e-3, "{}", ramp_needed(&ROWS[3..]));
        assert!(ramp_needed(&ROWS[..3]) < 0.3 * ramp_needed(&ROWS[3..]));
    }
}
