//! Vector arithmetic on the CPU: parallel over fixed blocks of nodes, so that sums do not depend on the thread count.

use rayon::prelude::*;

use super::Precision;
use super::contact::CpuContact;
use super::pressure::CpuPressure;
use crate::backend::{ALPHA, Advance, BETA, Backend, Counts, Descent, Meeting, REGISTERS, RUNNING, SUM, Update};
use crate::body::{Body, Constraint, PressedFace};
use crate::contact::{Contact, Held, Passage};
use crate::device::DeviceError;
use crate::inventory::names::{CONSTRAINED, MASS_MATRIX, PLACES, VECTORS};
use crate::inventory::{Lease, Ledger};
use crate::mass::MassMatrix;
use crate::order::{node_places, placed_constraints};

/// Nodes a block: a block's partial sum is formed by one thread, blocks are added in order.
pub(super) const BLOCK: usize = 1024;

/// x . y of a block of nodes. The products of two f32 are exact in f64: a dot product's rounding does not limit a solver in
/// f32.
pub(super) fn exact_dot<R: Precision>(x: &[[R; 3]], y: &[[R; 3]]) -> f64 {
    // Numbers that are eight apart are summed first: one addition need not wait for another.
    const APART: usize = 8;
    let (x, y) = (x.as_flattened().chunks(APART), y.as_flattened().chunks(APART));
    let mut sums = [0.0; APART];
    for (x, y) in x.zip(y) {
        for ((sum, x), y) in sums.iter_mut().zip(x).zip(y) {
            *sum += x.to_f64() * y.to_f64();
        }
    }
    sums.iter().sum()
}

/// A mass matrix in memory, in compressed rows.
#[derive(Debug)]
pub struct CpuMatrix<R> {
    offsets: Vec<u32>,
    columns: Vec<u32>,
    values: Vec<R>,
    _lease: Lease,
}

/// A vector in memory, in the backend's order of nodes.
#[derive(Debug)]
pub struct CpuVector<R>(pub(super) Vec<[R; 3]>, Lease);

impl<R: Precision> CpuVector<R> {
    /// Zeros at so many nodes.
    pub(super) fn zeros(nodes: usize, ledger: &Ledger) -> Self {
        let numbers = vec![[R::default(); 3]; nodes];
        let lease = ledger.hold(VECTORS, size_of_val(&*numbers));
        Self(numbers, lease)
    }
}

impl<R: Clone> Clone for CpuVector<R> {
    fn clone(&self) -> Self {
        Self(self.0.clone(), self.1.clone())
    }
}

/// Vectors in memory. Nodes are ordered as the clusters of the body meet them, so that those of a cluster are together.
#[derive(Debug)]
pub struct CpuBackend<R> {
    /// Where each node of the body is.
    places: Vec<u32>,
    /// By places, ascending.
    constraints: Vec<Constraint>,
    /// Nodes on obstacles: their places and normals, and whether they stick.
    held: Vec<(usize, [f64; 3], bool)>,
    ledger: Ledger,
    _leases: [Lease; 2],
    precision: std::marker::PhantomData<R>,
}

impl<R: Precision> CpuBackend<R> {
    /// A backend for a body.
    pub fn new(body: &Body) -> Self {
        let places = node_places(body);
        let constraints = placed_constraints(body, &places);
        let ledger = Ledger::default();
        let leases = [ledger.hold(PLACES, size_of_val(&*places)), ledger.hold(CONSTRAINED, size_of_val(&*constraints))];
        Self { places, constraints, held: vec![], ledger, _leases: leases, precision: std::marker::PhantomData }
    }

    /// Where each node of the body is in a vector.
    pub(super) fn places(&self) -> &[u32] {
        &self.places
    }

    /// The imposed components of a block's nodes: the node's place in the block, and the component.
    pub(super) fn imposed(&self, block: usize) -> impl Iterator<Item = (usize, usize)> {
        let first = block * BLOCK;
        let start = self.constraints.partition_point(|c| (c.node as usize) < first);
        let here = self.constraints[start..].iter().take_while(move |c| (c.node as usize) < first + BLOCK);
        here.map(move |c| (c.node as usize - first, c.component as usize))
    }

