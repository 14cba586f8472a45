//! What WGSL a generator may print: valid without optional capabilities, within every device's limits, and free of what
//! devices compute differently or wrongly.

use naga::back::pipeline_constants::process_overrides;
use naga::proc::GlobalCtx;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{AddressSpace, BinaryOperator, Expression, Handle, Literal, MathFunction, Module};
use naga::{Scalar, ScalarKind, ShaderStage, StorageAccess, TypeInner};

/// Storage buffers that WebGPU grants a shader stage.
const STORAGE_BUFFERS: usize = 8;
/// Invocations that WebGPU grants a work group.
const WORK_GROUP: u32 = 256;
/// Bytes that WebGPU grants a work group's memory.
const WORK_GROUP_BYTES: u32 = 16 * 1024;

/// Why a text is refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Refusal {
    /// It is no WGSL: what the parser says.
    Parse(String),
    /// It breaks a rule of the language, or needs an optional capability: what the validator says.
    Invalid(String),
    /// A 64-bit float: software and hardware compute its functions wrongly, without a word.
    Double,
    /// An atomic: the order of sums, and with it their last digits, would change from run to run.
    Atomic,
    /// An expression compared with itself: a device may assume that there is no NaN. (WGSL has no `isNan`.)
    NotANumber,
    /// A built-in function that is specified too loosely for a derivative.
    Function(String),
    /// More storage buffers than every device has.
    StorageBuffers(usize),
    /// A larger work group than every device has, with the defaults of its constants.
    WorkGroup(u32),
    /// More memory of a work group than every device has, with the defaults of its constants.
    WorkGroupBytes(u32),
}

/// A variable in group 0.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bound {
    /// Its name.
    pub name: String,
    /// Whether it is a uniform buffer.
    pub uniform: bool,
    /// Whether it is declared `read_write`.
    pub written: bool,
    /// Whether the entry point uses it.
    pub used: bool,
}

/// Words in lower case that WGSL keeps for itself or has given a meaning.
pub fn words() -> impl Iterator<Item = &'static str> {
    use naga::keywords::wgsl::{BUILTIN_IDENTIFIERS, RESERVED};
    RESERVED.iter().chain(BUILTIN_IDENTIFIERS).copied().filter(|w| !w.contains(|c: char| c.is_ascii_uppercase()))
}

/// Checks a module with one entry point; gives what it binds, by binding number.
///
/// # Errors
/// The first rule that it breaks.
///
/// # Panics
/// It has not one entry point, or binds other numbers than 0, 1, 2, ... of group 0.
pub fn check(text: &str) -> Result<Vec<Bound>, Refusal> {
    let module = naga::front::wgsl::parse_str(text).map_err(|e| Refusal::Parse(e.emit_to_string(text)))?;
    // Before validation, which would refuse some of these in words of its own.
    types(&module)?;
    let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(&module)
        .map_err(|e| Refusal::Invalid(e.emit_to_string(text)))?;
    let functions = module.functions.iter().map(|(_, f)| f).chain(module.entry_points.iter().map(|e| &e.function));
    for function in functions {
        for (_, expression) in function.expressions.iter() {
            computable(expression, &function.expressions)?;
        }
    }
    assert_eq!(module.entry_points.len(), 1, "one entry point a module");
    let bound = bound(&module, &info);
    let buffers = bound.iter().filter(|b| !b.uniform && b.used).count();
    if buffers > STORAGE_BUFFERS {
        return Err(Refusal::StorageBuffers(buffers));
    }
    work_group(&module, &info)?;
    Ok(bound)
}

