//! Light sampling for renderers: textured mesh lights and light portals of any shape.
//!
//! A renderer passes in its emissive meshes, its openings (windows, lattices, clip-mapped cards, lantern paper), their
//! textures and its environment map. At every shading point it then gets a direction that is worth tracing, and the
//! density of any other direction. The method is *Generalized Light Portals* (Ogaki, HPG 2020).
//!
//! # Example
//!
//! A lamp with a texture. The lower half of the texture is dark, so that samples go to the upper half.
//!
//! ```
//! use fanlight::{Filter, LightSampler, Mesh, ShadingPoint, Texture, Weight};
//! use glam::{Vec2, Vec3};
//!
//! let positions = [[-1.0, -1.0, 3.0], [-1.0, 1.0, 3.0], [1.0, 1.0, 3.0], [1.0, -1.0, 3.0]].map(Vec3::from);
//! let uvs = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]].map(Vec2::from);
//! let luminance = [0.0, 8.0];
//!
//! let mut builder = LightSampler::builder();
//! let texture = builder.add_texture(Texture::new(1, 2, &luminance)?.filter(Filter::Nearest));
//! let lights = builder
//!     .mesh(&Mesh::emitter(&positions, &[[0, 1, 2], [0, 2, 3]]).uvs(&uvs).weight(Weight::Texture(texture)))?
//!     .build()?;
//!
//! let here = lights.at(&ShadingPoint::surface(Vec3::ZERO, Vec3::Z));
//! let sample = here.sample([0.2, 0.7, 0.4]).expect("the lamp is above the floor");
//! // Cells along the edge reach a little across it.
//! assert!(sample.position.y > -0.04);
//! // The same density, if a ray had hit the lamp by chance.
//! let hit = sample.hit().expect("the lamp is a triangle");
//! assert!((here.pdf(&hit) / sample.pdf - 1.0).abs() < 1e-5);
//! # Ok::<(), fanlight::Error>(())
//! ```
//!
//! # How to use it
//!
//! 1. Start with [`LightSampler::builder`], add the [`Environment`], the [`Texture`]s or [`Procedural`]s and the
//!    [`Mesh`]es, and build. Everything is checked here: what a builder accepted can always be sampled. Options and
//!    lights chain into one expression; in loops, [`add_texture`](LightSamplerBuilder::add_texture) and
//!    [`add_mesh`](LightSamplerBuilder::add_mesh) return a [`TextureId`] and a [`MeshId`].
//! 2. Call [`LightSampler::at`] with a [`ShadingPoint`]. It returns the [`PointSampler`] that answers all calls at that
//!    point.
//! 3. Call [`sample`](PointSampler::sample) with three random numbers and trace a ray. `None` is a sample of zero:
//!    divide by the number of samples requested, not by the number returned.
//! 4. Divide by the density that belongs to what was evaluated:
//!
//! | what the ray brings back | density |
//! | --- | --- |
//! | everything that arrives along the direction, whatever it crosses | [`pdf_sample_direction`](PointSampler::pdf_sample_direction) |
//! | the light of the sampled point alone, if nothing hides it | [`LightSample::pdf`] |
//! | everything that arrives along a direction from elsewhere (a BSDF, a path guide) | [`pdf_direction`](PointSampler::pdf_direction) |
//! | the light of one point that was hit, and no other | [`pdf`](PointSampler::pdf) |
//!
//! The first and the third belong together in multiple importance sampling, and so do the second and the fourth. A
//! portal does not end a ray: where a second portal may lie on the way, use the first and the third.
//!
//! Lights that are not made of triangles are in the same tree: [`SphereLight`], [`DiskLight`], [`TubeLight`], and
//! without an extent [`PointLight`], [`SpotLight`] and [`ProfileLight`]. [`DistantLight`]s are in no tree and compete
//! with it.
//! [`add_light`](LightSamplerBuilder::add_light) takes all of them and returns a [`LightId`].
//!
//! A mesh that a scene holds many times is built once: [`add_object`](LightSamplerBuilder::add_object) takes the meshes,
//! and [`add_instance`](LightSamplerBuilder::add_instance) places them by any affine map ([`Instance`]).
//!
//! For motion blur, a mesh or an instance has a position at the end of the shutter interval ([`Mesh::moving_to`],
//! [`Instance::moving_to`]), and a shading point has a time ([`ShadingPoint::at_time`]); all densities are those of that
//! time.
//!
//! Photons start with [`LightSampler::emission`]. In participating media, [`LightSampler::along`] chooses a distance
//! along a ray.
//!
//! Portals that cover only a part of what the environment shows need a partner that reaches the rest: combine them with
//! BSDF samples, or with [`Environment::sample`], or make the environment a light
//! ([`environment_as_light`](LightSamplerBuilder::environment_as_light)). Then a sample may be a direction of it
//! ([`SampledLight`]), and [`pdf_environment`](PointSampler::pdf_environment) is the density of a ray that leaves a
//! scene without portals.
//!
//! The [`guide`] goes through the integration into a renderer, and has a table of mistakes and what they look like.
//!
//! # Scope and goals
//!
//! The crate chooses points on lights, and it computes the densities of its choices. Its goals, in this order:
//!
//! - **Unbiased.** The density is above zero wherever something can arrive: an average over texels may be small, but it
//!   is zero only if all of them are black. Where nothing can arrive, the density is exactly zero.
//! - **Safe for any input.** Bad input is an [`Error`] that names the mesh, the element and the value. Sampling never
//!   panics and never returns NaN or infinity. The only unsafe code is in one module: it selects vector instructions,
//!   prefetches memory and, without `std`, takes square roots.
//! - **Low noise, then speed.** You pay only for what the scene has.
//! - **Readable.** `docs/ARCHITECTURE.md` explains the algorithm before the code.
//!
//! Out of scope:
//!
//! - intersecting the host's scene, and visibility. (Rays are intersected with lights only, for the density of a
//!   direction. What a host finds out about visibility can be learned: [`Visibility`].)
//! - color. All weights are scalars, by which samples are placed; what a sample carries is up to the host.
//! - evaluating a BSDF or a phase function. Samples follow the lobe that the host describes; the host evaluates its own
//!   function.
//! - reading image or scene files.
//! - replacing the environment, objects or profiles of a built sampler. The environment can be rotated; lights,
//!   meshes and instances can be added, removed and changed ([`edit`](LightSampler::edit),
//!   [`refit`](LightSampler::refit)).
//! - running on a GPU. The buffers are plain data and can be uploaded, but there are no shaders here.
//!
//! # Units and measures
//!
//! Lengths are in any unit, as long as it is the same everywhere; coordinates go up to 1e9. The weight of an emitter is
//! its radiance, the weight of a portal its transmittance, and the environment holds radiance. Radiance is in any unit
//! too, but in the same unit for emitters and environment, because they compete for samples. The weight of a light
//! without an extent is its radiant intensity: radiance times the square of the unit of length. The weight of a
//! [`DistantLight`] is its irradiance on a surface that faces it.
//!
//! Densities are per solid angle at the shading point (1/sr) unless their name or their documentation says per area of
//! the light. `pmf` is a probability, without a unit.
//!
//! Directions point away from the shading point. The front of a triangle is the side from which its vertices run
//! counter-clockwise; light leaves from the front only, unless the mesh has [`Sides::Two`]. The front of a portal faces
//! the room.
//!
//! Random numbers are uniform in `[0, 1)`. Well-stratified numbers give well-stratified samples.
//!
//! # Features
//!
//! - `std` (default): floating-point functions from the standard library.
//! - `libm`: floating-point functions from the `libm` crate. One of the two is required; with both, `std` is used.
//! - `rayon`: parallel builds, with the same result for any number of threads.
//!
//! # Without `std`
//!
//! The crate is `no_std` and depends on `alloc`. Building and loading allocate; sampling never does.
//! ([`sample_split`](PointSampler::sample_split) extends a collection of the caller, which may allocate.)
//! [`LightSamplerView`] borrows all of its data: a sampler can be written with [`to_bytes`](LightSampler::to_bytes),
//! mapped from a file, and read with [`from_bytes`](LightSamplerView::from_bytes) without a copy.

