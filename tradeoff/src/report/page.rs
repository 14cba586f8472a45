//! report.html: one page with the front, the recommendations and the diagrams.

use super::{Report, percent};

const STYLE: &str = "body{font:15px/1.5 sans-serif;max-width:60em;margin:2em auto;padding:0 1em}table{border-collapse:collapse}\
                     td,th{border-bottom:1px solid #ccc;padding:.2em .8em;text-align:left}td.n{text-align:right}\
                     code{background:#f3f3f3;padding:.1em .3em}svg{max-width:100%;height:auto}";

/// The page.
pub(super) fn html(report: &Report, diagrams: &[(String, String)]) -> String {
    let scene = escaped(&report.space.scene().path().display().to_string());
    let mut text = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Speed and accuracy of {scene}</title>\n\
         <style>{STYLE}</style></head><body>\n<h1>Speed and accuracy of {scene}</h1>\n<p>{}</p>\n<p>Reference: the scene with \
         <code>{}</code>. Errors are those of {}, relative to the greatest of the reference; times are medians of the steps alone, \
         on {} processors.</p>\n",
        escaped(&report.convergence()),
        escaped(&report.study.reference.changes.join(" ")),
        report.metric().name(),
        std::thread::available_parallelism().map_or(1, usize::from),
    );
    text += "<h2>Which setting for which error</h2>\n<table><tr><th>error</th><th>time</th><th>arguments of tensormass run</th></tr>\n";
    for (target, found) in report.recommended() {
        let (time, how) = found.map_or_else(
            || (String::new(), escaped(&report.why_not(target))),
            |m| (format!("{:.3} s", m.wall()), format!("<code>{}</code>", escaped(&report.typed(m)))),
        );
        text += &format!("<tr><td>{}</td><td class=\"n\">{time}</td><td>{how}</td></tr>\n", percent(target));
    }
    text += "</table>\n<h2>Settings that none beats</h2>\n<table><tr><th>time</th><th>error</th><th>evaluations</th><th>memory</th>\
             <th>setting</th></tr>\n";
    for m in report.front() {
        text += &format!(
            "<tr><td class=\"n\">{:.3} s</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{:.1} MB</td><td>{}</td></tr>\n",
            m.wall(),
            percent(m.errors.map_or(f64::NAN, |e| e.of(report.metric()))),
            m.evaluations,
            m.bytes as f64 / 1e6,
            escaped(&report.words(m))
        );
    }
    text += "</table>\n";
    for (name, svg) in diagrams {
        text += &format!("<h2>{}</h2>\n{svg}\n", escaped(name.trim_end_matches(".svg")));
    }
    text + "</body></html>\n"
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
