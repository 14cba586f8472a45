//! `cargo xtask extremes`: runs the suite and writes its page.

use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use tensormass_stability::report::{counts, tables, words};
use tensormass_stability::{Choice, INTEGRATORS, Verdict};

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let (mut only, mut law, mut places, mut short) = (None, None, vec![], false);
    while let Some(argument) = arguments.next() {
        if argument == "--short" {
            short = true;
            continue;
        }
        match (argument.as_str(), arguments.next()) {
            ("--only", Some(title)) => only = Some(title),
            ("--law", Some(name)) => law = Some(name),
            ("--place", Some(name)) => places.push(name),
            (other, _) => {
                eprintln!("{other}: give --short, --only EXTREME, --law NAME, --place f64|f32|GPU");
                return ExitCode::from(2);
            }
        }
    }
    let mut choice = if short { Choice::short() } else { Choice::all() };
    choice.laws.retain(|l| law.as_ref().is_none_or(|name| l.info.name == *name));
    choice.questions.retain(|(e, _)| only.as_ref().is_none_or(|only| format!("{e:?}").eq_ignore_ascii_case(only)));
    choice.places.retain(|p| places.is_empty() || places.iter().any(|name| name == p.name));
    let (started, finished) = (Instant::now(), AtomicUsize::new(0));
    let cells = choice.run(&|cells| {
        let done = finished.fetch_add(1, Ordering::Relaxed) + 1;
        // Of a law that is not asked for there.
        let Some(first) = cells.first() else { return };
        eprintln!(
            "{done:4} {:5.0} s  {:?} {}, {}: {}",
            started.elapsed().as_secs_f64(),
            first.extreme,
            first.extreme.label(first.value),
            first.law,
            words(&counts(cells.iter().map(|c| &c.verdict)))
        );
    });
    print!("{}", tables(&choice, &cells));
    for cell in cells.iter().filter(|c| matches!(c.verdict, Verdict::Wrong(..))) {
        eprintln!(
            "wrong: {:?} {}, {}, {}, {}: {:?}",
            cell.extreme,
            cell.extreme.label(cell.value),
            cell.law,
            INTEGRATORS[cell.integrator].2,
            cell.place,
            cell.verdict
        );
    }
    eprintln!("{}", words(&counts(cells.iter().map(|c| &c.verdict))));
    if cells.iter().any(|c| matches!(c.verdict, Verdict::Wrong(..))) { ExitCode::from(3) } else { ExitCode::SUCCESS }
}
