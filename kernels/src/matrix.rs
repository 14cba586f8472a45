//! A symmetric matrix over the nodes of clusters, in blocks of 3 x 3 numbers, as lanes meet it.
//!
//! Of two nodes that are joined one block is kept, which serves both. A lane has a row: as many rows of a cluster as there
//! are lanes make a chunk, which meets the blocks of the diagonal in its first step, and one more block of each row in each
//! step after it. Rows with about as many blocks share a chunk (sliced ELLPACK of sorted rows: Kreutzer et al. 2014).
#![allow(unsafe_code)]

use std::ops::Range;

use crate::aligned::Aligned;
use crate::blocks::most_nodes;
use crate::lanes::{Lanes, Node, Place, stride};
use crate::real::Real;

/// See the module. Number 3 a + c of a block is that of component a of its row's node and c of its column's.
#[derive(Debug)]
pub struct Matrix<R> {
    lanes: usize,
    /// Of each step a node for each lane: that of its row in the first step of a chunk, that of the column in others.
    places: Aligned<Place>,
    /// Of each step the numbers of its blocks, each lane after lane.
    numbers: Aligned<R>,
    /// The first step of each chunk, and where the last one ends.
    steps: Vec<u32>,
    /// The first chunk of each cluster, and where the last one ends.
    chunks: Vec<u32>,
    /// One more than the greatest node of a cluster.
    reach: usize,
}

/// The rows of a cluster.
#[derive(Debug)]
pub struct Rows<'a, R> {
    matrix: &'a Matrix<R>,
    chunks: Range<usize>,
}

/// A row that is dealt to a lane: its blocks, by number, and the column of each.
struct Row {
    node: u32,
    diagonal: Option<usize>,
    others: Vec<(usize, u32)>,
}

/// The rows of a cluster, the longest first.
fn rows(blocks: &[[u32; 2]], nodes: usize) -> Vec<Row> {
    let mut rows: Vec<Row> = (0..).take(nodes).map(|node| Row { node, diagonal: None, others: vec![] }).collect();
    for (k, [row, column]) in blocks.iter().enumerate() {
        let at = &mut rows[*row as usize];
        if row == column {
            at.diagonal = Some(k);
        } else {
            at.others.push((k, *column));
        }
    }
    rows.retain(|row| row.diagonal.is_some() || !row.others.is_empty());
    rows.sort_by_key(|row| std::cmp::Reverse(row.others.len()));
    rows
}

impl<R: Real + Default> Matrix<R> {
    /// A matrix of zeros for clusters with these blocks, each given by its row and its column, which are nodes of the
    /// cluster; no block is given twice, nor as its transpose. And where among the numbers of its cluster
    /// ([`Matrix::parts_mut`]) the first number of each block is; the others follow at distances of as many as there are
    /// lanes.
    ///
    /// # Panics
    /// A node is beyond [`most_nodes`].
    pub fn new(lanes: usize, clusters: &[Vec<[u32; 2]>]) -> (Self, Vec<Vec<u32>>) {
        let (mut steps, mut chunks, mut reach) = (vec![0], vec![0], 1);
        let (mut places, mut at): (Vec<Place>, Vec<Vec<u32>>) = (vec![], vec![]);
        for blocks in clusters {
            let nodes = blocks.iter().flatten().max().map_or(0, |n| *n as usize + 1);
            assert!(nodes <= most_nodes::<R>(), "a cluster of {nodes} nodes is too large");
            reach = reach.max(nodes);
            let (before, mut here) = (places.len(), vec![0; blocks.len()]);
            for chunk in rows(blocks, nodes).chunks(lanes) {
                for step in 0..=chunk[0].others.len() {
                    let numbers = 9 * (places.len() - before);
                    for lane in 0..lanes {
                        // Where a lane has no block, a row meets itself: with zeros.
                        let row = &chunk[lane.min(chunk.len() - 1)];
                        let block = match step.checked_sub(1) {
                            None => row.diagonal.map(|k| (k, row.node)),
                            Some(k) => row.others.get(k).copied(),
                        };
                        let column = match block.filter(|_| lane < chunk.len()) {
                            Some((k, column)) => {
                                // `as u32` is exact: a cluster has far fewer numbers.
                                here[k] = (numbers + lane) as u32;
                                column
                            }
                            None => row.node,
                        };
                        places.push((column as usize * stride::<R>()) as Place);
                    }
                }
                steps.push((places.len() / lanes) as u32);
            }
            chunks.push(steps.len() as u32 - 1);
            at.push(here);
        }
        let mut aligned = Aligned::zeros(places.len());
        aligned.all_mut().copy_from_slice(&places);
        (Self { lanes, places: aligned, numbers: Aligned::zeros(9 * places.len()), steps, chunks, reach }, at)
    }

