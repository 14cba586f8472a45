//! Contact forces for records: impulses over the time since the last record of the same kind.

use crate::backend::{Backend, ForceField};
use crate::system::System;

/// Impulses that one kind of record has not seen yet, in scaled units.
#[derive(Debug, Clone, Default)]
struct Pending {
    impulses: Vec<[f64; 3]>,
    /// When the last record was.
    since: f64,
}

/// What a checkpoint keeps of impulses: those on the device, those pending for probes and for frames; and when each of these
/// was last recorded.
pub(super) type Kept<T> = ([T; 3], [f64; 2]);

/// A kind of record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Record {
    /// Probes.
    Probes = 0,
    /// Frames.
    Frames = 1,
}

/// What contact has done since the last records.
#[derive(Debug, Default)]
pub(super) struct Impulses([Pending; 2]);

impl Impulses {
    /// What a checkpoint keeps.
    pub(super) fn kept<B: Backend, F: ForceField<B>>(&self, system: &System<B, F>) -> Option<Kept<Vec<[f64; 3]>>> {
        let touch = system.touch.as_ref().filter(|touch| touch.is_recorded)?;
        let still = || vec![[0.0; 3]; system.body.masses.len()];
        let impulse = touch.impulse.as_ref().map_or_else(still, |impulse| system.backend.download(impulse));
        let pending = |k: usize| {
            let mut impulses = self.0[k].impulses.clone();
            impulses.resize(system.body.masses.len(), [0.0; 3]);
            impulses
        };
        Some(([impulse, pending(0), pending(1)], [self.0[0].since, self.0[1].since]))
    }

    /// Goes on with what a checkpoint kept, or from a time on where it kept nothing.
    pub(super) fn resume<B: Backend, F: ForceField<B>>(
        &mut self,
        system: &mut System<B, F>,
        kept: Option<Kept<&[[f64; 3]]>>,
        time: f64,
    ) {
        let Some(([device, probes, frames], since)) = kept else {
            self.0.iter_mut().for_each(|pending| pending.since = time);
            return;
        };
        for (pending, (impulses, since)) in self.0.iter_mut().zip([(probes, since[0]), (frames, since[1])]) {
            *pending = Pending { impulses: impulses.to_vec(), since };
        }
        system.add_impulses(device);
    }

    /// The mean contact force on each node since the last record of a kind, in scaled units; 0 at the beginning.
    pub(super) fn forces<B: Backend, F: ForceField<B>>(
        &mut self,
        system: &mut System<B, F>,
        of: Record,
        time: f64,
    ) -> Vec<[f64; 3]> {
        let nodes = system.body.masses.len();
        if let Some(impulse) = system.touch.as_mut().and_then(|touch| touch.impulse.as_mut()) {
            let new = system.backend.download(impulse);
            system.backend.clear(impulse);
            for pending in &mut self.0 {
                pending.impulses.resize(nodes, [0.0; 3]);
                pending.impulses.iter_mut().zip(&new).for_each(|(sum, new)| (0..3).for_each(|i| sum[i] += new[i]));
            }
        }
        let Pending { mut impulses, since } = std::mem::take(&mut self.0[of as usize]);
        self.0[of as usize].since = time;
        impulses.resize(nodes, [0.0; 3]);
        let per = if time > since { 1.0 / (time - since) } else { 0.0 };
        impulses.into_iter().map(|x| x.map(|x| x * per)).collect()
    }
}
