//! The tangent as a symmetric matrix over the nodes of clusters, in blocks of 3 x 3 numbers, as lanes meet it.
//!
//! Of two nodes that are joined one block B is kept, which serves both: y_i += B (x_j - x_i), y_j -= B' (x_j - x_i). A body
//! that is moved as a whole has no forces, so that the blocks of a row add up to nothing and that of the diagonal is not
//! needed. Nor would it do: products with x itself leave roundings of the size of the motion, differences leave those of the
//! strain and of the turn, as products over elements do.
//!
//! A lane has a row: as many rows of a cluster as there are lanes make a chunk, which meets one block of each row in each
//! step. Rows with about as many blocks share a chunk (sliced ELLPACK of sorted rows: Kreutzer et al. 2014).
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
    /// Of each chunk the nodes of its rows, and of each of its steps those of the columns, a lane each.
    places: Aligned<Place>,
    /// Of each step the numbers of its blocks, each lane after lane.
    numbers: Aligned<R>,
    /// The first step of each chunk, and where the last one ends: chunk k has k sets of rows before its own.
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
    blocks: Vec<(usize, u32)>,
}

/// The rows of a cluster, the longest first.
fn rows(blocks: &[[u32; 2]], nodes: usize) -> Vec<Row> {
    let mut rows: Vec<Row> = (0..).take(nodes).map(|node| Row { node, blocks: vec![] }).collect();
    for (k, [row, column]) in blocks.iter().enumerate() {
        rows[*row as usize].blocks.push((k, *column));
    }
    rows.retain(|row| !row.blocks.is_empty());
    rows.sort_by_key(|row| std::cmp::Reverse(row.blocks.len()));
    rows
}

impl<R: Real + Default> Matrix<R> {
    /// A matrix of zeros for clusters with these blocks, each given by its row and its column, which are different nodes of
    /// the cluster; no block is given twice, nor as its transpose. And where among the numbers of its cluster
    /// ([`Matrix::parts_mut`]) the first number of each block is; the others follow at distances of as many as there are
    /// lanes.
    ///
    /// # Panics
    /// A node is beyond [`most_nodes`].
    pub fn new(lanes: usize, clusters: &[Vec<[u32; 2]>]) -> (Self, Vec<Vec<u32>>) {
        let (mut steps, mut chunks, mut reach) = (vec![0], vec![0], 1);
        let (mut places, mut at): (Vec<Place>, Vec<Vec<u32>>) = (vec![], vec![]);
        let place = |node: u32| (node as usize * stride::<R>()) as Place;
        let (mut step, mut all) = (0, 0);
        for blocks in clusters {
            let nodes = blocks.iter().flatten().max().map_or(0, |n| *n as usize + 1);
            assert!(nodes <= most_nodes::<R>(), "a cluster of {nodes} nodes is too large");
            reach = reach.max(nodes);
            let (before, mut here) = (step, vec![0; blocks.len()]);
            for chunk in rows(blocks, nodes).chunks(lanes) {
                // Lanes without a row have the last one once more, with zeros, as have those whose row has no more blocks.
                let row = |lane: usize| &chunk[lane.min(chunk.len() - 1)];
                places.extend((0..lanes).map(|lane| place(row(lane).node)));
                for k in 0..chunk[0].blocks.len() {
                    for lane in 0..lanes {
                        let block = row(lane).blocks.get(k).filter(|_| lane < chunk.len());
                        if let Some((block, _)) = block {
                            // `as u32` is exact: a cluster has far fewer numbers.
                            here[*block] = (9 * (step - before) * lanes + lane) as u32;
                        }
                        places.push(place(block.map_or(row(lane).node, |(_, column)| *column)));
                    }
                    step += 1;
                }
                steps.push(step as u32);
                all += 1;
            }
            chunks.push(all);
            at.push(here);
        }
        let mut aligned = Aligned::zeros(places.len());
        aligned.all_mut().copy_from_slice(&places);
        (Self { lanes, places: aligned, numbers: Aligned::zeros(9 * step * lanes), steps, chunks, reach }, at)
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
    /// Bytes of places, numbers and where they begin.
    pub fn bytes(&self) -> usize {
        let [places, numbers] = [size_of_val(self.places.all()), size_of_val(self.numbers.all())];
        places + numbers + size_of_val(&*self.steps) + size_of_val(&*self.chunks)
    }

    /// The rows of a cluster.
    pub fn rows(&self, cluster: usize) -> Rows<'_, R> {
        Rows { matrix: self, chunks: self.chunks[cluster] as usize..self.chunks[cluster + 1] as usize }
    }

    /// The nodes of a set: of the rows of a chunk, or of the columns of a step.
    ///
    /// # Panics
    /// The matrix has other lanes, or there are fewer nodes than it has.
    #[inline(always)]
    fn places<V: Lanes<Scalar = R>>(&self, set: usize, nodes: &[Node<R>]) -> &[Place] {
        assert!(V::COUNT == self.lanes && nodes.len() >= self.reach, "a matrix of other lanes or nodes");
        &self.places.all()[set * V::COUNT..][..V::COUNT]
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
        let row = matrix.places::<V>(first + chunk, x);
        // SAFETY: `places` says so, here and below.
        let x_row = unsafe { V::gather(x, row) };
        let mut y_row = [V::from_f64(-0.0); 3];
        for step in first..end {
            let column = matrix.places::<V>(step + chunk + 1, x);
            let block = matrix.blocks::<V>(step);
            let x_column = unsafe { V::gather(x, column) };
            let apart = [x_column[0] - x_row[0], x_column[1] - x_row[1], x_column[2] - x_row[2]];
            let mut y_column = [V::from_f64(-0.0); 3];
            for a in 0..3 {
                for c in 0..3 {
                    y_row[a] = block[3 * a + c].multiply_add(apart[c], y_row[a]);
                    y_column[a] = block[3 * c + a].multiply_add(-apart[c], y_column[a]);
                }
            }
            unsafe { V::scatter(y_column, y, column) };
        }
        unsafe { V::scatter(y_row, y, row) };
    }
}
