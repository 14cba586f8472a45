//! Lists the element declarations of `elements/`, so that another element is one file.

use std::path::Path;
use std::{env, fs};

fn main() {
    println!("cargo::rerun-if-changed=elements");
    let root = env::var("CARGO_MANIFEST_DIR").expect("cargo tells the folder of the package");
    let folder = Path::new(&root).join("elements");
    let mut files: Vec<_> = fs::read_dir(&folder)
        .expect("the package has a folder of elements")
        .map(|entry| entry.expect("its entries can be read").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    files.sort();
    let mut list = String::from("&[\n");
    for path in files {
        let name = path.file_stem().and_then(|stem| stem.to_str()).expect("a name in UTF-8");
        let file = format!("/elements/{name}.toml");
        // No absolute path: a target folder may serve a copy of the workspace elsewhere.
        list += &format!("    ({name:?}, include_str!(concat!(env!(\"CARGO_MANIFEST_DIR\"), {file:?}))),\n");
    }
    list += "]\n";
    let out = env::var("OUT_DIR").expect("cargo tells where to write");
    fs::write(Path::new(&out).join("elements.rs"), list).expect("the folder for output can be written");
}
