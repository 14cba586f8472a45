//! What no schema can say of a scene: keys that exclude each other, unique names, increasing times, step and duration.

use super::document::{Document, Node};
use super::error::{Location, SceneError};
use super::model::{Boundary, History, Load, Mesh, Motion, Parameter, ParameterValue, PerElement, Ramp, SceneData};
use super::obstacle::{Angle, Friction, Obstacle, Rotate};
use super::shape::written;
use super::solver::{Integrator, Mass, Solver};

/// Steps of a run, at most.
const MOST_STEPS: f64 = 1e9;

/// Cells of a beam, at most: 6e8 tetrahedra, which no machine this is made for can hold.
const MOST_CELLS: u64 = 100_000_000;

/// Checks the scene's data; the document says where a value was written.
pub(super) fn check(data: &SceneData, document: &Document) -> Result<(), SceneError> {
    let context = Context { document };
    context.mesh(&data.mesh)?;
    let materials = data.material.iter().map(|material| material.name.as_deref());
    context.unique("material", materials)?;
    for (i, material) in data.material.iter().enumerate() {
        for (name, parameter) in &material.parameters {
            context.uniform(parameter, &format!("material.{i}.parameters.{name}"))?;
        }
    }
    for (i, boundary) in data.boundary.iter().enumerate() {
        context.boundary(boundary, &format!("boundary.{i}"))?;
    }
    for (i, load) in data.load.iter().enumerate() {
        context.load(load, &format!("load.{i}"))?;
    }
    context.unique("obstacle", data.obstacle.iter().map(|obstacle| obstacle.name.as_deref()))?;
    for (i, obstacle) in data.obstacle.iter().enumerate() {
        context.obstacle(obstacle, &format!("obstacle.{i}"))?;
    }
    context.solver(&data.solver)?;
    context.moves_without_end(data)?;
    context.unique("probe", data.probe.iter().map(|probe| Some(probe.name())))?;
    if data.output.frames.is_some() && data.output.every.is_some() {
        return Err(context.later("output", ["frames", "every"]));
    }
    context.repeated(&data.output.fields, "output.fields")
}

/// What is said to no effect.
pub(super) fn warnings(data: &SceneData, document: &Document) -> Vec<String> {
    let solver = &data.solver;
    let explicit = solver.integrator.is_explicit();
    let still = solver.integrator == Integrator::Static;
    let given = |key: &str| document.root.child("solver").and_then(|solver| solver.child(key)).is_some();
    let mut warnings = Vec::new();
    for key in ["cg", "newton"] {
        if explicit && given(key) {
            warnings.push(format!("solver.{key} has no effect: the integrator is explicit"));
        }
    }
    for (key, value) in [("mass_damping", solver.mass_damping), ("stiffness_damping", solver.stiffness_damping)] {
        if still && value != 0.0 {
            warnings.push(format!("solver.{key} has no effect: static equilibrium has no motion"));
        }
    }
    if still && solver.mass != Mass::Lumped {
        warnings.push("solver.mass has no effect: static equilibrium has no inertia".to_owned());
    }
    for (key, value) in [("velocity", data.initial.velocity), ("angular_velocity", data.initial.angular_velocity)] {
        if still && value != [0.0; 3] {
            warnings.push(format!("initial.{key} has no effect: static equilibrium has no motion"));
        }
    }
    if data.initial.about.is_some() && data.initial.gradient == [[0.0; 3]; 3] {
        warnings.push("initial.about has no effect: initial.gradient is zero".to_owned());
    }
    warnings
}

struct Context<'d> {
    document: &'d Document,
}

