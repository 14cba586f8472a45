//! Selections: which nodes, faces or elements an entry of a scene speaks of.

use super::predicate::{ExpressionError, Predicate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize, Serializer};

/// An axis-parallel box, such as the bounding box of a body at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundingBox {
    /// Least coordinates in m.
    pub min: [f64; 3],
    /// Greatest coordinates in m.
    pub max: [f64; 3],
}

impl BoundingBox {
    /// The smallest box around some points in m; `None` if there are none.
    pub fn around(points: impl IntoIterator<Item = [f64; 3]>) -> Option<Self> {
        points.into_iter().fold(None, |found, point| {
            let Self { mut min, mut max } = found.unwrap_or(Self { min: point, max: point });
            for i in 0..3 {
                min[i] = min[i].min(point[i]);
                max[i] = max[i].max(point[i]);
            }
            Some(Self { min, max })
        })
    }

    /// Length of the diagonal in m.
    pub fn diagonal(&self) -> f64 {
        (0..3).map(|i| (self.max[i] - self.min[i]).powi(2)).sum::<f64>().sqrt()
    }
}

/// A set of nodes, of faces or of elements, given by their positions at rest or by the name of a group of the mesh.
///
/// In a scene it is a string, `"all"`, `"group:NAME"` or a condition such as `"near(x, xmin) && y < 0.5"`; or one of
/// the tables `{ box = { min = [..], max = [..] } }`, `{ group = "NAME" }`, `{ where = "condition" }`.
/// For faces and elements the position is the centroid.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(try_from = "Spec")]
pub struct Selection {
    kind: SelectionKind,
}

/// The ways to select.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum SelectionKind {
    /// Everything.
    #[default]
    All,
    /// The members of a group of the mesh file.
    Group(String),
    /// Positions inside a box or on its surface.
    Box(BoundingBox),
    /// Positions for which a condition holds.
    Where(Predicate),
}

impl Selection {
    /// Reads the string form.
    ///
    /// # Errors
    /// Where and why the text is not a selection.
    pub fn parse(text: &str) -> Result<Self, ExpressionError> {
        let trimmed = text.trim();
        let kind = match trimmed.strip_prefix("group:") {
            _ if trimmed == "all" => SelectionKind::All,
            Some(group) => {
                let group = group.trim();
                if group.is_empty() {
                    return Err(ExpressionError::new(
                        0..text.len(),
                        "the group has no name",
                        "write \"group:NAME\" with a group of the mesh file",
                    ));
                }
                SelectionKind::Group(group.to_owned())
            }
            None => SelectionKind::Where(Predicate::parse(text)?),
        };
        Ok(Self { kind })
    }

    /// How it selects.
    pub fn kind(&self) -> &SelectionKind {
        &self.kind
    }

    /// Whether a position at rest (m) in a body with this bounding box is selected. A group has no geometry: nothing
    /// matches it here, see [`Selection::select`].
    pub fn matches(&self, point: [f64; 3], bbox: &BoundingBox) -> bool {
        match &self.kind {
            SelectionKind::All => true,
            SelectionKind::Group(_) => false,
            SelectionKind::Box(inside) => (0..3).all(|i| inside.min[i] <= point[i] && point[i] <= inside.max[i]),
            SelectionKind::Where(predicate) => predicate.holds(point, bbox),
        }
    }

    /// Indices of the selected points, in increasing order. `group` gives the members of a group by its name; the
    /// result is `None` where it knows no such group.
    pub fn select(
        &self,
        points: &[[f64; 3]],
        bbox: &BoundingBox,
        group: impl FnOnce(&str) -> Option<Vec<usize>>,
    ) -> Option<Vec<usize>> {
        match &self.kind {
            SelectionKind::Group(name) => group(name).map(|mut members| {
                members.sort_unstable();
                members.dedup();
                members
            }),
            SelectionKind::All | SelectionKind::Box(_) | SelectionKind::Where(_) => {
                Some((0..points.len()).filter(|&i| self.matches(points[i], bbox)).collect())
            }
        }
    }
}

/// How a selection is written; only serde sees it.
#[derive(Deserialize)]
#[serde(untagged)]
enum Spec {
    Text(String),
    Table(SpecTable),
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum SpecTable {
    Box(SpecBox),
    Group(String),
    Where(String),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SpecBox {
    min: [f64; 3],
    max: [f64; 3],
}

impl TryFrom<Spec> for Selection {
    type Error = ExpressionError;

    fn try_from(spec: Spec) -> Result<Self, Self::Error> {
        let kind = match spec {
            Spec::Text(text) => return Self::parse(&text),
            Spec::Table(SpecTable::Box(SpecBox { min, max })) => SelectionKind::Box(BoundingBox { min, max }),
            Spec::Table(SpecTable::Group(group)) => SelectionKind::Group(group),
            Spec::Table(SpecTable::Where(text)) => SelectionKind::Where(Predicate::parse(&text)?),
        };
        Ok(Self { kind })
    }
}

impl Serialize for Selection {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.kind {
            SelectionKind::All => serializer.serialize_str("all"),
            SelectionKind::Group(group) => serializer.serialize_str(&format!("group:{group}")),
            SelectionKind::Box(BoundingBox { min, max }) => {
                serde_json::json!({ "box": { "min": min, "max": max } }).serialize(serializer)
            }
            SelectionKind::Where(predicate) => serializer.serialize_str(predicate.text()),
        }
    }
}

/// `format` of a string that [`Selection::parse`] must accept.
pub(super) const TEXT_FORMAT: &str = "tensormass-selection";
/// `format` of a string that [`Predicate::parse`] must accept.
pub(super) const CONDITION_FORMAT: &str = "tensormass-condition";
/// `format` of a table whose `min` must not be above its `max`.
pub(super) const BOX_FORMAT: &str = "tensormass-box";

impl JsonSchema for Selection {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Selection".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let corner = |description: &str| {
            serde_json::json!({
                "description": description,
                "type": "array",
                "items": { "type": "number", "minimum": -1e9, "maximum": 1e9 },
                "minItems": 3,
                "maxItems": 3
            })
        };
        let table = |key: &str, description: &str, schema: serde_json::Value| {
            serde_json::json!({
                "description": description,
                "type": "object",
                "properties": { key: schema },
                "required": [key],
                "additionalProperties": false
            })
        };
        schemars::json_schema!({
            "description": "Nodes, faces or elements, by their position at rest (faces and elements: the centroid) or by a \
                            group of the mesh.",
            "oneOf": [
                {
                    "description": "\"all\", \"group:NAME\", or a condition on x, y, z, xmin, xmax, ymin, ymax, zmin, zmax in m.",
                    "type": "string",
                    "format": TEXT_FORMAT
                },
                table("box", "Positions inside a box or on its surface.", serde_json::json!({
                    "description": "The box by two opposite corners.",
                    "type": "object",
                    "format": BOX_FORMAT,
                    "properties": {
                        "min": corner("Least x, y, z in m, each within +-1e9."),
                        "max": corner("Greatest x, y, z in m, each within +-1e9.")
                    },
                    "required": ["min", "max"],
                    "additionalProperties": false
                })),
                table("group", "The members of a group of the mesh.", serde_json::json!({
                    "description": "The group's name.", "type": "string", "minLength": 1
                })),
                table("where", "Positions for which a condition holds.", serde_json::json!({
                    "description": "A condition on x, y, z, xmin, xmax, ymin, ymax, zmin, zmax in m.",
                    "type": "string", "format": CONDITION_FORMAT
                }))
            ]
        })
    }
}