#![no_std]

extern crate alloc;
#[cfg(any(feature = "std", test))]
extern crate std;

mod blas;
mod bounds;
mod buffers;
mod env;
mod error;
mod geometry;
mod light;
mod math;
mod parallel;
mod progress;
mod receiver;
mod record;
mod sampler;
mod simd;
mod technique;
#[cfg(test)]
mod testing;
mod tlas;
mod visibility;
mod warp;

/// The example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

#[cfg(any(doc, doctest))]
#[doc = include_str!("../docs/INTEGRATION.md")]
pub mod guide {}

pub use blas::{Procedural, Texture};
pub use env::{Environment, EnvironmentImage, EnvironmentSample, EnvironmentView, Poles};
pub use error::Error;
/// The vectors of the interface.
pub use glam;
pub use light::{
    DiskLight, DistantLight, Illumination, Instance, Lamp, Mesh, MeshUpdate, PointLight, Profile, ProfileLight,
    Projection, Sides, SphereLight, SpotLight, TubeLight, Weight,
};
pub use receiver::{Effort, Glossy, Microfacet, Receiver, Scattering, ShadingPoint};
pub use record::{
    Filter, Hit, InstanceId, LightId, LightSample, MeshId, ObjectId, ProfileId, SampledLight, TextureId, TriangleId,
    Wrap,
};
pub use sampler::{
    ByteSizes, Emission, EmissionSample, LightEdits, LightSampler, LightSamplerBuilder, LightSamplerView, PointSampler,
    RaySegment, ResampledLight, SegmentSample, SegmentSampler, VisibilityCounters, VisibilityLearner,
};
pub use tlas::{Arity, Splitting};
pub use visibility::{Visibility, VisibilityView};
