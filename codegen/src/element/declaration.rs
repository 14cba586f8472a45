//! Element declarations: data, one file each in `elements/`, read and checked against what every element must be.

use num_traits::{One, Signed, Zero};
use serde::Deserialize;

use crate::ir::{Number, Rational};

use super::ElementError;
use super::fine;
use super::polynomial::{self, Polynomial};
use super::rank;
use super::shape::{SHAPES, Shape};

/// An element, as data.
#[derive(Debug, Clone)]
pub struct ElementDeclaration {
    /// Its name, a snake_case identifier: the file's.
    pub name: String,
    /// What it is, for the reader.
    pub docs: String,
    /// Where its functions are from.
    pub source: String,
    /// Where its coordinates run.
    pub shape: Shape,
    /// Polynomials up to this order are reproduced.
    pub order: u32,
    /// Reference coordinates of the nodes; those beyond the shape's dimension are 0.
    pub nodes: Vec<[Rational; 3]>,
    /// Interpolation functions Lambda_j, one a node.
    pub functions: Vec<Polynomial>,
    /// How functions over the element are integrated.
    pub quadrature: Quadrature,
    /// How products of its functions are integrated, which its masses are.
    pub mass_rule: Quadrature,
    /// The part of the element's mass that each node bears where masses are lumped: positive, and 1 in all.
    pub lumping: Vec<Rational>,
    /// VTK's cell type, and which node stands at each of its places.
    pub vtk: Numbering,
    /// Gmsh's element type, and which node stands at each of its places.
    pub gmsh: Numbering,
    /// The faces, whose normals by the right-hand rule point outwards; in the plane, edges that run counter-clockwise.
    pub faces: Vec<Face>,
}

/// A quadrature rule.
#[derive(Debug, Clone, PartialEq)]
pub struct Quadrature {
    /// Polynomials up to this degree are integrated exactly.
    pub degree: u32,
    /// Reference coordinates.
    pub points: Vec<[f64; 3]>,
    /// Positive weights, which sum to the shape's measure.
    pub weights: Vec<f64>,
}

/// An element type of another program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Numbering {
    /// Its number there.
    pub kind: u32,
    /// The node that stands at each place.
    pub order: Vec<usize>,
}

/// A face: an element of one dimension less.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Face {
    /// The element that the face is.
    pub element: String,
    /// Its nodes among those of the whole.
    pub nodes: Vec<usize>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    docs: String,
    source: String,
    shape: String,
    order: u32,
    nodes: Vec<String>,
    functions: Vec<String>,
    lumping: Lumping,
    quadrature: Rule,
    vtk: Numbered,
    gmsh: Numbered,
    #[serde(default)]
    faces: Vec<Face>,
}

