//! A law's parameters as a scene gives them: names, lengths, ranges, directions, defaults, values for each element.

use tensormass_kernels::{LawEntry, ParameterInfo};

use crate::scene::{Material, Parameter, ParameterValue, PerElement, Scene, SceneError};

/// The values of all parameters of a material, in the law's units.
#[derive(Debug, Clone)]
pub struct Values {
    /// One row of all components, or one an element that the scene gives.
    pub rows: Vec<Vec<f64>>,
    /// Whether there is a row an element.
    pub per_element: bool,
    /// How many elements of the mesh are parts of each of these.
    pub parts: usize,
}

impl Values {
    /// The row of an element of the mesh.
    pub fn row(&self, element: u32) -> &[f64] {
        if self.per_element { &self.rows[element as usize / self.parts] } else { &self.rows[0] }
    }
}

/// Reads the parameters of material `index`, of a mesh of so many elements, each so many parts.
pub fn read(
    scene: &Scene,
    index: usize,
    material: &Material,
    law: &LawEntry,
    (elements, parts): (usize, usize),
) -> Result<Values, SceneError> {
    let base = format!("material.{index}");
    let names: Vec<&str> = law.info.parameters.iter().map(|p| p.name).collect();
    for name in material.parameters.keys() {
        if !names.contains(&name.as_str()) {
            return Err(SceneError::at(
                scene.locate_key(&format!("{base}.parameters.{name}")),
                format!("law `{}` has no parameter `{name}`", law.info.name),
                format!("its parameters are {}", names.join(", ")),
            ));
        }
    }
    let mut columns = Vec::new();
    for info in law.info.parameters {
        columns.push(column(scene, &base, material, law, info, (elements, parts))?);
    }
    let per_element = columns.iter().any(|c| c.len() > 1);
    let rows = if per_element { elements } else { 1 };
    let row = |e: usize| columns.iter().flat_map(|c| c[if c.len() > 1 { e } else { 0 }].iter().copied()).collect();
    Ok(Values { rows: (0..rows).map(row).collect(), per_element, parts })
}

/// The values of one parameter: one, or one an element.
fn column(
    scene: &Scene,
    base: &str,
    material: &Material,
    law: &LawEntry,
    info: &ParameterInfo,
    (elements, parts): (usize, usize),
) -> Result<Vec<Vec<f64>>, SceneError> {
    let path = format!("{base}.parameters.{}", info.name);
    let mut values = match material.parameters.get(info.name) {
        None => match info.default {
            Some(default) => return Ok(vec![default.to_vec()]),
            None => {
                return Err(SceneError::at(
                    scene.locate(&format!("{base}.parameters")),
                    format!("law `{}` needs the parameter `{}`", law.info.name, info.name),
                    format!("write {} = ..: {}{}", info.name, info.docs.trim().trim_end_matches('.'), unit(info)),
                ));
            }
        },
        Some(Parameter::Constant(value)) => vec![numbers(value)],
        Some(Parameter::PerElement { .. }) if !info.per_element => {
            return Err(SceneError::at(
                scene.locate(&path),
                format!("law `{}` does not take `{}` for each element", law.info.name, info.name),
                "give one value, or mark the parameter #[per_element] in the law file",
            ));
        }
        Some(Parameter::PerElement { per_element: PerElement::Values(values) }) => values.iter().map(numbers).collect(),
        Some(Parameter::PerElement { per_element: PerElement::File(file) }) => {
            table(scene, &format!("{path}.per_element"), &scene.resolve(file))?
        }
    };
    let many = matches!(material.parameters.get(info.name), Some(Parameter::PerElement { .. }));
    if many && values.len() != elements {
        return Err(SceneError::at(
            scene.locate(&path),
            format!("there are {} values for {elements} elements", values.len()),
            format!(
                "give one value for each element of the mesh, in the mesh's order{}",
                if parts > 1 { ", as it is before it is refined" } else { "" }
            ),
        ));
    }
    for (e, value) in values.iter_mut().enumerate() {
        let which = if many { format!(" of element {e}") } else { String::new() };
        if value.len() != info.len {
            return Err(SceneError::at(
                scene.locate(&path),
                format!(
                    "`{}`{which} has {} components, law `{}` takes {}",
                    info.name,
                    value.len(),
                    law.info.name,
                    info.len
                ),
                if info.len == 1 {
                    "write one number".to_string()
                } else {
                    format!("write an array of {} numbers", info.len)
                },
            ));
        }
        if info.direction {
            *value = unit_vector(value).ok_or_else(|| {
                // A file's rows have no place in the scene: the element is named.
                let place = if many { format!("{path}.per_element.{e}") } else { path.clone() };
                SceneError::at(
                    scene.locate(&place),
                    format!("`{}`{which} is {value:?}, which has no direction", info.name),
                    "give a vector that is not zero, such as [1, 0, 0]; its length does not matter",
                )
            })?;
            continue;
        }
        let (low, high) = info.range;
        if let Some(x) = value.iter().find(|x| !(low..=high).contains(*x)) {
            return Err(SceneError::at(
                scene.locate(&path),
                format!("`{}`{which} is {x}, outside the range of law `{}`", info.name, law.info.name),
                format!("choose a value from {low:?} to {high:?}{}", unit(info)),
            ));
        }
    }
    // One element's mesh and one value for it are the same thing; two rows tell a reader of `columns` that they vary.
    Ok(values)
}

/// The unit vector along a vector; `None` where that is zero or not finite.
fn unit_vector(vector: &[f64]) -> Option<Vec<f64>> {
    let largest = vector.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if largest == 0.0 || !vector.iter().all(|x| x.is_finite()) {
        return None;
    }
    // Squares of the components themselves may leave the range of numbers.
    let scaled: Vec<f64> = vector.iter().map(|x| x / largest).collect();
    let length = scaled.iter().map(|x| x * x).sum::<f64>().sqrt();
    Some(scaled.iter().map(|x| x / length).collect())
}

/// The unit in brackets, if there is one.
fn unit(info: &ParameterInfo) -> String {
    if info.unit == "1" { String::new() } else { format!(" ({})", info.unit) }
}

fn numbers(value: &ParameterValue) -> Vec<f64> {
    match value {
        ParameterValue::Number(x) => vec![*x],
        ParameterValue::Array(xs) => xs.clone(),
    }
}

/// Reads a table of numbers: one row an element, components by commas; blank lines and `#` comments are skipped.
fn table(scene: &Scene, path: &str, file: &std::path::Path) -> Result<Vec<Vec<f64>>, SceneError> {
    let text = std::fs::read_to_string(file).map_err(|e| {
        SceneError::at(
            scene.locate(path),
            format!("{} cannot be read: {e}", file.display()),
            "check the path; it is relative to the scene file",
        )
    })?;
    let mut rows = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        let row: Result<Vec<f64>, &str> =
            line.split(',').map(|w| w.trim().parse::<f64>().ok().filter(|x| x.is_finite()).ok_or(w.trim())).collect();
        rows.push(row.map_err(|word| {
            SceneError::at(
                scene.locate(path),
                format!("{}:{}: `{word}` is not a finite number", file.display(), i + 1),
                "write one row an element, numbers separated by commas",
            )
        })?);
    }
    Ok(rows)
}