    /// The numbers of each cluster.
    pub fn parts_mut(&mut self) -> Vec<&mut [R]> {
        let of_step = 9 * self.lanes;
        let mut rest = self.numbers.all_mut();
        let part = |ends: &[u32]| {
            let [first, end] = [ends[0], ends[1]].map(|chunk| self.steps[chunk as usize] as usize);
            let here;
            (here, rest) = std::mem::take(&mut rest).split_at_mut((end - first) * of_step);
            here
        };
        self.chunks.windows(2).map(part).collect()
    }
}

impl<R> Matrix<R> {
    /// The rows of a cluster.
    pub fn rows(&self, cluster: usize) -> Rows<'_, R> {
        Rows { matrix: self, chunks: self.chunks[cluster] as usize..self.chunks[cluster + 1] as usize }
    }

    /// Bytes of it.
    pub fn bytes(&self) -> usize {
        size_of_val(self.places.all()) + size_of_val(self.numbers.all()) + 4 * (self.steps.len() + self.chunks.len())
    }

    /// The nodes of a step.
    ///
    /// # Panics
    /// The matrix has other lanes, or there are fewer nodes than it has.
    #[inline(always)]
    fn places<V: Lanes<Scalar = R>>(&self, step: usize, nodes: &[Node<R>]) -> &[Place] {
        assert!(V::COUNT == self.lanes && nodes.len() >= self.reach, "a matrix of other lanes or nodes");
        &self.places.all()[step * V::COUNT..][..V::COUNT]
    }
}

impl<R: Copy> Matrix<R> {
    /// The blocks of a step.
    #[inline(always)]
    fn blocks<V: Lanes<Scalar = R>>(&self, step: usize) -> [V; 9] {
        let numbers = &self.numbers.all()[9 * step * V::COUNT..][..9 * V::COUNT];
        let mut blocks = [V::load(numbers); 9];
        for (k, number) in blocks.iter_mut().enumerate().skip(1) {
            *number = V::load(&numbers[k * V::COUNT..]);
        }
        blocks
    }
}

/// Rows and x -> what they add to y.
pub(crate) type MultiplyKernel<V> =
    fn(&Rows<<V as Lanes>::Scalar>, &[Node<<V as Lanes>::Scalar>], &mut [Node<<V as Lanes>::Scalar>]);

/// What the rows of a cluster add to y = A x, at the nodes of the cluster.
#[inline(always)]
pub(crate) fn multiply<V: Lanes>(rows: &Rows<V::Scalar>, x: &[Node<V::Scalar>], y: &mut [Node<V::Scalar>]) {
    let Rows { matrix, chunks } = rows;
    for chunk in chunks.clone() {
        let [first, end] = [chunk, chunk + 1].map(|chunk| matrix.steps[chunk] as usize);
        let row = matrix.places::<V>(first, x);
        // SAFETY: `places` says so, here and below.
        let x_row = unsafe { V::gather(x, row) };
        let mut y_row = product(&matrix.blocks::<V>(first), ROWS, &x_row, None);
        for step in first + 1..end {
            let column = matrix.places::<V>(step, x);
            let block = matrix.blocks::<V>(step);
            let x_column = unsafe { V::gather(x, column) };
            y_row = product(&block, ROWS, &x_column, Some(&y_row));
            unsafe { V::scatter(product(&block, COLUMNS, &x_row, None), y, column) };
        }
        unsafe { V::scatter(y_row, y, row) };
    }
}

/// Numbers of a block, row by row.
const ROWS: [usize; 9] = [0, 1, 2, 3, 4, 5, 6, 7, 8];
/// Numbers of a block, column by column: those of its transpose.
const COLUMNS: [usize; 9] = [0, 3, 6, 1, 4, 7, 2, 5, 8];

/// A x, with the numbers of A in this order, added to a sum if there is one.
#[inline(always)]
fn product<V: Lanes>(block: &[V; 9], order: [usize; 9], x: &[V; 3], sum: Option<&[V; 3]>) -> [V; 3] {
    let mut y = *x;
    for a in 0..3 {
        let row = [block[order[3 * a]], block[order[3 * a + 1]], block[order[3 * a + 2]]];
        y[a] = match sum {
            Some(sum) => row[0].multiply_add(x[0], sum[a]),
            None => row[0] * x[0],
        };
        y[a] = row[2].multiply_add(x[2], row[1].multiply_add(x[1], y[a]));
    }
    y
}