    /// y = f(x, y), number by number.
    fn each(&self, x: &CpuVector<R>, y: &mut CpuVector<R>, f: impl Fn(R, R) -> R + Sync) {
        y.0.par_chunks_mut(BLOCK).zip(x.0.par_chunks(BLOCK)).for_each(|(y, x)| {
            for (y, x) in y.as_flattened_mut().iter_mut().zip(x.as_flattened()) {
                *y = f(*x, *y);
            }
        });
    }
}

impl<R: Precision> Backend for CpuBackend<R> {
    type Vector = CpuVector<R>;
    type Registers = [f64; REGISTERS];
    type Matrix = CpuMatrix<R>;
    type Contact = CpuContact;
    type Pressure = CpuPressure;

    fn zeros(&self) -> Self::Vector {
        CpuVector::zeros(self.places.len(), &self.ledger)
    }

    fn upload(&self, values: &[[f64; 3]]) -> Self::Vector {
        let mut x = self.zeros();
        self.places.iter().zip(values).for_each(|(place, value)| x.0[*place as usize] = value.map(R::from_f64));
        x
    }

    fn download(&self, x: &Self::Vector) -> Vec<[f64; 3]> {
        self.places.iter().map(|place| x.0[*place as usize].map(R::to_f64)).collect()
    }

    fn copy(&self, x: &Self::Vector, y: &mut Self::Vector) {
        self.each(x, y, |x, _| x);
    }

    fn clear(&self, x: &mut Self::Vector) {
        x.0.par_chunks_mut(BLOCK).for_each(|x| x.fill([R::default(); 3]));
    }

    fn axpy(&self, a: f64, x: &Self::Vector, y: &mut Self::Vector) {
        let a = R::from_f64(a);
        self.each(x, y, |x, y| y + a * x);
    }

    fn xpby(&self, x: &Self::Vector, b: f64, y: &mut Self::Vector) {
        let b = R::from_f64(b);
        self.each(x, y, |x, y| x + b * y);
    }

    fn scale(&self, b: f64, y: &mut Self::Vector) {
        let b = R::from_f64(b);
        y.0.par_chunks_mut(BLOCK).for_each(|y| y.iter_mut().for_each(|y| *y = y.map(|y| b * y)));
    }

    fn multiply_add(&self, a: f64, d: &Self::Vector, x: &Self::Vector, y: &mut Self::Vector) {
        let a = R::from_f64(a);
        y.0.par_chunks_mut(BLOCK).zip(x.0.par_chunks(BLOCK)).zip(d.0.par_chunks(BLOCK)).for_each(|((y, x), d)| {
            for ((y, x), d) in y.as_flattened_mut().iter_mut().zip(x.as_flattened()).zip(d.as_flattened()) {
                *y = *y + a * (*d * *x);
            }
        });
    }

    fn matrix(&self, matrix: &MassMatrix) -> CpuMatrix<R> {
        let MassMatrix { offsets, columns, values } = matrix.placed(&self.places);
        let values: Vec<R> = values.into_iter().map(R::from_f64).collect();
        let bytes = size_of_val(&*offsets) + size_of_val(&*columns) + size_of_val(&*values);
        CpuMatrix { offsets, columns, values, _lease: self.ledger.hold(MASS_MATRIX, bytes) }
    }

    fn add_product(&self, a: f64, matrix: &CpuMatrix<R>, x: &Self::Vector, y: &mut Self::Vector) {
        let a = R::from_f64(a);
        self.ledger.ran("product with the consistent mass");
        y.0.par_chunks_mut(BLOCK).enumerate().for_each(|(block, y)| {
            for (i, y) in y.iter_mut().enumerate() {
                let node = block * BLOCK + i;
                let row = matrix.offsets[node] as usize..matrix.offsets[node + 1] as usize;
                let mut sum = [R::default(); 3];
                for (column, value) in matrix.columns[row.clone()].iter().zip(&matrix.values[row]) {
                    let x = &x.0[*column as usize];
                    for c in 0..3 {
                        sum[c] = sum[c] + *value * x[c];
                    }
                }
                for c in 0..3 {
                    y[c] = y[c] + a * sum[c];
                }
            }
        });
    }

