//! Reference shapes: where an element's coordinates run, and the exact integrals of monomials there.

use num_traits::{One, Zero};

use crate::ir::Rational;

use super::polynomial::Polynomial;

/// A reference shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// -1 <= x <= 1.
    Segment,
    /// x, y >= 0, x + y <= 1.
    Triangle,
    /// -1 <= x, y <= 1.
    Quadrangle,
    /// x, y, z >= 0, x + y + z <= 1.
    Tetrahedron,
    /// -1 <= x, y, z <= 1.
    Hexahedron,
    /// A triangle in x, y times a segment in z.
    Prism,
}

/// Every shape, by its name in declarations.
pub const SHAPES: [(&str, Shape); 6] = [
    ("segment", Shape::Segment),
    ("triangle", Shape::Triangle),
    ("quadrangle", Shape::Quadrangle),
    ("tetrahedron", Shape::Tetrahedron),
    ("hexahedron", Shape::Hexahedron),
    ("prism", Shape::Prism),
];

impl Shape {
    /// Its name in declarations.
    pub fn name(self) -> &'static str {
        SHAPES.iter().find(|(_, shape)| *shape == self).expect("every shape has a name").0
    }

    /// How many coordinates it has.
    pub fn dimension(self) -> usize {
        match self {
            Shape::Segment => 1,
            Shape::Triangle | Shape::Quadrangle => 2,
            Shape::Tetrahedron | Shape::Hexahedron | Shape::Prism => 3,
        }
    }

    /// How many faces it has; edges in the plane.
    pub fn faces(self) -> usize {
        match self {
            Shape::Segment => 0,
            Shape::Triangle => 3,
            Shape::Quadrangle | Shape::Tetrahedron => 4,
            Shape::Prism => 5,
            Shape::Hexahedron => 6,
        }
    }

    /// The exact integral of a polynomial.
    pub fn integral(self, p: &Polynomial) -> Rational {
        p.terms().map(|(q, e)| q * self.monomial(e)).sum()
    }

    /// Length, area or volume.
    pub fn measure(self) -> Rational {
        self.monomial([0; 3])
    }

    fn monomial(self, [a, b, c]: [u32; 3]) -> Rational {
        // Over [-1, 1], and over a simplex: a! b! c! / (a + b + c + dimension)!.
        let segment = |n: u32| if n % 2 == 1 { Rational::zero() } else { Rational::new(2, i128::from(n) + 1) };
        let simplex = |exponents: &[u32]| {
            let product = exponents.iter().fold(Rational::one(), |product, n| product * factorial(*n));
            product / factorial(exponents.iter().sum::<u32>() + exponents.len() as u32)
        };
        match self {
            Shape::Segment => segment(a),
            Shape::Triangle => simplex(&[a, b]),
            Shape::Quadrangle => segment(a) * segment(b),
            Shape::Tetrahedron => simplex(&[a, b, c]),
            Shape::Hexahedron => segment(a) * segment(b) * segment(c),
            Shape::Prism => simplex(&[a, b]) * segment(c),
        }
    }

    /// Whether a point is inside or on the boundary.
    pub fn contains(self, [x, y, z]: [f64; 3]) -> bool {
        let between = |x: f64| (-1.0..=1.0).contains(&x);
        let triangle = x >= 0.0 && y >= 0.0 && x + y <= 1.0;
        match self {
            Shape::Segment => between(x),
            Shape::Triangle => triangle,
            Shape::Quadrangle => between(x) && between(y),
            Shape::Tetrahedron => x >= 0.0 && y >= 0.0 && z >= 0.0 && x + y + z <= 1.0,
            Shape::Hexahedron => between(x) && between(y) && between(z),
            Shape::Prism => triangle && between(z),
        }
    }
}

fn factorial(n: u32) -> Rational {
    Rational::from_integer((1..=i128::from(n)).product())
}
