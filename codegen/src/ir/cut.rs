//! Splits a kernel of a state and an increment in two: what is computed once a state, and what for every increment.
//!
//! Of the values that do not depend on the increment some are stored, and some are computed again from stored ones: a
//! minimum cut through the kernel's graph (Ford & Fulkerson 1956), where storing a number costs as much as some
//! operations. Each value has two vertices: that the second part has it, and that it computes it again. An edge from the
//! first to the second costs a number stored, one from the second to the sink the operation, and whoever computes again
//! needs its operands, at any price otherwise.

use std::collections::VecDeque;

use super::{Input, KernelIr, Op, Output, ValidKernel, ValueId};

/// A kernel in two parts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cut {
    /// From the state to what is stored of it; none where nothing is.
    pub linearize: Option<ValidKernel>,
    /// From what is stored and the increment to the kernel's outputs.
    pub apply: ValidKernel,
}

impl Cut {
    /// Numbers stored.
    pub fn stored(&self) -> usize {
        self.linearize.as_ref().map_or(0, |k| k.ir().outputs[0].1.len())
    }
}

/// What an operation costs, in additions.
fn operation_cost(op: &Op) -> u64 {
    match op {
        Op::Input(..) | Op::Const(_) | Op::Neg(_) => 0,
        Op::Add(..) | Op::Sub(..) | Op::Mul(..) | Op::Fma(..) | Op::Select(..) => 1,
        // A division or root occupies its unit for about so long, on registers of any width.
        Op::Div(..) | Op::Sqrt(_) => 8,
        Op::Ln(_) | Op::Exp(_) | Op::Log1p(_) | Op::Expm1(_) | Op::Log1pmx(_) | Op::Expm1mx(_) => 30,
        Op::Powf(..) => 100,
    }
}

/// A flow network with integer capacities.
#[derive(Default)]
struct Network {
    /// Edges out of each vertex.
    edges: Vec<Vec<usize>>,
    /// Head and capacity left; an edge and its reverse follow each other.
    all: Vec<(usize, u64)>,
}

/// More than any cut costs.
const UNBOUNDED: u64 = 1 << 40;

impl Network {
    fn new(vertices: usize) -> Self {
        Self { edges: vec![vec![]; vertices], all: vec![] }
    }

    fn edge(&mut self, from: usize, to: usize, capacity: u64) {
        for (from, to, capacity) in [(from, to, capacity), (to, from, 0)] {
            self.edges[from].push(self.all.len());
            self.all.push((to, capacity));
        }
    }

    /// By which edge each vertex was reached from the source, where capacity is left.
    fn reached(&self, source: usize) -> Vec<Option<usize>> {
        let mut by = vec![None; self.edges.len()];
        let mut queue = VecDeque::from([source]);
        while let Some(v) = queue.pop_front() {
            for &e in &self.edges[v] {
                let (to, left) = self.all[e];
                if left > 0 && to != source && by[to].is_none() {
                    by[to] = Some(e);
                    queue.push_back(to);
                }
            }
        }
        by
    }

    /// The source's side of the least minimum cut (Edmonds & Karp 1972).
    fn source_side(mut self, source: usize, sink: usize) -> Vec<bool> {
        loop {
            let by = self.reached(source);
            if by[sink].is_none() {
                let mut side: Vec<bool> = by.iter().map(Option::is_some).collect();
                side[source] = true;
                return side;
            }
            let mut path = vec![];
            let mut v = sink;
            while let Some(e) = by[v] {
                path.push(e);
                v = self.all[e ^ 1].0;
            }
            let flow = path.iter().map(|e| self.all[*e].1).min().unwrap_or(0);
            for e in path {
                self.all[e].1 -= flow;
                self.all[e ^ 1].1 += flow;
            }
        }
    }
}

impl ValidKernel {
    /// Cuts at the increment: values that depend on the input `increment` are computed for each, the others once; a
    /// number stored costs as much as `price` additions.
    pub fn cut(&self, increment: Input, price: u64) -> Cut {
        let values = &self.ir().values;
        let mut varies = vec![false; values.len()];
        let mut is_free = vec![false; values.len()];
        for (i, d) in values.iter().enumerate() {
            let operands = d.op.operands();
            varies[i] =
                matches!(d.op, Op::Input(role, _) if role == increment) || operands.iter().any(|v| varies[v.index()]);
            is_free[i] = matches!(d.op, Op::Const(_) | Op::Input(Input::Constants, _));
        }
        let is_state = |v: ValueId| !varies[v.index()] && !is_free[v.index()];
        // Vertices: source, sink, and for each value that it is there and that it is computed again.
        let (source, sink) = (0, 1);
        let (there, again) = (|v: ValueId| 2 + 2 * v.index(), |v: ValueId| 3 + 2 * v.index());
        let mut network = Network::new(2 + 2 * values.len());
        for (i, d) in values.iter().enumerate() {
            let v = ValueId(i as u32);
            if varies[i] {
                d.op.operands().into_iter().filter(|o| is_state(*o)).for_each(|o| {
                    network.edge(source, there(o), UNBOUNDED);
                });
            } else if is_state(v) {
                if matches!(d.op, Op::Input(..)) {
                    network.edge(there(v), sink, price);
                    continue;
                }
                network.edge(there(v), again(v), price);
                network.edge(again(v), sink, operation_cost(&d.op));
                d.op.operands().into_iter().filter(|o| is_state(*o)).for_each(|o| {
                    network.edge(again(v), there(o), UNBOUNDED);
                });
            }
        }
        for v in self.ir().outputs.iter().flat_map(|(_, ids)| ids).filter(|v| is_state(**v)) {
            network.edge(source, there(*v), UNBOUNDED);
        }
        let side = network.source_side(source, sink);
        let all = (0..values.len() as u32).map(ValueId);
        let stored: Vec<ValueId> = all.filter(|v| is_state(*v) && side[there(*v)] && !side[again(*v)]).collect();
        Cut {
            linearize: (!stored.is_empty()).then(|| self.linearize(&stored, increment)),
            apply: self.apply(&stored, increment),
        }
    }

    fn linearize(&self, stored: &[ValueId], increment: Input) -> ValidKernel {
        let inputs = self.ir().inputs.iter().filter(|(role, _)| *role != increment).copied();
        let kernel = KernelIr {
            name: "linearize".to_string(),
            inputs: inputs.collect(),
            values: self.ir().values.clone(),
            outputs: vec![(Output::State, stored.to_vec())],
        };
        kernel.without_dead_values().validate().expect("a part of a valid kernel")
    }

    fn apply(&self, stored: &[ValueId], increment: Input) -> ValidKernel {
        let kept = |role: Input| role == Input::Constants || role == increment;
        let mut inputs: Vec<(Input, u32)> = self.ir().inputs.iter().filter(|(r, _)| kept(*r)).copied().collect();
        if !stored.is_empty() {
            let place = inputs.iter().position(|(r, _)| *r == increment).unwrap_or(inputs.len());
            inputs.insert(place, (Input::State, stored.len() as u32));
        }
        let mut values = self.ir().values.clone();
        for (k, v) in stored.iter().enumerate() {
            values[v.index()].op = Op::Input(Input::State, k as u32);
        }
        let outputs = self.ir().outputs.clone();
        let kernel = KernelIr { name: "apply".to_string(), inputs, values, outputs };
        kernel.without_dead_values().validate().expect("a part of a valid kernel")
    }
}
