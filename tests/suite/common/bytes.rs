//! Bytes of a sampler that are changed word by word.

use fanlight::{LightSampler, LightSamplerView, Receiver, ShadingPoint};
use glam::Vec3;

use super::lights::aligned;
use super::pcg::Pcg32;

/// Rounds of samples at each receiver.
const ROUNDS: usize = 3;

/// Flips these bits of every word in turn: each change is refused when it is loaded, or does no harm to samples, densities and
/// photons. What is not changed comes back, and what is cut off is refused.
pub(crate) fn check_changes(lights: &LightSampler, flips: &[u32], place: Vec3, pcg: &mut Pcg32) {
    let words = aligned(&lights.to_bytes());
    let own = LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load");
    assert_eq!(own.to_bytes(), lights.to_bytes());
    let (mut refused, mut loaded) = (0, 0);
    for (at, flip) in (0..words.len()).flat_map(|at| flips.iter().map(move |flip| (at, flip))) {
        let mut changed = words.clone();
        changed[at] ^= flip;
        match LightSamplerView::from_bytes(bytemuck::cast_slice(&changed)) {
            Err(_) => refused += 1,
            Ok(view) => {
                loaded += 1;
                ask(&view, place, pcg);
            }
        }
    }
    assert!(refused > 200 && loaded > 200, "{refused} refused, {loaded} loaded");
    for end in 0..words.len() {
        assert!(LightSamplerView::from_bytes(bytemuck::cast_slice(&words[..end])).is_err());
    }
}

/// Asks for samples, densities and photons, which have to be numbers.
fn ask(view: &LightSamplerView<'_>, place: Vec3, pcg: &mut Pcg32) {
    let normal = pcg.direction();
    for receiver in [Receiver::Surface(normal), Receiver::Transmissive(normal), Receiver::Volume] {
        let at = view.at(&ShadingPoint::new(place, receiver));
        for _ in 0..ROUNDS {
            if let Some(sample) = at.sample(pcg.cube()) {
                let is_fine = sample.pdf > 0.0 && sample.pdf.is_finite() && sample.position.is_finite();
                assert!(is_fine && at.pdf_sample_direction(&sample) > 0.0, "{sample:?}");
            }
        }
        assert!(at.pdf_direction(pcg.direction()).is_finite());
    }
    for _ in 0..ROUNDS {
        if let Some(ray) = view.emission().sample(core::array::from_fn(|_| pcg.f32())) {
            assert!(ray.pdf > 0.0 && ray.pdf.is_finite() && ray.direction.is_finite(), "{ray:?}");
        }
    }
}
