//! Which setting to run next: the scene's own, then one axis at a time, then what is one choice away from the front, cheap ones
//! first; and how long it may take. What takes longer than most is stopped, and only run to its end when nothing cheaper is left.

use crate::experiment::{Measured, Status};
use crate::front::front;
use crate::space::{Axis, Setting, Space};
use crate::trajectory::Metric;

/// A mesh with twice as many cells each way takes at least so many times as long, in implicit and in explicit steps.
const FINER: [f64; 2] = [8.0, 14.0];

/// The part of the longest time that settings have at first.
const AT_FIRST: f64 = 1.0 / 6.0;
/// A setting that was stopped is run again where it may take so many times as long.
const AGAIN: f64 = 2.0;

/// The next setting, and how many seconds it may take; none where all that could pay have been run.
pub(crate) fn next(space: &Space, measured: &[Measured], metric: Metric, longest: f64) -> Option<(Setting, f64)> {
    let base = space.base();
    if !measured.iter().any(|m| m.setting == base) {
        return Some((base, longest));
    }
    [AT_FIRST * longest, longest].into_iter().find_map(|limit| Some((within(space, measured, metric, limit)?, limit)))
}

/// The next setting of those that may take no longer than a limit.
fn within(space: &Space, measured: &[Measured], metric: Metric, limit: f64) -> Option<Setting> {
    let is_open = |setting: &Setting| {
        let found = measured.iter().find(|m| m.setting == *setting);
        space.allows(setting)
            && found.is_none_or(|m| m.status == Status::TooSlow && AGAIN * m.wall() <= limit)
            && predicted(space, setting, measured) <= limit
    };
    let base = space.base();
    // The nearest choices of each axis first, an axis after the other.
    let reach = Axis::ALL.iter().map(|axis| space.choices(*axis).len()).max().unwrap_or(1);
    for distance in 1..reach {
        for axis in Axis::ALL {
            let found = beside(space, &base, axis, distance).into_iter().find(&is_open);
            if found.is_some() {
                return found;
            }
        }
    }
    // What is cheap first: many such settings take no longer than one that is dear.
    let members = front(measured, metric);
    let beside = members.iter().flat_map(|member| {
        let other = move |axis: Axis| (0..space.choices(axis).len()).map(move |k| member.setting.with(axis, k));
        Axis::ALL.into_iter().flat_map(other)
    });
    let open = beside.filter(&is_open).map(|setting| (expected(space, &setting, measured), setting));
    open.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, setting)| setting)
}

/// A time in s that a setting may take, if what each choice does to the time of the scene's own setting it does to all; what is not
/// known of a choice is taken to do nothing.
fn expected(space: &Space, setting: &Setting, measured: &[Measured]) -> f64 {
    let base = space.base();
    let time = |setting: &Setting| measured.iter().find(|m| m.setting == *setting).map(Measured::wall);
    let whole = time(&base).unwrap_or(1.0);
    let choices = setting.differs(&base).into_iter();
    choices.fold(whole, |t, axis| t * time(&base.with(axis, setting.on(axis))).map_or(1.0, |alone| alone / whole))
}

/// The settings that are so many choices away on an axis.
fn beside(space: &Space, setting: &Setting, axis: Axis, distance: usize) -> Vec<Setting> {
    let (at, count) = (setting.on(axis), space.choices(axis).len());
    let below = at.checked_sub(distance);
    let above = Some(at + distance).filter(|k| *k < count);
    below.into_iter().chain(above).map(|k| setting.with(axis, k)).collect()
}

/// A time in s that a setting takes at least, as far as its coarser meshes tell.
fn predicted(space: &Space, setting: &Setting, measured: &[Measured]) -> f64 {
    let finer = FINER[usize::from(space.integrator(setting).is_explicit())];
    let mesh = setting.on(Axis::Mesh);
    let coarser = (0..mesh).filter_map(|k| {
        let coarse = setting.with(Axis::Mesh, k);
        let found = measured.iter().find(|m| m.setting == coarse)?;
        Some(found.wall() * finer.powi((mesh - k) as i32))
    });
    coarser.fold(0.0, f64::max)
}
