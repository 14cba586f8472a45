//! The short suite of extremes: nothing is wrong, and what is right, told, stopped and refused is about what it was; broken runs are
//! found.

use tensormass_stability::report::{counts, tables};
use tensormass_stability::{Choice, Extreme, INTEGRATORS, Verdict};

#[test]
fn nothing_is_wrong_at_the_extremes() {
    let choice = Choice::short();
    assert!(choice.laws.len() >= 4, "laws of each kind: {}", choice.laws.len());
    let cells = choice.run(&|_| {});
    let wrong: Vec<String> = cells
        .iter()
        .filter(|cell| matches!(cell.verdict, Verdict::Wrong(..) | Verdict::Unfinished))
        .map(|cell| {
            let (value, by) = (cell.extreme.label(cell.value), INTEGRATORS[cell.integrator].2);
            format!("{:?} {value}, {}, {by}, {}: {:?}", cell.extreme, cell.law, cell.place, cell.verdict)
        })
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    // Most come to their end and are right; bodies do blow up and are refused at the extremes.
    let [right, other, told, stopped, refused, _, unjudged, _] = counts(cells.iter().map(|c| &c.verdict));
    eprintln!(
        "{right} right, {other} others, {told} told, {stopped} stopped, {refused} refused, {unjudged} not judged"
    );
    assert!(right > 3 * cells.len() / 4, "{right} of {} are right", cells.len());
    assert!(told > 0 && stopped > 0 && refused > 0);
    assert!(unjudged < cells.len() / 50, "{unjudged} of {} cannot be judged", cells.len());
    // Explicit steps beyond the critical one end with a reason, each of them.
    let beyond = cells.iter().filter(|c| c.extreme == Extreme::Step && c.value > 1.5 && c.integrator > 2);
    assert!(beyond.clone().count() > 0 && beyond.clone().all(|c| matches!(c.verdict, Verdict::Stopped(_))));
    let page = tables(&choice, &cells);
    assert_eq!(page.matches("\n## ").count(), Extreme::ALL.len());
}
