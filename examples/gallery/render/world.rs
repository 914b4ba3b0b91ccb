//! Everything that light meets on its way: surfaces, fog and the sky.

use super::alloc::sync::Arc;

use glam::Vec3;

use super::bsdf::Bsdf;
use super::lamp::Lamp;
use super::material::Material;
use super::model::{Fog, Model};
use super::scene::{Point, Scene};
use super::sky::Sky;

/// A scene under a sky.
pub(crate) struct World {
    pub(crate) scene: Scene,
    sky: Option<Arc<Sky>>,
    emits: bool,
    lamps: Vec<Lamp>,
    /// Those of them that rays find by chance.
    caps: Vec<usize>,
    pub(crate) fog: Option<Fog>,
}

/// Light that reaches a place without being scattered on the way.
pub(crate) struct Arrival {
    pub(crate) radiance: Vec3,
    /// The emitter that it comes from; `None` for the sky.
    pub(crate) from: Option<Point>,
}

impl World {
    /// Copies the surfaces of a model.
    pub(crate) fn new(model: &Model) -> Self {
        let emits = model.materials.iter().any(Material::emits);
        let caps = (0..model.lamps.len()).filter(|&lamp| model.lamps[lamp].cap().is_some()).collect();
        Self {
            scene: Scene::new(model),
            sky: model.sky.clone(),
            emits,
            lamps: model.lamps.clone(),
            caps,
            fog: model.fog,
        }
    }

    /// The first solid surface along a ray, and what passes the panes and the fog before it.
    pub(crate) fn trace(&self, origin: Vec3, direction: Vec3) -> (Vec3, Option<Point>) {
        let (passed, end) = self.scene.trace(origin, direction);
        let distance = end.map_or(f32::INFINITY, |point| point.distance);
        (passed * self.passes_fog(origin, direction, distance), end)
    }

    /// What passes from a point to another one.
    pub(crate) fn passes(&self, from: Vec3, to: Vec3) -> Vec3 {
        let distance = from.distance(to);
        let direction = (to - from) / distance;
        let passed = self.scene.passes(from, direction, distance);
        if passed == Vec3::ZERO { passed } else { passed * self.passes_fog(from, direction, distance) }
    }

    /// Light that arrives from a direction, from the sky or an emitter.
    pub(crate) fn arriving(&self, origin: Vec3, direction: Vec3) -> Arrival {
        if !self.emits {
            return self.arriving_from_sky(origin, direction);
        }
        let (passed, from) = self.trace(origin, direction);
        let radiance = passed * self.light(from.as_ref(), direction);
        Arrival { radiance, from }
    }

    /// Light of the sky that arrives from a direction: zero if anything solid is in the way.
    pub(crate) fn arriving_from_sky(&self, origin: Vec3, direction: Vec3) -> Arrival {
        let mut radiance = self.scene.passes(origin, direction, f32::INFINITY);
        if radiance != Vec3::ZERO {
            radiance *= self.passes_fog(origin, direction, f32::INFINITY) * self.light(None, direction);
        }
        Arrival { radiance, from: None }
    }

    /// Irradiance by the lamp of that number on what faces it: zero if anything solid is in the way.
    pub(crate) fn arriving_from_lamp(&self, lamp: usize, at: Vec3) -> Vec3 {
        let Some(lamp) = self.lamps.get(lamp) else { return Vec3::ZERO };
        let irradiance = lamp.irradiance(at);
        if irradiance == Vec3::ZERO {
            return irradiance;
        }
        let (direction, distance) = lamp.towards(at);
        let passed = self.scene.passes(at, direction, distance);
        if passed == Vec3::ZERO { passed } else { irradiance * passed * self.passes_fog(at, direction, distance) }
    }

    /// Light that leaves the end of a ray towards its start.
    pub(crate) fn light(&self, end: Option<&Point>, direction: Vec3) -> Vec3 {
        match end {
            None => {
                let sky = self.sky.as_ref().map_or(Vec3::ZERO, |sky| sky.radiance(direction));
                self.caps.iter().fold(sky, |sum, &lamp| sum + self.lamps[lamp].radiance(direction))
            }
            Some(point) => {
                let material = self.scene.material(point);
                if !material.emits() || !(point.front || material.two_sided) {
                    return Vec3::ZERO;
                }
                let emission = material.emission_at(self.scene.bitmaps(), point.emission_uv);
                if material.unlit { emission * point.tint } else { emission }
            }
        }
    }

    /// Whether there is light from outside.
    pub(crate) const fn has_sky(&self) -> bool {
        self.sky.is_some()
    }

    /// How a surface scatters light to where a ray that goes in a direction came from.
    pub(crate) fn bsdf(&self, point: &Point, direction: Vec3) -> Bsdf {
        let material = self.scene.material(point);
        let color = point.tint * material.color_at(self.scene.bitmaps(), point.uv);
        Bsdf::new(material.lobe, color, point.normal, -direction)
    }

    fn passes_fog(&self, origin: Vec3, direction: Vec3, distance: f32) -> f32 {
        self.fog.map_or(1.0, |fog| {
            let [enter, leave] = fog.span(origin, direction, distance);
            (-fog.density * (leave - enter)).exp()
        })
    }
}

impl Fog {
    /// Where a ray enters and leaves it, up to a distance.
    pub(crate) fn span(&self, origin: Vec3, direction: Vec3, distance: f32) -> [f32; 2] {
        let (a, b) = ((self.low - origin) / direction, (self.high - origin) / direction);
        let enter = a.min(b).max_element().max(0.0);
        [enter, a.max(b).min_element().min(distance).max(enter)]
    }
}