    fn divide(&self, x: &Self::Vector, d: &Self::Vector, y: &mut Self::Vector) {
        y.0.par_chunks_mut(BLOCK).zip(x.0.par_chunks(BLOCK)).zip(d.0.par_chunks(BLOCK)).for_each(|((y, x), d)| {
            for ((y, x), d) in y.as_flattened_mut().iter_mut().zip(x.as_flattened()).zip(d.as_flattened()) {
                *y = *x / *d;
            }
        });
    }

    fn dot(&self, x: &Self::Vector, y: &Self::Vector) -> f64 {
        let blocks = x.0.par_chunks(BLOCK).zip(y.0.par_chunks(BLOCK));
        blocks.map(|(x, y)| exact_dot(x, y)).collect::<Vec<f64>>().iter().sum()
    }

    fn max_abs(&self, x: &Self::Vector) -> f64 {
        let block = |x: &[[R; 3]]| {
            x.iter().flatten().fold(0.0_f64, |m, v| {
                let v = v.to_f64().abs();
                if v.is_finite() { m.max(v) } else { f64::INFINITY }
            })
        };
        x.0.par_chunks(BLOCK).map(block).reduce(|| 0.0, f64::max)
    }

    fn project(&self, x: &mut Self::Vector) {
        for c in &self.constraints {
            x.0[c.node as usize][c.component as usize] = R::default();
        }
        self.project_held(x);
    }

    fn hold(&mut self, held: &[Held]) {
        let place = |held: &Held| (self.places[held.node as usize] as usize, held.normal, held.grip.sticks);
        self.held = held.iter().map(place).collect();
    }

    fn project_held(&self, x: &mut Self::Vector) {
        for (place, normal, sticks) in &self.held {
            let x = &mut x.0[*place];
            let along: f64 = x.iter().zip(normal).map(|(x, n)| x.to_f64() * n).sum();
            for (x, n) in x.iter_mut().zip(normal) {
                *x = if *sticks { R::default() } else { R::from_f64(x.to_f64() - along * n) };
            }
        }
    }

    fn even_out(&self, x: &mut Self::Vector) {
        for (place, ..) in &self.held {
            let greatest = x.0[*place].iter().map(|x| x.to_f64()).fold(0.0, f64::max);
            x.0[*place] = [R::from_f64(greatest); 3];
        }
    }

    fn impose(&self, motions: &[f64], x: &mut Self::Vector) {
        for c in &self.constraints {
            x.0[c.node as usize][c.component as usize] = R::from_f64(motions[c.motion]);
        }
    }

    fn impose_change(&self, motions: &[f64], x: &Self::Vector, y: &mut Self::Vector) {
        for c in &self.constraints {
            let (node, component) = (c.node as usize, c.component as usize);
            y.0[node][component] = R::from_f64(motions[c.motion]) - x.0[node][component];
        }
    }

    fn make_positive(&self, x: &mut Self::Vector) {
        let positive = |v: R| match v.to_f64() {
            v if v == 0.0 || v.is_nan() => R::from_f64(1.0),
            v => R::from_f64(v.abs()),
        };
        x.0.par_chunks_mut(BLOCK).for_each(|x| x.iter_mut().for_each(|x| *x = x.map(positive)));
    }

    fn epsilon(&self) -> f64 {
        R::EPSILON
    }

    fn smallest(&self) -> f64 {
        f64::MIN_POSITIVE
    }

    fn registers(&self, values: [f64; REGISTERS]) -> Self::Registers {
        values
    }

    fn load(&self, values: [f64; REGISTERS], registers: &mut Self::Registers) {
        *registers = values;
    }

    fn read(&self, registers: &Self::Registers) -> [f64; REGISTERS] {
        *registers
    }

    fn dot_to(&self, x: &Self::Vector, y: &Self::Vector, registers: &mut Self::Registers, k: usize) {
        registers[k] = self.dot(x, y);
    }

