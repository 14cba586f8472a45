//! Element passes over strips: three tetrahedra in a row, of which each shares three nodes with the one before.
//!
//! Four vectors and four sums at a time: after each tetrahedron the sum of its first node is complete, since no later one
//! has it, and goes to its slot; the next node takes its place. A strip reads six nodes and writes six slots where three
//! elements read and write twelve.

use super::element::Composed;
use super::lines::{Lines, array};
use crate::strip::{MEMBERS, NODES};

/// Nodes of an element.
const WINDOW: usize = NODES + 1 - MEMBERS;

impl Composed<'_> {
    /// The function that computes one strip. Its elements are apart by as many as there are strips.
    pub(super) fn one_strip(&self) -> String {
        let mut out = Lines::new("fn element(e: u32) {");
        let places = ["x", "y", "z", "w"];
        if self.gathers() {
            out.line("let nodes_before = nodes[e];");
            out.line("let nodes_after = nodes[element_pass.elements + e];");
        }
        for (name, _, of) in self.gathered() {
            for (k, place) in places.iter().enumerate() {
                out.line(&format!("var {name}_{k} = {of}[nodes_before.{place}];"));
            }
        }
        if self.slots() {
            (0..WINDOW - 1).for_each(|k| out.line(&format!("var f_{k} = vec3<f32>(0.0f, 0.0f, 0.0f);")));
            out.line(&format!("let slot = element_pass.first_slot + {NODES}u * e;"));
        }
        out.open(&format!("for (var q = 0u; q < {MEMBERS}u; q++) {{"));
        out.line("let member = e + q * element_pass.elements;");
        out.line("let at = e + 3u * q * element_pass.elements;");
        for (name, ..) in self.gathered() {
            let values: Vec<String> =
                (0..WINDOW).flat_map(|k| ["x", "y", "z"].map(|i| format!("{name}_{k}.{i}"))).collect();
            out.line(&format!("let nodal_{name} = {};", array(&values)));
        }
        self.read_constants("member", &mut out);
        self.point("at", &mut out);
        self.store("member", &mut out);
        if self.slots() {
            let f = |k: usize| format!("vec3<f32>(f[{}], f[{}], f[{}])", 3 * k, 3 * k + 1, 3 * k + 2);
            out.line(&format!("slots[slot + q] = vec4<f32>(f_0 + {}, 0.0f);", f(0)));
            (1..WINDOW - 1).for_each(|k| out.line(&format!("f_{} = f_{k} + {};", k - 1, f(k))));
            out.line(&format!("f_{} = {};", WINDOW - 2, f(WINDOW - 1)));
        }
        if self.gathers() {
            // After the last element nobody looks at the next node.
            out.line("let next = select(nodes_after.y, nodes_after.x, q == 0u);");
        }
        for (name, _, of) in self.gathered() {
            (1..WINDOW).for_each(|k| out.line(&format!("{name}_{} = {name}_{k};", k - 1)));
            out.line(&format!("{name}_{} = {of}[next];", WINDOW - 1));
        }
        out.close();
        if self.slots() {
            for k in 0..WINDOW - 1 {
                out.line(&format!("slots[slot + {}u] = vec4<f32>(f_{k}, 0.0f);", MEMBERS + k));
            }
        }
        out.close();
        out.text
    }
}
