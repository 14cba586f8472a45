//! Obstacles from files: distances from surfaces of triangles and from their grids, steps that end outside, and what is refused.

use crate::support::contact::{self, CUBE, DISH, MESHES, falling, on_cpu};
use crate::support::{Random, outcome, repository};
use tensormass_runtime::contact::{Convex, Grid, Move, Nearest, Shape, Solid, Surface, meets, respond};
use tensormass_runtime::mesh::surface;
use tensormass_runtime::model::build;
use tensormass_runtime::simulate::Ending;

fn solid(file: &str, scale: f64, cells: u32) -> Solid {
    let read = surface::read(&repository(&format!("runtime/tests/data/{file}"))).unwrap_or_else(|e| panic!("{e}"));
    let vertices = read.vertices.iter().map(|x| x.map(|x| x * scale));
    Solid::new(vertices, read.triangles, cells).unwrap_or_else(|e| panic!("{e}"))
}

fn point(rng: &mut Random) -> [f64; 3] {
    std::array::from_fn(|_| 2.0 * rng.next())
}

fn along(x: [f64; 3], by: [f64; 3], t: f64) -> [f64; 3] {
    std::array::from_fn(|i| x[i] + t * by[i])
}

fn length(x: [f64; 3]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The distance from a dish of unit width by its two boxes: outside the least of what is above and below the brim, to compare
/// signs and places beside faces.
fn in_dish([x, y, z]: [f64; 3]) -> bool {
    let (wide, hollow) = (x.abs().max(y.abs()) < 0.5, x.abs().max(y.abs()) < 1.0 / 3.0);
    wide && z > -1.0 / 3.0 && z < 0.0 && !(hollow && z > -0.2)
}

/// A box of triangles is a box: distances to rounding, normals where there is one. Distances of any surface change by no more
/// than the way, their signs are those of the solid, and along the normal they go to 0.
#[test]
fn distances_are_those_of_the_surface() {
    let mut rng = Random(1);
    let (triangles, closed) = (solid("box.stl", 0.05, 16), Convex::Box { half: [0.5, 0.75, 0.4] });
    for _ in 0..5000 {
        let x = point(&mut rng);
        let (found, wanted): (Nearest<f64>, Nearest<f64>) = (triangles.nearest(x), closed.nearest(x));
        assert!((found.distance - wanted.distance).abs() < 1e-14, "{x:?}: {found:?} for {wanted:?}");
        // Inside, two sides may be as near.
        let turned = length(along(found.normal, wanted.normal, -1.0));
        assert!(found.distance < 0.0 || turned < 1e-8, "{x:?}: {found:?} for {wanted:?}");
    }
    for (file, scale) in [("dish.obj", 1.0 / 60.0), ("ball.obj", 0.7)] {
        let shape = solid(file, scale, 16);
        for _ in 0..5000 {
            let (x, y) = (point(&mut rng), point(&mut rng));
            let (Nearest { normal, distance }, other) = (shape.nearest(x), shape.nearest(y).distance);
            assert!((length(normal) - 1.0).abs() < 1e-14, "{file}, {x:?}: normal {normal:?}");
            let left = shape.nearest(along(x, normal, -distance)).distance;
            assert!(left.abs() < 1e-13, "{file}, {x:?}: {left:e} left of {distance:e} along the normal");
            assert!((distance - other).abs() <= length(along(y, x, -1.0)) + 1e-14, "{file}: {x:?} to {y:?}");
            match file {
                "dish.obj" => assert_eq!(distance < 0.0, in_dish(x), "{x:?}: {distance:e}"),
                // Triangles are inside the sphere by their height at most: .7 (1 - cos of 10.8 degrees).
                _ => assert!((-1e-6..0.0125).contains(&(distance - (length(x) - 0.7))), "{x:?}: {distance:e}"),
            }
        }
    }
}

/// Beside flat faces, by more than a cell from edges, distances on a grid are exact but for f32; elsewhere they are off by less
/// than half a cell. A finer grid is nearer to the surface, and says how near.
#[test]
fn grids_are_near_the_surface() {
    let mut rng = Random(3);
    for (file, scale) in [("box.stl", 0.05), ("dish.obj", 1.0 / 60.0), ("ball.obj", 0.7)] {
        let mut before = f64::INFINITY;
        for cells in [16, 32, 64] {
            let shape = solid(file, scale, cells);
            let grid = Grid::bake(&shape);
            for _ in 0..5000 {
                let x = point(&mut rng);
                let (found, wanted) = (grid.nearest(x), shape.nearest(x));
                assert!((length(found.normal) - 1.0).abs() < 1e-12, "{file}, {x:?}: {found:?}");
                let off = found.distance - wanted.distance;
                let near = wanted.distance.abs() < grid.cell();
                assert!(!near || off.abs() < 0.5 * grid.cell(), "{file}, {cells} cells, {x:?}: off by {off:e}");
                // Beyond the grid what it says is never more than the distance.
                assert!(off < 0.5 * grid.cell(), "{file}, {cells} cells, {x:?}: too far by {off:e}");
            }
            eprintln!("{file}, {cells} cells: off by {:.3} cells", grid.error() / grid.cell());
            assert!(
                grid.error() < before && grid.error() < 0.5 * grid.cell(),
                "{file}, {cells} cells: {}",
                grid.error()
            );
            before = grid.error();
        }
    }
    let shape = solid("box.stl", 0.05, 16);
    let grid = Grid::bake(&shape);
    for _ in 0..1000 {
        let x = [0.25 * rng.next(), 0.35 * rng.next(), 0.4 + 0.1 * rng.next()];
        let off = grid.nearest(x).distance - (x[2] - 0.4);
        assert!(off.abs() < 1e-6, "{x:?}: off by {off:e}");
    }
}

/// Any move from outside, taken through the surface as often as a step does: it ends outside, and no farther from where it began
/// than without contact; a path that goes through a thin wall is stopped before it.
#[test]
fn responses_keep_out() {
    let (mut rng, tolerance) = (Random(2), 1e-14);
    for (file, scale) in [("box.stl", 0.05), ("dish.obj", 1.0 / 60.0), ("ball.obj", 0.7)] {
        let solid = solid(file, scale, 32);
        for shape in [Shape::Grid(Grid::bake(&solid).into()), Shape::Solid(solid.into())] {
            let (mut met, mut inside) = (0, 0);
            for k in 0..6000 {
                let (from, by) = (point(&mut rng).map(|x| 0.5 * x), point(&mut rng));
                if shape.nearest(from).distance <= 0.0 {
                    continue;
                }
                let friction = [0.0, 0.3, 1e6][k % 3];
                let surface = Surface { sticking: friction, sliding: friction, tolerance };
                let mut after = by;
                for _ in 0..tensormass_runtime::contact::SWEEPS {
                    let node = Move { from, by: after };
                    let response =
                        respond(meets(|x| shape.nearest(x), shape.approach(), node, tolerance), node, surface);
                    after = std::array::from_fn(|i| after[i] + response.change[i] + response.push[i]);
                }
                let end = shape.nearest(along(from, after, 1.0)).distance;
                inside += usize::from(end < -1e-12);
                assert!(end > -0.05, "{file}: from {from:?} by {by:?} ends {end:e} inside");
                assert!(length(after) <= length(by) * (1.0 + 1e-12), "{file}: {by:?} became {after:?}");
                let enters = (1..=400)
                    .map(|k| shape.nearest(along(from, by, f64::from(k) / 400.0)).distance)
                    .any(|distance| distance < -0.01);
                if enters {
                    assert!(length(along(after, by, -1.0)) > 0.0, "{file}: from {from:?} by {by:?} goes through");
                    met += 1;
                }
            }
            eprintln!("{file}: {met} met, {inside} of them still inside");
            assert!(met > 100, "{file}: {met} met");
        }
    }
}

/// A cube that falls into a dish, turned so that it meets edges and corners of it, in explicit and implicit steps: no step ends
/// deeper than 4 roundings of the scene's size, and it comes to rest in the hollow.
#[test]
fn no_step_ends_inside() {
    for shape in MESHES.into_iter().chain([DISH]) {
        let scene = falling(CUBE, shape, "neo_hookean", "f64", 5e-5, 0.06);
        let (mut bench, mut touched) = (on_cpu::<f64>(&scene), 0);
        for step in 0..bench.steps {
            let [before, after] = bench.step();
            let gap = bench.gap();
            assert!(gap >= -4.0 * f64::EPSILON * bench.size, "{shape}, step {step}: {:e} deep", -gap / bench.size);
            assert!(after <= before * (1.0 + 1e-14), "{shape}, step {step}: {before:e} to {after:e}");
            touched += usize::from(after != before);
        }
        assert!(touched > 100, "{shape}: met in {touched} steps");
        let scene = falling(CUBE, shape, "neo_hookean", "f64", 1e-3, 0.1);
        let mut bench = contact::implicit(&scene);
        for step in 0..bench.steps {
            bench.step_whole();
            let gap = bench.gap();
            assert!(gap >= -4.0 * f64::EPSILON * bench.size, "{shape}, implicit {step}: {:e} deep", -gap / bench.size);
        }
    }
}

/// A box of triangles does what a box does: probes of whole runs to 1e-9.
#[test]
fn a_box_of_triangles_is_a_box() {
    let run = |shape: &str| {
        let outcome = outcome(&falling(CUBE, shape, "neo_hookean", "f64", 1e-4, 0.06));
        assert_eq!(outcome.ending, Ending::Done, "{}", outcome.summary["error"]);
        outcome.probes
    };
    let (found, wanted) = (run(MESHES[0]), run(contact::BELOW[2]));
    for ((name, _, value), (_, _, wanted)) in found.iter().zip(&wanted) {
        assert!((value - wanted).abs() <= 1e-9 * wanted.abs(), "{name}: {value:e} for {wanted:e}");
    }
}

/// Surfaces that are none, each with its message.
#[test]
fn wrong_surfaces_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    let sides = ["f 1 3 2\n", "f 1 2 4\n", "f 1 4 3\n", "f 2 3 4\n"];
    let cases = [
        ("right.obj", format!("{corners}{}", sides.concat()), ""),
        ("open.obj", format!("{corners}{}", sides[..3].concat()), "it is not closed: 3 sides of triangles"),
        ("mixed.obj", format!("{corners}{}f 2 4 3\n", sides[..3].concat()), "it is not closed: 6 sides"),
        (
            "inward.obj",
            corners.to_string() + "f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n",
            "its triangles turn clockwise seen from outside",
        ),
        ("empty.obj", corners.to_string(), "it has no triangles"),
        ("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\nf 1 3 2\n".to_string(), "has no area"),
        ("infinite.obj", "v inf 0 0\nv 1 0 0\nv 2 1 0\nf 1 2 3\n".to_string(), "which is not finite"),
        ("torn.obj", corners.to_string() + "f 1 2 9\n", "is not a whole OBJ file: face vertex index out of bounds"),
        ("torn.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0".to_string(), "is not a whole STL file"),
        ("short.stl", format!("{}\x02\0\0\0{}", "\0".repeat(80), "\0".repeat(50)), "is not a whole STL file"),
        ("named.ply", "ply".to_string(), "is neither an STL nor an OBJ file by its name"),
    ];
    for (name, text, wanted) in cases {
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("written");
        let found = surface::read(&path).err().map_or_else(String::new, |e| e.to_string());
        let shown = path.display().to_string();
        assert!(found.contains(wanted) && (wanted.is_empty() || found.contains(&shown)), "{name}: {found}");
        assert_eq!(found.is_empty(), wanted.is_empty(), "{name}: {found}");
    }
    let missing = surface::read(&folder.path().join("missing.stl")).expect_err("it is missing").to_string();
    assert!(missing.contains("cannot be read") && missing.contains("relative to the scene file"), "{missing}");
}

/// A solid inside the body at the start is refused where it is given, with the place.
#[test]
fn solids_start_outside() {
    let inside = MESHES[0].replace("0.001,", "0.0001,").replace("-0.01]", "0.008]");
    let scene = falling(CUBE, &inside, "neo_hookean", "f64", 1e-4, 0.06);
    let refused = build(&scene).expect_err("it is inside").to_string();
    assert!(refused.contains("`obstacle.0` is inside the body at the start: a vertex of it is at"), "{refused}");
}
