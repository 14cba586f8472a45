//! The page of the suite: a table an extreme, and what is behind its cells.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use crate::suite::{Cell, Choice, INTEGRATORS};
use crate::verdict::Verdict;

/// The tables of all cells.
pub fn tables(choice: &Choice, cells: &[Cell]) -> String {
    let mut text = String::new();
    for (extreme, values) in &choice.questions {
        let of: Vec<&Cell> = cells.iter().filter(|c| c.extreme == *extreme).collect();
        let [title, what] = extreme.about();
        let _ = write!(text, "\n## {title}\n\n{what}\n\n| |");
        let columns: Vec<(usize, &str)> = (0..INTEGRATORS.len())
            .filter(|k| extreme.asks(INTEGRATORS[*k].0))
            .flat_map(|k| choice.places.iter().map(move |p| (k, p.name)))
            .collect();
        for (k, place) in &columns {
            let _ = write!(text, " {}, {place} |", INTEGRATORS[*k].2);
        }
        let _ = write!(text, "\n|---|{}\n", "---|".repeat(columns.len()));
        for value in values {
            let _ = write!(text, "| {} |", extreme.label(*value));
            for (k, place) in &columns {
                let here = of.iter().filter(|c| c.value == *value && c.integrator == *k && c.place == *place);
                let verdicts: Vec<&Verdict> = here.map(|c| &c.verdict).collect();
                let _ = write!(text, " {} |", summary(&verdicts));
            }
            text += "\n";
        }
        text += &details(&of);
    }
    text
}

/// Kinds of outcomes, in the order of reports.
const KINDS: [&str; 8] =
    ["right", "another solution", "told", "stopped", "refused", "unfinished", "not judged", "wrong"];

fn kind(verdict: &Verdict) -> usize {
    match verdict {
        Verdict::Right(_) => 0,
        Verdict::Other(_) => 1,
        Verdict::Told(..) => 2,
        Verdict::Stopped(_) => 3,
        Verdict::Refused(_) => 4,
        Verdict::Unfinished => 5,
        Verdict::Unjudged(_) => 6,
        Verdict::Wrong(..) => 7,
    }
}

/// How many laws came to which kind of outcome.
pub fn counts<'a>(verdicts: impl IntoIterator<Item = &'a Verdict>) -> [usize; 8] {
    let mut counts = [0; 8];
    verdicts.into_iter().for_each(|v| counts[kind(v)] += 1);
    counts
}

/// Counts in words.
pub fn words(counts: &[usize; 8]) -> String {
    let some = KINDS.iter().zip(counts).filter(|(_, n)| **n > 0);
    some.map(|(kind, n)| format!("{n} {kind}")).collect::<Vec<_>>().join(", ")
}

fn summary(verdicts: &[&Verdict]) -> String {
    let worst = verdicts.iter().filter_map(|v| if let Verdict::Right(e) = v { Some(*e) } else { None });
    let worst = worst.fold(None, |worst: Option<f64>, e| Some(worst.map_or(e, |w| w.max(e))));
    let counts = counts(verdicts.iter().copied());
    let mut parts = vec![];
    for (k, (name, count)) in KINDS.iter().zip(counts).enumerate() {
        match (k, count) {
            (_, 0) => {}
            (0, n) if n == verdicts.len() => parts.push(format!("{:.0e}", worst.unwrap_or(0.0))),
            (0, n) => parts.push(format!("{n}: {:.0e}", worst.unwrap_or(0.0))),
            (7, n) => parts.push(format!("**{n} {name}**")),
            (_, n) => parts.push(format!("{n} {name}")),
        }
    }
    parts.join(", ")
}

/// The reasons behind what is not right, each with where it was given.
fn details(cells: &[&Cell]) -> String {
    let mut found: BTreeMap<(usize, String), Vec<&Cell>> = BTreeMap::new();
    for cell in cells {
        let reason = match &cell.verdict {
            Verdict::Right(_) | Verdict::Other(_) => continue,
            Verdict::Told(_, why)
            | Verdict::Stopped(why)
            | Verdict::Refused(why)
            | Verdict::Unjudged(why)
            | Verdict::Wrong(_, why) => without_numbers(why),
            Verdict::Unfinished => String::new(),
        };
        found.entry((kind(&cell.verdict), reason)).or_default().push(cell);
    }
    let mut text = String::new();
    for ((kind, reason), cells) in &found {
        let mut laws: Vec<&str> = cells.iter().map(|c| c.law).collect();
        laws.sort_unstable();
        laws.dedup();
        let mut values: Vec<String> = vec![];
        for cell in cells {
            let label = cell.extreme.label(cell.value);
            if !values.contains(&label) {
                values.push(label);
            }
        }
        let off = cells.iter().filter_map(|c| match &c.verdict {
            Verdict::Told(off, _) | Verdict::Wrong(off, _) => Some(*off),
            _ => None,
        });
        let off = off.reduce(f64::max).map_or(String::new(), |off| format!(", off by up to {off:.0e}"));
        let reason = if reason.is_empty() { off } else { format!("{off}: {reason}") };
        let _ =
            write!(text, "\n- {} {} ({}; {}){reason}", cells.len(), KINDS[*kind], values.join(", "), laws.join(", "));
    }
    if text.is_empty() { text } else { text + "\n" }
}

/// A message whose numbers do not tell it from others.
fn without_numbers(text: &str) -> String {
    let mut out = String::new();
    let mut in_number = false;
    for word in text.split(' ') {
        let is_number = word.chars().next().is_some_and(|c| c.is_ascii_digit() || (c == '-' && word.len() > 1));
        if is_number {
            if !in_number {
                out += "# ";
            }
        } else {
            out += word;
            out.push(' ');
        }
        in_number = is_number;
    }
    out.trim_end().to_string()
}