/// How a lumped mass is divided among the nodes.
#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Lumping {
    /// Rows of the consistent mass are summed: the integrals of the functions.
    RowSum,
    /// The consistent mass's diagonal, scaled to the whole (Hinton, Rock & Zienkiewicz 1976): always positive.
    Diagonal,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Rule {
    degree: u32,
    points: Vec<String>,
    weights: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Numbered {
    r#type: u32,
    order: Option<Vec<usize>>,
}

impl ElementDeclaration {
    /// Reads and checks a declaration; its faces are checked against the elements that they are by
    /// [`ElementDeclaration::check_faces`].
    ///
    /// # Errors
    /// [`ElementError::Declaration`]: what the text lacks, or what the element is not.
    pub fn parse(name: &str, text: &str) -> Result<Self, ElementError> {
        let refuse = |reason: String| ElementError::Declaration { element: name.to_string(), reason };
        let file: File = toml::from_str(text).map_err(|e| refuse(e.to_string().trim_end().to_string()))?;
        let shape = SHAPES.iter().find(|(shape, _)| *shape == file.shape).map(|(_, shape)| *shape);
        let shape = shape.ok_or_else(|| {
            let known = SHAPES.map(|(shape, _)| format!("`{shape}`")).join(", ");
            refuse(format!("there is no shape `{}`; the shapes are {known}", file.shape))
        })?;
        let nodes =
            file.nodes.iter().map(|t| three(polynomial::rationals(t)?, shape, t)).collect::<Result<Vec<_>, _>>();
        let nodes = nodes.map_err(refuse)?;
        let functions = file.functions.iter().map(|t| Polynomial::parse(t)).collect::<Result<Vec<_>, _>>();
        let functions = functions.map_err(refuse)?;
        let points = file.quadrature.points.iter().map(|t| three(polynomial::numbers(t)?, shape, t));
        let points = points.collect::<Result<Vec<_>, _>>().map_err(refuse)?;
        let weights = file.quadrature.weights.iter().map(|t| polynomial::numbers(t)).collect::<Result<Vec<_>, _>>();
        let weights = weights.map_err(refuse)?.concat();
        let quadrature = Quadrature { degree: file.quadrature.degree, points, weights };
        let numbering = |n: Numbered| {
            let order = n.order.unwrap_or_else(|| (0..nodes.len()).collect());
            Numbering { kind: n.r#type, order }
        };
        let (vtk, gmsh) = (numbering(file.vtk), numbering(file.gmsh));
        let lumping = lumped(&file.lumping, shape, &functions);
        let element = Self {
            name: name.to_string(),
            docs: file.docs,
            source: file.source,
            shape,
            order: file.order,
            nodes,
            functions,
            quadrature,
            mass_rule: fine::rule(shape),
            lumping,
            vtk,
            gmsh,
            faces: file.faces,
        };
        element.check().map_err(refuse)?;
        Ok(element)
    }

    /// What holds of every element by itself.
    fn check(&self) -> Result<(), String> {
        let n = self.nodes.len();
        if self.functions.len() != n {
            return Err(format!("it has {n} nodes and {} interpolation functions", self.functions.len()));
        }
        let outside = |e: &[u32; 3]| (self.shape.dimension()..3).any(|k| e[k] > 0);
        if let Some(j) = self.functions.iter().position(|f| f.terms().any(|(_, e)| outside(&e))) {
            return Err(format!("the function of node {j} reads a coordinate that the shape does not have"));
        }
        let inside = |x: &[Rational; 3]| self.shape.contains(x.map(f64::from_rational));
        if let Some(j) = self.nodes.iter().position(|x| !inside(x)) {
            return Err(format!("node {j} is outside the shape"));
        }
        for p in monomials(self.shape.dimension(), self.order) {
            let interpolated = self.nodes.iter().zip(&self.functions).map(|(x, f)| f.times(p.at(x)));
            let interpolated = interpolated.fold(Polynomial::default(), |sum, f| sum.plus(&f));
            if interpolated != p {
                return Err(match p.as_constant() {
                    Some(_) => "its interpolation functions do not sum to 1".into(),
                    None => format!("a polynomial of order {} is not reproduced", degree(&p)),
                });
            }
        }
        for (j, f) in self.functions.iter().enumerate() {
            for (i, x) in self.nodes.iter().enumerate() {
                let wanted = if i == j { Rational::one() } else { Rational::zero() };
                if f.at(x) != wanted {
                    return Err(format!("the function of node {j} is {} at node {i}, not {wanted}", f.at(x)));
                }
            }
        }
        self.check_quadrature()?;
        if self.lumping.iter().any(|part| !part.is_positive()) {
            return Err("a node bears no or a negative lumped mass; declare `lumping = \"diagonal\"`".into());
        }
        for (name, numbering) in [("vtk", &self.vtk), ("gmsh", &self.gmsh)] {
            let mut order = numbering.order.clone();
            order.sort_unstable();
            if order != (0..n).collect::<Vec<_>>() {
                return Err(format!("its {name} order does not name each of its {n} nodes once"));
            }
        }
        if self.faces.len() != self.shape.faces() {
            return Err(format!("it has {} faces, its shape {}", self.faces.len(), self.shape.faces()));
        }
        Ok(())
    }

    fn check_quadrature(&self) -> Result<(), String> {
        let Quadrature { degree, points, weights } = &self.quadrature;
        if points.len() != weights.len() || points.is_empty() {
            return Err(format!("its quadrature has {} points and {} weights", points.len(), weights.len()));
        }
        if points.iter().any(|x| !self.shape.contains(*x)) || weights.iter().any(|w| *w <= 0.0) {
            return Err("a quadrature point is outside the shape, or a weight is not positive".into());
        }
        let measure = f64::from_rational(self.shape.measure());
        // A term is a product of some tens of rounded factors at most, each below 1 in magnitude.
        let allowed = 64.0 * f64::EPSILON * measure;
        for p in monomials(self.shape.dimension(), *degree) {
            let sum: f64 = points.iter().zip(weights).map(|(x, w)| w * p.at_f64(x)).sum();
            let exact = f64::from_rational(self.shape.integral(&p));
            if (sum - exact).abs() > allowed {
                return Err(format!("its quadrature is not exact for polynomials of degree {}", self::degree(&p)));
            }
        }
        self.check_masses(allowed)?;
        match rank::hourglass_modes(self) {
            0 => Ok(()),
            free => Err(format!(
                "{free} motions that are not rigid have no strain at its {} quadrature points (hourglass modes): declare a \
                 rule of more points",
                points.len()
            )),
        }
    }

    /// Whether products of functions are integrated exactly.
    fn check_masses(&self, allowed: f64) -> Result<(), String> {
        let Quadrature { points, weights, .. } = &self.mass_rule;
        let values: Vec<Vec<f64>> =
            points.iter().map(|x| self.functions.iter().map(|f| f.at_f64(x)).collect()).collect();
        for (i, f) in self.functions.iter().enumerate() {
            for (j, g) in self.functions.iter().enumerate().take(i + 1) {
                let sum: f64 = values.iter().zip(weights).map(|(v, w)| w * v[i] * v[j]).sum();
                if (sum - f64::from_rational(self.shape.integral(&f.product(g)))).abs() > allowed {
                    return Err("products of its functions are of too high a degree for the rule of masses".into());
                }
            }
        }
        Ok(())
    }

    /// The faces against the elements that they are: each function restricted to a face is the face's function of that node,
    /// or 0; and the faces close the element, with their normals outwards.
    ///
    /// # Errors
    /// [`ElementError::Declaration`] with the face.
    pub fn check_faces(&self, all: &[Self]) -> Result<(), ElementError> {
        let refuse = |reason: String| ElementError::Declaration { element: self.name.clone(), reason };
        let (mut flux, mut area) = (Rational::zero(), [Rational::zero(); 3]);
        let count = Rational::from_integer(self.nodes.len() as i128);
        let middle: [Rational; 3] = std::array::from_fn(|i| self.nodes.iter().map(|x| x[i]).sum::<Rational>() / count);
        for (k, face) in self.faces.iter().enumerate() {
            let Some(element) = all.iter().find(|e| e.name == face.element) else {
                return Err(refuse(format!("face {k} is an element `{}`, which is not declared", face.element)));
            };
            if element.nodes.len() != face.nodes.len() || face.nodes.iter().any(|j| *j >= self.nodes.len()) {
                let wanted = element.nodes.len();
                return Err(refuse(format!("face {k} does not name {wanted} nodes of the element")));
            }
            // X as a function of the face's coordinates.
            let place: [Polynomial; 3] = std::array::from_fn(|i| {
                let parts = face.nodes.iter().zip(&element.functions).map(|(j, f)| f.times(self.nodes[*j][i]));
                parts.fold(Polynomial::default(), |sum, f| sum.plus(&f))
            });
            for (j, function) in self.functions.iter().enumerate() {
                let restricted = composed(function, &place);
                let at = face.nodes.iter().position(|n| *n == j);
                if restricted != at.map_or(Polynomial::default(), |at| element.functions[at].clone()) {
                    return Err(refuse(format!(
                        "on face {k} the function of node {j} is not that of `{}`",
                        face.element
                    )));
                }
            }
            let normal = normal(&place, self.shape.dimension());
            let integral = |p: &Polynomial| element.shape.integral(p);
            let through = (0..3).fold(Rational::zero(), |sum, i| {
                let from_middle = place[i].plus(&Polynomial::constant(-middle[i]));
                sum + integral(&from_middle.product(&normal[i]))
            });
            if !through.is_positive() {
                return Err(refuse(format!("the normal of face {k} points inwards")));
            }
            flux += through;
            (0..3).for_each(|i| area[i] += integral(&normal[i]));
        }
        // The integral of n is 0, and that of X . n the volume times the dimension.
        let wanted = self.shape.measure() * Rational::from_integer(self.shape.dimension() as i128);
        if !self.faces.is_empty() && (flux != wanted || area.iter().any(|a| !a.is_zero())) {
            return Err(refuse("its faces do not enclose it".into()));
        }
        Ok(())
    }
}

/// n dA of a face, dX/dx x dX/dy; in the plane n ds of an edge, (dY/dx, -dX/dx).
fn normal(place: &[Polynomial; 3], dimension: usize) -> [Polynomial; 3] {
    let minus = |p: &Polynomial| p.times(-Rational::one());
    let [a, b] = [0, 1].map(|k| place.each_ref().map(|x| x.derivative(k)));
    if dimension == 2 {
        return [a[1].clone(), minus(&a[0]), Polynomial::default()];
    }
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j].product(&b[k]).plus(&minus(&a[k].product(&b[j])))
    })
}