impl Context<'_> {
    fn place(&self, path: &str) -> Location {
        self.document.at(self.document.find(path))
    }

    /// Two keys of one table that exclude each other: the place of the one that an override added, or else of the
    /// one that stands last.
    fn later(&self, table: &str, keys: [&str; 2]) -> SceneError {
        let rank = |node: &&Node| (self.document.at_key(node).is_override(), node.key.start);
        let holder = self.document.find(table);
        let entry = keys.iter().filter_map(|key| holder.child(key)).max_by_key(rank).unwrap_or(holder);
        let reason = format!("`{table}` has both `{}` and `{}`", keys[0], keys[1]);
        SceneError::at(self.document.at_key(entry), reason, "leave out one of the two")
    }

    fn mesh(&self, mesh: &Mesh) -> Result<(), SceneError> {
        // Each is at most 10000, so the product fits.
        let (path, counts) = match mesh {
            Mesh::Beam { beam } => ("mesh.beam.cells", beam.cells),
            Mesh::Torus { torus } => ("mesh.torus.around", [torus.across, torus.across, torus.around]),
            Mesh::File { .. } => return Ok(()),
        };
        let cells: u64 = counts.iter().map(|&count| u64::from(count)).product();
        if cells <= MOST_CELLS {
            return Ok(());
        }
        let reason = format!("these are {cells} cells, more than {MOST_CELLS}");
        Err(SceneError::at(self.place(path), reason, "make the cells larger"))
    }

    fn unique<'n>(&self, list: &str, names: impl Iterator<Item = Option<&'n str>>) -> Result<(), SceneError> {
        let names: Vec<_> = names.collect();
        for (i, name) in names.iter().enumerate() {
            let first = names[..i].iter().position(|earlier| name.is_some() && earlier == name);
            if let (Some(first), Some(name)) = (first, name) {
                return Err(SceneError::at(
                    self.place(&format!("{list}.{i}.name")),
                    format!("the name \"{name}\" is already that of `{list}.{first}`"),
                    format!("give each {list} a name of its own"),
                ));
            }
        }
        Ok(())
    }

    fn repeated<T: PartialEq>(&self, values: &[T], path: &str) -> Result<(), SceneError> {
        for (i, value) in values.iter().enumerate() {
            if values[..i].contains(value) {
                let reason = format!("`{path}` names this twice");
                return Err(SceneError::at(self.place(&format!("{path}.{i}")), reason, "leave it out"));
            }
        }
        Ok(())
    }

    /// Values for each element are all numbers, or all arrays of one length.
    fn uniform(&self, parameter: &Parameter, path: &str) -> Result<(), SceneError> {
        let Parameter::PerElement { per_element: PerElement::Values(values) } = parameter else { return Ok(()) };
        let length = |value: &ParameterValue| match value {
            ParameterValue::Number(_) => None,
            ParameterValue::Array(numbers) => Some(numbers.len()),
        };
        match values.iter().position(|value| length(value) != length(&values[0])) {
            None => Ok(()),
            Some(i) => Err(SceneError::at(
                self.place(&format!("{path}.per_element.{i}")),
                format!("`{path}.per_element.{i}` is not of the same kind as the first value"),
                "write numbers only, or arrays of one length only",
            )),
        }
    }

    fn boundary(&self, boundary: &Boundary, path: &str) -> Result<(), SceneError> {
        match boundary {
            Boundary::Fixed { fix, .. } => self.repeated(fix, &format!("{path}.fix")),
            Boundary::Moved { motion, .. } => self.motion(motion, &format!("{path}.move")),
            Boundary::Turned { rotate, .. } => self.turn(rotate, &format!("{path}.rotate")),
        }
    }

    fn motion(&self, motion: &Motion, path: &str) -> Result<(), SceneError> {
        let axes = [("x", &motion.x), ("y", &motion.y), ("z", &motion.z)];
        if axes.iter().all(|(_, history)| history.is_none()) {
            return Err(SceneError::at(
                self.place(path),
                format!("`{path}` moves nothing"),
                "give a history for x, y or z, for example { x = { velocity = 0.1 } }",
            ));
        }
        axes.iter().try_for_each(|(axis, history)| match history {
            Some(History::Ramp(ramp)) => self.ramp(ramp, &format!("{path}.{axis}.ramp")),
            Some(History::Velocity(_)) | None => Ok(()),
        })
    }

    fn obstacle(&self, obstacle: &Obstacle, path: &str) -> Result<(), SceneError> {
        if let Friction::Each { sticking, sliding } = obstacle.friction
            && sliding > sticking
        {
            return Err(SceneError::at(
                self.place(&format!("{path}.friction.kinetic")),
                format!("`{path}.friction` has a kinetic coefficient {sliding} above the static one {sticking}"),
                "what slides is held less than what sticks: exchange the two, or write one number for both",
            ));
        }
        if let Some(motion) = &obstacle.translation {
            self.motion(motion, &format!("{path}.move"))?;
        }
        obstacle.rotate.as_ref().map_or(Ok(()), |turn| self.turn(turn, &format!("{path}.rotate")))
    }

    fn turn(&self, turn: &Rotate, path: &str) -> Result<(), SceneError> {
        if turn.axis == [0.0; 3] {
            let reason = format!("`{path}.axis` has no direction");
            return Err(SceneError::at(
                self.place(&format!("{path}.axis")),
                reason,
                "give a vector whose length is not 0",
            ));
        }
        match &turn.angle {
            Angle::Ramp(ramp) => self.ramp(ramp, &format!("{path}.angle.ramp")),
            Angle::Velocity(_) => Ok(()),
        }
    }

    fn load(&self, load: &Load, path: &str) -> Result<(), SceneError> {
        let ramp = match load {
            Load::Gravity { ramp, .. } | Load::Traction { ramp, .. } | Load::Pressure { ramp, .. } => ramp,
            Load::Force { value, total, ramp, .. } => {
                match (value, total) {
                    (Some(_), Some(_)) => return Err(self.later(path, ["value", "total"])),
                    (None, None) => {
                        return Err(SceneError::at(
                            self.place(path),
                            format!("`{path}` has none of the keys `value` and `total`"),
                            "write value = [..] for the force at every node or total = [..] for all of them together, in N",
                        ));
                    }
                    (Some(_), None) | (None, Some(_)) => {}
                }
                ramp
            }
        };
        ramp.as_ref().map_or(Ok(()), |ramp| self.ramp(ramp, &format!("{path}.ramp")))
    }

    fn ramp(&self, ramp: &Ramp, path: &str) -> Result<(), SceneError> {
        let rows = ramp.rows();
        match rows.windows(2).position(|pair| pair[1][0] <= pair[0][0]) {
            None => Ok(()),
            Some(i) => Err(SceneError::at(
                self.place(&format!("{path}.{}.0", i + 1)),
                format!(
                    "the times of `{path}` must increase, but {} s follows {} s",
                    written(rows[i + 1][0]),
                    written(rows[i][0])
                ),
                "order the rows [time in s, value] by time, each time once",
            )),
        }
    }

    fn solver(&self, solver: &Solver) -> Result<(), SceneError> {
        let missing = |key: &str, about: &str| {
            let reason = format!("`solver` has no key `{key}`");
            Err(SceneError::at(self.place("solver"), reason, format!("write {key} = ..: {about}")))
        };
        let (step, duration) = match (solver.integrator, solver.step, solver.duration) {
            (_, Some(step), Some(duration)) => (step, duration),
            (Integrator::Static, None, _) => return Ok(()),
            (_, _, None) => return missing("duration", "simulated time in s, above 0."),
            (_, None, Some(_)) => return missing("step", "time step in s, above 0."),
        };
        if solver.mass == Mass::Consistent && solver.integrator.is_explicit() {
            let reason = "explicit integrators divide by masses, and consistent ones are a matrix";
            let remedy = "choose mass = \"lumped\", or integrator = \"implicit-euler\"";
            return Err(SceneError::at(self.place("solver.mass"), reason, remedy));
        }
        if step > duration {
            return Err(SceneError::at(
                self.place("solver.step"),
                format!("`solver.step` is {} s, longer than the duration {} s", written(step), written(duration)),
                "shorten the step or lengthen solver.duration",
            ));
        }
        if duration / step > MOST_STEPS {
            return Err(SceneError::at(
                self.place("solver.step"),
                format!("{} s in steps of {} s are more than 1e9 steps", written(duration), written(step)),
                "lengthen the step or shorten solver.duration",
            ));
        }
        Ok(())
    }

    /// A velocity needs a time at which it has led somewhere.
    fn moves_without_end(&self, data: &SceneData) -> Result<(), SceneError> {
        if data.solver.duration.is_some() {
            return Ok(());
        }
        for (i, boundary) in data.boundary.iter().enumerate() {
            let endless = match boundary {
                Boundary::Moved { motion, .. } => [("x", &motion.x), ("y", &motion.y), ("z", &motion.z)]
                    .into_iter()
                    .find(|(_, history)| matches!(history, Some(History::Velocity(_))))
                    .map(|(axis, _)| format!("move.{axis}.velocity")),
                Boundary::Turned { rotate: Rotate { angle: Angle::Velocity(_), .. }, .. } => {
                    Some("rotate.angle.velocity".to_owned())
                }
                Boundary::Turned { .. } | Boundary::Fixed { .. } => None,
            };
            if let Some(key) = endless {
                return Err(SceneError::at(
                    self.place(&format!("boundary.{i}.{key}")),
                    "a velocity leads nowhere without a duration",
                    "give solver.duration, or a ramp",
                ));
            }
        }
        Ok(())
    }
}