fn types(module: &Module) -> Result<(), Refusal> {
    let double = |s: &Scalar| s.kind == ScalarKind::Float && s.width == 8;
    for (_, ty) in module.types.iter() {
        match &ty.inner {
            TypeInner::Scalar(s) | TypeInner::Vector { scalar: s, .. } | TypeInner::Matrix { scalar: s, .. }
                if double(s) =>
            {
                return Err(Refusal::Double);
            }
            TypeInner::Atomic(_) => return Err(Refusal::Atomic),
            _ => {}
        }
    }
    let functions = module.functions.iter().map(|(_, f)| f).chain(module.entry_points.iter().map(|e| &e.function));
    let arenas = functions.map(|f| &f.expressions).chain([&module.global_expressions]);
    let mut expressions = arenas.flat_map(|a| a.iter());
    match expressions.any(|(_, e)| matches!(e, Expression::Literal(Literal::F64(_)))) {
        true => Err(Refusal::Double),
        false => Ok(()),
    }
}

fn computable(expression: &Expression, all: &naga::Arena<Expression>) -> Result<(), Refusal> {
    use MathFunction as M;
    match expression {
        Expression::Math { fun, .. } => match fun {
            M::Log | M::Log2 | M::Exp | M::Exp2 | M::Pow => Err(Refusal::Function(format!("{fun:?}").to_lowercase())),
            _ => Ok(()),
        },
        Expression::Binary { op, left, right } if compares(*op) && same(*left, *right, all) => Err(Refusal::NotANumber),
        _ => Ok(()),
    }
}

fn compares(op: BinaryOperator) -> bool {
    use BinaryOperator as B;
    matches!(op, B::Equal | B::NotEqual | B::Less | B::LessEqual | B::Greater | B::GreaterEqual)
}

/// Whether two expressions are written alike, as far as a test for NaN would be.
fn same(a: Handle<Expression>, b: Handle<Expression>, all: &naga::Arena<Expression>) -> bool {
    match (&all[a], &all[b]) {
        (Expression::Load { pointer: a }, Expression::Load { pointer: b }) => same(*a, *b, all),
        (Expression::Access { base: a, index: i }, Expression::Access { base: b, index: j }) => {
            same(*a, *b, all) && same(*i, *j, all)
        }
        (Expression::AccessIndex { base: a, index: i }, Expression::AccessIndex { base: b, index: j }) => {
            i == j && same(*a, *b, all)
        }
        (x, y) => a == b || x == y,
    }
}

fn bound(module: &Module, info: &ModuleInfo) -> Vec<Bound> {
    let entry = info.get_entry_point(0);
    let mut numbered: Vec<(u32, Bound)> = module
        .global_variables
        .iter()
        .filter_map(|(handle, variable)| {
            let binding = variable.binding.as_ref()?;
            assert_eq!(binding.group, 0, "all is bound in group 0");
            let written =
                matches!(variable.space, AddressSpace::Storage { access } if access.contains(StorageAccess::STORE));
            let bound = Bound {
                name: variable.name.clone().unwrap_or_default(),
                uniform: variable.space == AddressSpace::Uniform,
                written,
                used: !entry[handle].is_empty(),
            };
            Some((binding.binding, bound))
        })
        .collect();
    numbered.sort_by_key(|(number, _)| *number);
    assert!(numbered.iter().enumerate().all(|(i, (n, _))| i as u32 == *n), "bindings are numbered from 0");
    numbered.into_iter().map(|(_, bound)| bound).collect()
}

fn work_group(module: &Module, info: &ModuleInfo) -> Result<(), Refusal> {
    let name = &module.entry_points[0].name;
    let (module, _) = process_overrides(module, info, Some((ShaderStage::Compute, name)), &Default::default())
        .map_err(|e| Refusal::Invalid(e.to_string()))?;
    let invocations = module.entry_points[0].workgroup_size.iter().product();
    if invocations > WORK_GROUP {
        return Err(Refusal::WorkGroup(invocations));
    }
    let shared = module.global_variables.iter().filter(|(_, v)| v.space == AddressSpace::WorkGroup);
    let context: GlobalCtx = module.to_ctx();
    let bytes = shared.map(|(_, v)| module.types[v.ty].inner.size(context)).sum();
    if bytes > WORK_GROUP_BYTES {
        return Err(Refusal::WorkGroupBytes(bytes));
    }
    Ok(())
}