/// A polynomial with polynomials for its coordinates.
fn composed(p: &Polynomial, place: &[Polynomial; 3]) -> Polynomial {
    p.terms().fold(Polynomial::default(), |sum, (q, e)| {
        let term = (0..3).fold(Polynomial::constant(q), |product, k| {
            (0..e[k]).fold(product, |product, _| product.product(&place[k]))
        });
        sum.plus(&term)
    })
}

/// Each node's part of the mass.
fn lumped(lumping: &Lumping, shape: Shape, functions: &[Polynomial]) -> Vec<Rational> {
    let weight = |f: &Polynomial| match lumping {
        Lumping::RowSum => shape.integral(f),
        Lumping::Diagonal => shape.integral(&f.product(f)),
    };
    let weights: Vec<Rational> = functions.iter().map(weight).collect();
    let whole: Rational = weights.iter().sum();
    weights.into_iter().map(|w| if whole.is_zero() { whole } else { w / whole }).collect()
}

/// All monomials up to a degree, in the coordinates of a shape.
fn monomials(dimension: usize, degree: u32) -> Vec<Polynomial> {
    let most = |k: usize| if k < dimension { degree } else { 0 };
    let mut all = vec![];
    for a in 0..=most(0) {
        for b in 0..=most(1) {
            for c in 0..=most(2) {
                if a + b + c <= degree {
                    all.push(Polynomial::monomial(Rational::one(), [a, b, c]));
                }
            }
        }
    }
    all
}

fn degree(p: &Polynomial) -> u32 {
    p.terms().map(|(_, e)| e.iter().sum()).max().unwrap_or(0)
}

/// The coordinates of a shape's dimension, and 0 for the others.
fn three<T: Clone + Zero>(mut x: Vec<T>, shape: Shape, text: &str) -> Result<[T; 3], String> {
    if x.len() != shape.dimension() {
        return Err(format!("`{text}` has {} coordinates, the shape {}", x.len(), shape.dimension()));
    }
    x.resize(3, T::zero());
    x.try_into().map_err(|_| "three coordinates were made".into())
}
