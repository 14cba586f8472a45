//! Vector arithmetic on the CPU: parallel over fixed blocks of nodes, so that sums do not depend on the thread count.

use rayon::prelude::*;

use super::Precision;
use crate::backend::{ALPHA, Advance, BETA, Backend, Counts, Descent, REGISTERS, RUNNING, SUM, Update};
use crate::body::Constraint;
use crate::device::DeviceError;
use crate::mass::MassMatrix;

/// Nodes a block: a block's partial sum is formed by one thread, blocks are added in order.
pub(super) const BLOCK: usize = 1024;

/// x . y of one node. The products of two f32 are exact in f64: a dot product's rounding does not limit a solver in f32.
pub(super) fn exact_dot<R: Precision>(x: &[R; 3], y: &[R; 3]) -> f64 {
    (0..3).map(|c| x[c].to_f64() * y[c].to_f64()).sum()
}

/// A mass matrix in memory, in compressed rows.
#[derive(Debug)]
pub struct CpuMatrix<R> {
    offsets: Vec<u32>,
    columns: Vec<u32>,
    values: Vec<R>,
}

/// Vectors in memory.
#[derive(Debug)]
pub struct CpuBackend<R> {
    nodes: usize,
    constraints: Vec<Constraint>,
    precision: std::marker::PhantomData<R>,
}

impl<R: Precision> CpuBackend<R> {
    /// A backend for a body of `nodes` nodes with imposed components.
    pub fn new(nodes: usize, constraints: Vec<Constraint>) -> Self {
        Self { nodes, constraints, precision: std::marker::PhantomData }
    }

    /// The imposed components of a block's nodes: the node's place in the block, and the component.
    pub(super) fn imposed(&self, block: usize) -> impl Iterator<Item = (usize, usize)> {
        let first = block * BLOCK;
        let start = self.constraints.partition_point(|c| (c.node as usize) < first);
        let here = self.constraints[start..].iter().take_while(move |c| (c.node as usize) < first + BLOCK);
        here.map(move |c| (c.node as usize - first, c.component as usize))
    }

    fn each(&self, x: &[[R; 3]], y: &mut [[R; 3]], f: impl Fn(&[R; 3], &mut [R; 3]) + Sync) {
        y.par_chunks_mut(BLOCK).zip(x.par_chunks(BLOCK)).for_each(|(y, x)| {
            for (y, x) in y.iter_mut().zip(x) {
                f(x, y);
            }
        });
    }
}

impl<R: Precision> Backend for CpuBackend<R> {
    type Vector = Vec<[R; 3]>;
    type Registers = [f64; REGISTERS];
    type Matrix = CpuMatrix<R>;

    fn zeros(&self) -> Self::Vector {
        vec![[R::default(); 3]; self.nodes]
    }

    fn upload(&self, values: &[[f64; 3]]) -> Self::Vector {
        values.iter().map(|v| v.map(R::from_f64)).collect()
    }

    fn download(&self, x: &Self::Vector) -> Vec<[f64; 3]> {
        x.iter().map(|v| v.map(R::to_f64)).collect()
    }

    fn copy(&self, x: &Self::Vector, y: &mut Self::Vector) {
        y.copy_from_slice(x);
    }

    fn clear(&self, x: &mut Self::Vector) {
        x.fill([R::default(); 3]);
    }

    fn axpy(&self, a: f64, x: &Self::Vector, y: &mut Self::Vector) {
        let a = R::from_f64(a);
        self.each(x, y, |x, y| {
            for c in 0..3 {
                y[c] = y[c] + a * x[c];
            }
        });
    }

    fn xpby(&self, x: &Self::Vector, b: f64, y: &mut Self::Vector) {
        let b = R::from_f64(b);
        self.each(x, y, |x, y| {
            for c in 0..3 {
                y[c] = x[c] + b * y[c];
            }
        });
    }

    fn scale(&self, b: f64, y: &mut Self::Vector) {
        let b = R::from_f64(b);
        y.par_chunks_mut(BLOCK).for_each(|y| y.iter_mut().for_each(|y| *y = y.map(|y| b * y)));
    }

    fn multiply_add(&self, a: f64, d: &Self::Vector, x: &Self::Vector, y: &mut Self::Vector) {
        let a = R::from_f64(a);
        y.par_chunks_mut(BLOCK).zip(x.par_chunks(BLOCK)).zip(d.par_chunks(BLOCK)).for_each(|((y, x), d)| {
            for ((y, x), d) in y.iter_mut().zip(x).zip(d) {
                for c in 0..3 {
                    y[c] = y[c] + a * (d[c] * x[c]);
                }
            }
        });
    }

    fn matrix(&self, matrix: &MassMatrix) -> CpuMatrix<R> {
        let MassMatrix { offsets, columns, values } = matrix.clone();
        CpuMatrix { offsets, columns, values: values.into_iter().map(R::from_f64).collect() }
    }

