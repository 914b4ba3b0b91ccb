//! Renders a gallery of scenes without and with `fanlight` in the same time, and scenes from glTF files.
//!
//! `cargo run --release -p fanlight-gallery -- --help` lists the options. The renderer is in `render`; what it takes to
//! give it `fanlight`'s samplers is in `render/lighting.rs`, and what it takes to guide photons in
//! `studies/emission.rs`. [`plain`] is what other programs read scene files with.

mod arguments;
mod gltf;
mod ies;
pub mod plain;
mod render;
mod report;
mod scenes;
#[path = "../room/start.rs"]
mod start;
mod studies;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use arguments::{Arguments, Task};
use image::RgbImage;
use render::{Camera, Daylight, Error, Illumination, Image, Lights, Model, Sky, read_rgb, write_rgb};
use report::{Comparison, Effort, Picture};
use scenes::Scene;

/// Where pictures go if nothing else is said.
const FOLDER: &str = "docs/gallery";

/// Does what the command line asks for.
pub fn main() -> ExitCode {
    start::start(Arguments::parse(), arguments::HELP, run)
}

fn run(arguments: &Arguments) -> Result<(), Error> {
    let folder = arguments.output.clone().unwrap_or_else(|| PathBuf::from(FOLDER));
    match &arguments.task {
        Task::Export(folder) => export(folder),
        Task::File(path) => render_file(path, arguments),
        Task::All => {
            let mut pairs = Vec::new();
            for scene in &scenes::ALL {
                pairs.push((scene.name, render_scene(scene, &folder, arguments)?));
            }
            report::save(&report::contact_sheet(&pairs), &folder.join("contact.png"))
        }
        Task::Contact => {
            let path = |scene: &Scene| folder.join(scene.name).with_extension("png");
            let there = scenes::ALL.iter().filter(|scene| path(scene).exists());
            let pairs = there.map(|scene| Ok((scene.name, report::images_of(&path(scene))?)));
            report::save(
                &report::contact_sheet(&pairs.collect::<Result<Vec<_>, Error>>()?),
                &folder.join("contact.png"),
            )
        }
        Task::Scene(name) => {
            let known = || scenes::ALL.map(|scene| scene.name).join(", ");
            let scene = scenes::ALL.iter().find(|scene| scene.name == name);
            let scene = scene.ok_or_else(|| format!("there is no scene `{name}`, but {}", known()))?;
            render_scene(scene, &folder, arguments).map(drop)
        }
    }
}

fn effort(arguments: &Arguments) -> Effort {
    Effort { budget: arguments.budget, seed: arguments.seed, images: arguments.images }
}

/// Renders a built-in scene, and writes its picture. Returns the two images of it.
fn render_scene(scene: &Scene, folder: &Path, arguments: &Arguments) -> Result<[RgbImage; 2], Error> {
    let mut model = (scene.model)();
    resize(&mut model, arguments);
    let comparison = studies::study(scene, &model, effort(arguments))?;
    write(&comparison, scene.detail, &folder.join(scene.name).with_extension("png"), arguments)
}

fn render_file(path: &Path, arguments: &Arguments) -> Result<(), Error> {
    let sky = match &arguments.environment {
        Some(path) if path.as_os_str() == "none" => None,
        Some(path) => Some(Sky::new(read_rgb(path)?)),
        None => Some(Daylight::new().draw()),
    };
    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let prefixes = gltf::Prefixes { portals: &arguments.portal_prefix, panes: arguments.panes.as_deref() };
    let read = || gltf::read(&std::fs::read(path)?, path.parent(), prefixes, sky, gltf::Limits::RENDERABLE);
    let gltf::Read { mut model, notes, contents } =
        read().map_err(|error| format!("cannot read {}: {error}", path.display()))?;
    if let Some([from, to]) = arguments.camera {
        model.camera = Camera::looking(from, to, 60.0);
    }
    for note in notes {
        eprintln!("note: {note}");
    }
    for line in contents.iter().take(if arguments.lists { contents.len() } else { 2 }) {
        println!("{line}");
    }
    match Lights::new(&model, Illumination::default()) {
        Ok(lights) => println!("{}", lights.described()),
        Err(error) => eprintln!("note: fanlight refuses its lights: {error}"),
    }
    if arguments.lists {
        return Ok(());
    }
    resize(&mut model, arguments);
    let comparison = studies::without_and_with(&name, &model, &arguments.bounces, effort(arguments))?;
    let picture = arguments.output.clone().unwrap_or_else(|| path.with_extension("png"));
    write(&comparison, [0.5, 0.5], &picture, arguments).map(drop)
}

fn resize(model: &mut Model, arguments: &Arguments) {
    if let Some(size) = arguments.size {
        model.camera = model.camera.sized(size);
    }
}

/// Writes what a comparison came to: the image of the best competitor next to that with `fanlight`.
fn write(
    comparison: &Comparison,
    detail: [f32; 2],
    path: &Path,
    arguments: &Arguments,
) -> Result<[RgbImage; 2], Error> {
    let Comparison { images, shown, reference, seen } = comparison;
    let [Some(without), Some(with)] = shown.map(|i| images.get(i)) else { return Err("nothing was rendered".into()) };
    let [first, last, best] = [without, with, reference.image()].map(|image| sum(image, seen));
    let picture = Picture::exposed_by(reference.image());
    report::save(&picture.pair([&first, &last], &best, detail), path)?;
    if let Some(path) = &arguments.exr {
        write_rgb(path, &last)?;
    }
    Ok([&first, &last].map(|image| picture.develop(image)))
}

/// Writes all built-in scenes as glTF.
fn export(folder: &Path) -> Result<(), Error> {
    for scene in &scenes::ALL {
        let path = gltf::write(folder, scene.name, &(scene.model)())?;
        println!("{}", path.display());
    }
    Ok(())
}

fn sum(a: &Image, b: &Image) -> Image {
    let pixels = a.pixels.iter().zip(&b.pixels).map(|(a, b)| a + b).collect();
    Image { pixels, ..*a }
}