    fn update<U: Update>(&self, registers: &mut Self::Registers) {
        U::apply(registers);
    }

    fn descend(&self, descent: Descent<Self>, registers: &mut Self::Registers) {
        if registers[RUNNING] > 0.0 {
            let Descent { d, q, preconditioner, x, r, z } = descent;
            let alpha = R::from_f64(registers[ALPHA]);
            let minus = R::from_f64(-registers[ALPHA]);
            let given = d.0.par_chunks(BLOCK).zip(q.0.par_chunks(BLOCK)).zip(preconditioner.0.par_chunks(BLOCK));
            let changed = x.0.par_chunks_mut(BLOCK).zip(r.0.par_chunks_mut(BLOCK)).zip(z.0.par_chunks_mut(BLOCK));
            // One pass over the vectors: each is read and written once.
            let blocks: Vec<f64> = given
                .zip(changed)
                .map(|(((d, q), preconditioner), ((x, r), z))| {
                    let given = d.as_flattened().iter().zip(q.as_flattened()).zip(preconditioner.as_flattened());
                    let [x, residual, scaled] = [x, &mut *r, &mut *z].map(|x| x.as_flattened_mut());
                    let changed = x.iter_mut().zip(residual).zip(scaled);
                    for (((x, r), z), ((d, q), preconditioner)) in changed.zip(given) {
                        *x = *x + alpha * *d;
                        *r = *r + minus * *q;
                        *z = *r / *preconditioner;
                    }
                    exact_dot(r, z)
                })
                .collect();
            registers[SUM] = blocks.iter().sum();
        }
    }

    fn advance(&self, advance: Advance<Self>) {
        let Advance { force, masses, keep, kick, drift, v, u } = advance;
        let [keep, kick, drift] = [keep, kick, drift].map(R::from_f64);
        let given = force.0.par_chunks(BLOCK).zip(masses.0.par_chunks(BLOCK));
        // One pass over the vectors, with the arithmetic of the four operations.
        v.0.par_chunks_mut(BLOCK).zip(u.0.par_chunks_mut(BLOCK)).zip(given).for_each(|((v, u), (force, masses))| {
            let given = force.as_flattened().iter().zip(masses.as_flattened());
            let changed = v.as_flattened_mut().iter_mut().zip(u.as_flattened_mut());
            for ((v, u), (force, masses)) in changed.zip(given) {
                *v = keep * *v + kick * (*force / *masses);
                *u = *u + drift * *v;
            }
        });
    }

    fn pressure(&self, faces: &[PressedFace]) -> CpuPressure {
        CpuPressure::new(faces, &self.places, &self.ledger)
    }

    fn add_pressure(&self, faces: &CpuPressure, pressure: f64, u: &Self::Vector, f: &mut Self::Vector) {
        self.ledger.ran("pressure");
        faces.add(pressure, u, f);
    }

    fn contact(&self, contact: &Contact) -> CpuContact {
        CpuContact::new(contact, &self.places, R::EPSILON, &self.ledger)
    }

    fn touch(&self, meeting: Meeting<Self>) {
        self.ledger.ran("contact");
        meeting.contact.touch(meeting);
    }

    fn gap(&self, contact: &CpuContact, passages: &[Passage<f64>], limit: f64, u: &Self::Vector) -> f64 {
        self.ledger.ran("gap");
        contact.gap(passages, u).min(limit)
    }

    fn turn(&self, z: &Self::Vector, d: &mut Self::Vector, registers: &Self::Registers) {
        if registers[RUNNING] > 0.0 {
            self.xpby(z, registers[BETA], d);
        }
    }

    fn iterations_between_readings(&self) -> u32 {
        1
    }

    fn name(&self) -> String {
        "cpu".to_string()
    }

    fn wait(&self) -> Result<(), DeviceError> {
        Ok(())
    }

    fn counts(&self) -> Counts {
        Counts::default()
    }

    fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    fn check(&self) -> Result<(), DeviceError> {
        Ok(())
    }
}