    fn add_product(&self, a: f64, matrix: &CpuMatrix<R>, x: &Self::Vector, y: &mut Self::Vector) {
        let a = R::from_f64(a);
        y.par_chunks_mut(BLOCK).enumerate().for_each(|(block, y)| {
            for (i, y) in y.iter_mut().enumerate() {
                let node = block * BLOCK + i;
                let row = matrix.offsets[node] as usize..matrix.offsets[node + 1] as usize;
                let mut sum = [R::default(); 3];
                for (column, value) in matrix.columns[row.clone()].iter().zip(&matrix.values[row]) {
                    let x = &x[*column as usize];
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
        y.par_chunks_mut(BLOCK).zip(x.par_chunks(BLOCK)).zip(d.par_chunks(BLOCK)).for_each(|((y, x), d)| {
            for ((y, x), d) in y.iter_mut().zip(x).zip(d) {
                for c in 0..3 {
                    y[c] = x[c] / d[c];
                }
            }
        });
    }

    fn dot(&self, x: &Self::Vector, y: &Self::Vector) -> f64 {
        let blocks = x.par_chunks(BLOCK).zip(y.par_chunks(BLOCK));
        let block = |(x, y): (&[[R; 3]], &[[R; 3]])| x.iter().zip(y).map(|(x, y)| exact_dot(x, y)).sum::<f64>();
        blocks.map(block).collect::<Vec<f64>>().iter().sum()
    }

    fn max_abs(&self, x: &Self::Vector) -> f64 {
        let block = |x: &[[R; 3]]| {
            x.iter().flatten().fold(0.0_f64, |m, v| {
                let v = v.to_f64().abs();
                if v.is_finite() { m.max(v) } else { f64::INFINITY }
            })
        };
        x.par_chunks(BLOCK).map(block).reduce(|| 0.0, f64::max)
    }

    fn project(&self, x: &mut Self::Vector) {
        for c in &self.constraints {
            x[c.node as usize][c.component as usize] = R::default();
        }
    }

    fn impose(&self, motions: &[f64], x: &mut Self::Vector) {
        for c in &self.constraints {
            x[c.node as usize][c.component as usize] = R::from_f64(motions[c.motion]);
        }
    }

    fn impose_change(&self, motions: &[f64], x: &Self::Vector, y: &mut Self::Vector) {
        for c in &self.constraints {
            let (node, component) = (c.node as usize, c.component as usize);
            y[node][component] = R::from_f64(motions[c.motion]) - x[node][component];
        }
    }

    fn make_positive(&self, x: &mut Self::Vector) {
        let positive = |v: R| match v.to_f64() {
            v if v == 0.0 || v.is_nan() => R::from_f64(1.0),
            v => R::from_f64(v.abs()),
        };
        x.par_chunks_mut(BLOCK).for_each(|x| x.iter_mut().for_each(|x| *x = x.map(positive)));
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
            let given = d.par_chunks(BLOCK).zip(q.par_chunks(BLOCK)).zip(preconditioner.par_chunks(BLOCK));
            let changed = x.par_chunks_mut(BLOCK).zip(r.par_chunks_mut(BLOCK)).zip(z.par_chunks_mut(BLOCK));
            // One pass over the vectors: each is read and written once.
            let blocks: Vec<f64> = given
                .zip(changed)
                .map(|(((d, q), preconditioner), ((x, r), z))| {
                    let mut sum = 0.0;
                    for i in 0..x.len() {
                        for c in 0..3 {
                            x[i][c] = x[i][c] + alpha * d[i][c];
                            r[i][c] = r[i][c] + minus * q[i][c];
                            z[i][c] = r[i][c] / preconditioner[i][c];
                        }
                        sum += exact_dot(&r[i], &z[i]);
                    }
                    sum
                })
                .collect();
            registers[SUM] = blocks.iter().sum();
        }
    }

    fn advance(&self, advance: Advance<Self>) {
        let Advance { force, masses, keep, kick, drift, v, u, .. } = advance;
        let [keep, kick, drift] = [keep, kick, drift].map(R::from_f64);
        let given = force.par_chunks(BLOCK).zip(masses.par_chunks(BLOCK));
        // One pass over the vectors, with the arithmetic of the four operations.
        v.par_chunks_mut(BLOCK).zip(u.par_chunks_mut(BLOCK)).zip(given).for_each(|((v, u), (force, masses))| {
            for i in 0..v.len() {
                for c in 0..3 {
                    v[i][c] = keep * v[i][c] + kick * (force[i][c] / masses[i][c]);
                    u[i][c] = u[i][c] + drift * v[i][c];
                }
            }
        });
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

    fn check(&self) -> Result<(), DeviceError> {
        Ok(())
    }
}
