//! Counts the operations of a kernel, as the papers and the benchmarks quote them.

use super::{Op, ValidKernel};

/// Operations of one evaluation. A fused multiply-add counts as one multiplication and one addition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct OperationCount {
    /// Additions and subtractions.
    pub additions: u32,
    /// Multiplications.
    pub multiplications: u32,
    /// Divisions.
    pub divisions: u32,
    /// Square roots, logarithms, exponentials, their remainders and powers.
    pub functions: u32,
    /// Selections.
    pub selects: u32,
}

impl OperationCount {
    /// Additions, multiplications and divisions together: the figure that comparisons use. Sign changes are free.
    pub fn arithmetic(&self) -> u32 {
        self.additions + self.multiplications + self.divisions
    }
}

impl std::ops::Add for OperationCount {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self {
            additions: self.additions + o.additions,
            multiplications: self.multiplications + o.multiplications,
            divisions: self.divisions + o.divisions,
            functions: self.functions + o.functions,
            selects: self.selects + o.selects,
        }
    }
}

impl ValidKernel {
    /// The operations of one evaluation.
    pub fn count(&self) -> OperationCount {
        let mut c = OperationCount::default();
        for definition in &self.ir().values {
            match definition.op {
                Op::Input(..) | Op::Const(_) | Op::Neg(_) => {}
                Op::Add(..) | Op::Sub(..) => c.additions += 1,
                Op::Mul(..) => c.multiplications += 1,
                Op::Div(..) => c.divisions += 1,
                Op::Fma(..) => {
                    c.additions += 1;
                    c.multiplications += 1;
                }
                Op::Sqrt(_) | Op::Ln(_) | Op::Exp(_) | Op::Log1p(_) | Op::Expm1(_) | Op::Powf(..) => c.functions += 1,
                Op::Log1pmx(_) | Op::Expm1mx(_) => c.functions += 1,
                Op::Select(..) => c.selects += 1,
            }
        }
        c
    }

    /// Whether the kernel reads the input with this role.
    pub fn reads(&self, role: super::Input) -> bool {
        self.ir().values.iter().any(|d| matches!(d.op, Op::Input(r, _) if r == role))
    }
}
