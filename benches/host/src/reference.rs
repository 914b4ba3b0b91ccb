//! References by the competitors' techniques alone.

use std::fs;
use std::path::{Path, PathBuf};

use crate::Error;
use crate::args::Args;
use crate::clock::thread_seconds;
use crate::error::Reference;
use crate::file::{read_exr, write_exr};
use crate::film::Film;
use crate::methods::Method;
use crate::random::Pcg32;
use crate::world::World;

/// How many times longer than an image a reference is rendered: with less its own noise, which is estimated and
/// subtracted, is a larger part of the errors. *Format* of the workload.
const EFFORT: f64 = 64.0;
/// Version of the integrator; a reference of another one is rendered again.
const VERSION: u32 = 1;

/// Returns a reference that is not known from elsewhere: the one of an earlier run if it is good enough, or a new one.
pub(crate) fn compute(scene: &str, world: &World, bounces: u32, args: &Args) -> Result<Reference, Error> {
    let seconds = (EFFORT * args.seconds).max(args.reference);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/host");
    let image = folder.join(format!("{scene}_{bounces}.exr"));
    let notes = image.with_extension("json");
    if let Some(noise) = known(&notes, world, seconds)
        && let Ok(image) = read_exr(&image)
    {
        return Ok(Reference::new(image, noise));
    }
    eprintln!("{scene}, {bounces} bounces: rendering a reference for {seconds:.0} s of CPU time");
    let film = render(world, bounces, seconds, args.threads);
    let reference = Reference::from_film(&film);
    fs::create_dir_all(&folder)?;
    write_exr(&image, reference.image())?;
    let note = serde_json::json!({
        "version": VERSION,
        "fingerprint": format!("{:016x}", world.fingerprint()),
        "seconds": seconds,
        "samples": film.samples(),
        "noise": reference.noise(),
    });
    fs::write(&notes, format!("{note:#}\n"))?;
    eprintln!("  {} samples a pixel, own noise {:.1e}", film.samples(), reference.noise());
    Ok(reference)
}

/// Returns the noise of an earlier run's reference, if it is of this scene and took long enough.
fn known(notes: &PathBuf, world: &World, seconds: f64) -> Option<f64> {
    let note: serde_json::Value = serde_json::from_str(&fs::read_to_string(notes).ok()?).ok()?;
    let is_same = note["version"].as_u64()? == u64::from(VERSION)
        && note["fingerprint"].as_str()? == format!("{:016x}", world.fingerprint())
        && note["seconds"].as_f64()? >= seconds;
    is_same.then(|| note["noise"].as_f64())?
}

/// Renders with all techniques of the competitors together.
fn render(world: &World, bounces: u32, seconds: f64, threads: usize) -> Film {
    let method = Method::for_reference(world);
    let share = seconds / threads as f64;
    let work = |thread: usize| {
        let start = thread_seconds();
        let mut film = Film::new();
        let mut random = Pcg32::new(thread as u64, 2000);
        while thread_seconds() - start < share {
            method.render_pass(world, bounces, &mut random, &mut film);
        }
        film
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|thread| scope.spawn(move || work(thread))).collect();
        let mut sum = Film::new();
        for film in workers.into_iter().filter_map(|worker| worker.join().ok()) {
            sum.add(&film);
        }
        sum
    })
}
