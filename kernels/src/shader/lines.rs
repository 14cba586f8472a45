//! WGSL functions, line by line.

/// A function's text.
pub(super) struct Lines {
    pub text: String,
    depth: usize,
}

impl Lines {
    pub fn new(head: &str) -> Self {
        Self { text: format!("\n{head}\n"), depth: 1 }
    }

    /// A statement; the lines of a long one are set in as deep.
    pub fn line(&mut self, text: &str) {
        let indent = "    ".repeat(self.depth);
        for line in text.lines() {
            self.text += &format!("{indent}{line}\n");
        }
    }

    pub fn open(&mut self, head: &str) {
        self.line(head);
        self.depth += 1;
    }

    pub fn close(&mut self) {
        self.depth -= 1;
        self.line("}");
    }

    /// The whole function, which returns an array.
    pub fn returns(mut self, values: &[String]) -> String {
        self.line(&format!("return {};", array(values)));
        self.close();
        self.text
    }
}

/// The place of element e in block k of a buffer that has one entry an element in each block.
pub(super) fn row(k: usize) -> String {
    match k {
        0 => "e".to_string(),
        1 => "element_pass.elements + e".to_string(),
        _ => format!("{k}u * element_pass.elements + e"),
    }
}

/// An array's constructor, three values a line.
pub(super) fn array(values: &[String]) -> String {
    let lines: String = values.chunks(3).map(|line| format!("    {},\n", line.join(", "))).collect();
    format!("array<f32, {}>(\n{lines})", values.len())
}
