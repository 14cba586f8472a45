//! Work-precision diagrams: error over time, and over evaluations, logarithmic both, with the choices of an axis in colours.

use plotters::prelude::*;

use super::Report;
use crate::experiment::Measured;
use crate::space::Axis;

const SIZE: (u32, u32) = (860, 520);
const FONT: &str = "sans-serif";
/// What is not of an axis.
const GREY: RGBColor = RGBColor(190, 190, 190);

/// All diagrams with their file names: one an axis that has choices, and one of evaluations.
pub(super) fn all(report: &Report) -> Vec<(String, String)> {
    let with_choices = Axis::ALL.into_iter().filter(|axis| report.space.choices(*axis).len() > 1);
    let mut diagrams: Vec<(String, String)> = with_choices
        .filter_map(|axis| {
            Some((format!("time-by-{}.svg", axis.name()), draw(report, axis, &|m| m.wall(), "time, s")?))
        })
        .collect();
    let evaluations = |m: &Measured| m.kernels as f64;
    let of_work = draw(report, Axis::Integrator, &evaluations, "elements times force evaluations and products");
    diagrams.extend(of_work.map(|svg| ("evaluations-by-integrator.svg".to_string(), svg)));
    diagrams
}

/// A diagram in which an axis's choices have colours; none where nothing was measured.
fn draw(report: &Report, axis: Axis, cost: &dyn Fn(&Measured) -> f64, what: &str) -> Option<String> {
    let metric = report.metric();
    let place = |m: &Measured| {
        let error = m.errors?.of(metric);
        let cost = cost(m);
        (cost > 0.0 && cost.is_finite() && error > 0.0 && error < 1e6).then_some((cost, error))
    };
    let all: Vec<(&Measured, (f64, f64))> = report.study.measured.iter().filter_map(|m| Some((m, place(m)?))).collect();
    let bounds = |of: &dyn Fn(&(f64, f64)) -> f64| {
        let values = all.iter().map(|(_, p)| of(p));
        let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(l, h), x| (l.min(x), h.max(x)));
        0.6 * low..1.8 * high
    };
    if all.is_empty() {
        return None;
    }
    let (costs, errors) = (bounds(&|p| p.0), bounds(&|p| p.1));
    let mut text = String::new();
    let drawn = || -> Result<(), Box<dyn std::error::Error>> {
        let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .margin(12)
            .caption(
                format!("error of {} by {}; rings: the scene but for this choice", metric.name(), axis.name()),
                (FONT, 18),
            )
            .x_label_area_size(46)
            .y_label_area_size(74)
            .build_cartesian_2d(costs.log_scale(), errors.log_scale())?;
        let number = |x: &f64| format!("{x:.0e}").replace("e0", "");
        chart
            .configure_mesh()
            .x_desc(what)
            .y_desc("relative error")
            .x_label_formatter(&number)
            .y_label_formatter(&number)
            .label_style((FONT, 13))
            .axis_desc_style((FONT, 15))
            .light_line_style(RGBColor(238, 238, 238))
            .draw()?;
        chart.draw_series(all.iter().map(|(_, p)| Circle::new(*p, 2, GREY.filled())))?;
        let front: Vec<(f64, f64)> = report.front().into_iter().filter_map(place).collect();
        chart
            .draw_series(LineSeries::new(front, GREY.stroke_width(1)))?
            .label("front")
            .legend(|(x, y)| PathElement::new([(x, y), (x + 16, y)], GREY.stroke_width(1)));
        for (k, choice) in report.space.choices(axis).iter().enumerate() {
            let colour = Palette99::pick(k).to_rgba();
            let of: Vec<(f64, f64)> = all.iter().filter(|(m, _)| m.setting.on(axis) == k).map(|(_, p)| *p).collect();
            let is_alone = |m: &Measured| m.setting.differs(&report.space.base()).iter().all(|other| *other == axis);
            let alone: Vec<(f64, f64)> =
                all.iter().filter(|(m, _)| m.setting.on(axis) == k && is_alone(m)).map(|(_, p)| *p).collect();
            chart
                .draw_series(of.into_iter().map(|p| Circle::new(p, 4, colour.filled())))?
                .label(choice.name.clone())
                .legend(move |(x, y)| Circle::new((x + 8, y), 4, colour.filled()));
            // The scene's own setting but for this choice.
            chart.draw_series(alone.into_iter().map(|p| Circle::new(p, 8, colour.stroke_width(2))))?;
        }
        chart
            .configure_series_labels()
            .label_font((FONT, 13))
            .background_style(WHITE.mix(0.85))
            .border_style(RGBColor(220, 220, 220))
            .position(SeriesLabelPosition::UpperRight)
            .draw()?;
        area.present()?;
        Ok(())
    };
    drawn().ok()?;
    Some(text)
}
