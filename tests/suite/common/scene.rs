//! Scenes as plain descriptions, from which a sampler is built and an oracle computes.

use fanlight::{
    Arity, Effort, Environment, Filter, Glossy, Illumination, LightSampler, LightSamplerBuilder, Mesh, Microfacet,
    Receiver, Scattering, ShadingPoint, Sides, Texture, Weight, Wrap,
};
use glam::{Mat3, Vec2, Vec3};

use super::pcg::Pcg32;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Paint {
    Constant(f32),
    Image(usize),
}

#[derive(Clone, Debug)]
pub(crate) struct Image {
    pub(crate) size: [usize; 2],
    pub(crate) texels: Vec<f32>,
    pub(crate) filter: Filter,
    pub(crate) wrap: [Wrap; 2],
}

#[derive(Clone, Debug)]
pub(crate) struct LightMesh {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) indices: Vec<[u32; 3]>,
    pub(crate) uvs: Vec<Vec2>,
    pub(crate) paint: Paint,
    pub(crate) two_sided: bool,
    pub(crate) portal: bool,
}

/// The environment; images are latitude-longitude ones read with `Filter::Nearest`.
#[derive(Clone, Debug)]
pub(crate) enum Sky {
    Constant(f32),
    LatLong { size: [usize; 2], texels: Vec<f32> },
}

#[derive(Clone, Debug)]
pub(crate) struct Scene {
    pub(crate) name: String,
    pub(crate) meshes: Vec<LightMesh>,
    pub(crate) images: Vec<Image>,
    pub(crate) sky: Sky,
    pub(crate) rotation: Mat3,
    pub(crate) illumination: Illumination,
}

impl Image {
    fn texture(&self) -> Texture<'_> {
        let texture = Texture::new(self.size[0], self.size[1], &self.texels).expect("the texels are valid");
        texture.filter(self.filter).wrap(self.wrap[0], self.wrap[1])
    }

    /// One of noise, half black, one bright texel on black or on gray; every filter and wrap.
    pub(crate) fn random(pcg: &mut Pcg32, kind: usize) -> Self {
        let size = [1 + pcg.below(8), 2 + pcg.below(7)];
        let bright = pcg.below(size[0] * size[1]);
        let texel = |i: usize, pcg: &mut Pcg32| match kind % 4 {
            0 => pcg.f32(),
            1 if i % size[0] < size[0].div_ceil(2) => 0.0,
            1 => 1.0 + pcg.f32(),
            2 => f32::from(u8::from(i == bright)),
            _ => {
                if i == bright {
                    100.0
                } else {
                    0.05
                }
            }
        };
        let texels = (0..size[0] * size[1]).map(|i| texel(i, pcg)).collect();
        let wraps = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];
        let filter = if pcg.below(2) == 0 { Filter::Nearest } else { Filter::Bilinear };
        Self { size, texels, filter, wrap: [wraps[pcg.below(3)], wraps[pcg.below(3)]] }
    }
}

impl Sky {
    /// 0: constant, 1: noise, 2: one lit pixel, 3: a black hemisphere, 4: noise with a sun.
    pub(crate) fn random(pcg: &mut Pcg32, kind: usize) -> Self {
        let size = if kind == 4 { [64, 32] } else { [16, 8] };
        let lit = pcg.below(size[0] * size[1]);
        let texel = |i: usize, pcg: &mut Pcg32| match kind {
            1 => 0.2 + pcg.f32(),
            2 => {
                if i == lit {
                    50.0
                } else {
                    0.0
                }
            }
            4 => {
                if i == lit {
                    3000.0
                } else {
                    0.2 + pcg.f32()
                }
            }
            _ => {
                if i / size[0] < size[1] / 2 {
                    1.0
                } else {
                    0.0
                }
            }
        };
        match kind {
            0 => Self::Constant(1.5),
            _ => Self::LatLong { size, texels: (0..size[0] * size[1]).map(|i| texel(i, pcg)).collect() },
        }
    }
}

impl LightMesh {
    pub(crate) fn new(positions: Vec<Vec3>, indices: Vec<[u32; 3]>) -> Self {
        Self { positions, indices, uvs: Vec::new(), paint: Paint::Constant(1.0), two_sided: false, portal: false }
    }

    /// A parallelogram of two triangles with texture coordinates in the unit square.
    pub(crate) fn quad(corner: Vec3, u: Vec3, v: Vec3) -> Self {
        let mut mesh = Self::new(vec![corner, corner + u, corner + u + v, corner + v], vec![[0, 1, 2], [0, 2, 3]]);
        mesh.uvs = vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
        mesh
    }

    pub(crate) fn paint(self, paint: Paint) -> Self {
        Self { paint, ..self }
    }

    pub(crate) fn portal(self) -> Self {
        Self { portal: true, ..self }
    }

    pub(crate) fn two_sided(self) -> Self {
        Self { two_sided: true, ..self }
    }

    /// Separate triangles of some size in the unit cube, with texture coordinates that wrap around.
    pub(crate) fn soup(pcg: &mut Pcg32, count: usize, size: f32) -> Self {
        let (mut positions, mut uvs) = (Vec::new(), Vec::new());
        for _ in 0..count {
            let center = Vec3::from(pcg.cube());
            for _ in 0..3 {
                positions.push(center + size * (2.0 * Vec3::from(pcg.cube()) - 1.0));
                uvs.push(Vec2::new(pcg.within(-0.7, 1.6), pcg.within(-0.7, 1.6)));
            }
        }
        let indices = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        Self { uvs, ..Self::new(positions, indices) }
    }

    pub(crate) fn vertices(&self, triangle: usize) -> [Vec3; 3] {
        self.indices[triangle].map(|i| self.positions[i as usize])
    }

    pub(crate) fn corner_uvs(&self, triangle: usize) -> [Vec2; 3] {
        self.indices[triangle].map(|i| self.uvs[i as usize])
    }
}

/// What a random scene holds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Content {
    pub(crate) triangles: usize,
    pub(crate) textured: bool,
    /// Kind of the sky: see [`Sky::random`].
    pub(crate) sky: usize,
    /// Whether every mesh is two-sided.
    pub(crate) two_sided: bool,
}

impl Scene {
    pub(crate) fn new(name: &str, meshes: Vec<LightMesh>) -> Self {
        Self {
            name: name.into(),
            meshes,
            images: Vec::new(),
            sky: Sky::Constant(1.0),
            rotation: Mat3::IDENTITY,
            illumination: Illumination::default(),
        }
    }

    /// Up to four meshes of all kinds.
    pub(crate) fn random(pcg: &mut Pcg32, content: Content) -> Self {
        let Content { triangles, textured, sky, two_sided } = content;
        let mut scene = Self::new(&format!("{content:?}"), Vec::new());
        scene.sky = Sky::random(pcg, sky);
        scene.rotation = pcg.rotation();
        let kinds = [Illumination::Conservative, Illumination::PointToPoint, Illumination::Boundary];
        // Every other scene has the default.
        scene.illumination = kinds.get(pcg.below(2 * kinds.len())).copied().unwrap_or_default();
        let first = pcg.below(4);
        let parts = triangles.min(4);
        for part in 0..parts {
            let count = triangles / parts + usize::from(part < triangles % parts);
            let mut mesh = LightMesh::soup(pcg, count, 0.5 / (triangles as f32).cbrt());
            mesh.two_sided = two_sided || pcg.below(2) == 0;
            mesh.portal = (part + first).is_multiple_of(2);
            mesh.paint = if textured {
                scene.images.push(Image::random(pcg, part + first));
                Paint::Image(scene.images.len() - 1)
            } else {
                Paint::Constant(pcg.within(0.1, 4.0))
            };
            scene.meshes.push(mesh);
        }
        scene
    }

    pub(crate) fn environment(&self) -> Environment {
        let environment = match &self.sky {
            Sky::Constant(radiance) => Environment::constant(*radiance),
            Sky::LatLong { size, texels } => Environment::from_lat_long(size[0], size[1], texels, Filter::Nearest),
        };
        environment.and_then(|e| e.with_rotation(self.rotation)).expect("the environment is valid")
    }

    pub(crate) fn build(&self, arity: Arity) -> LightSampler {
        self.build_with(arity, |_| {})
    }

    /// Builds the scene with what is added to it at last.
    pub(crate) fn build_with(&self, arity: Arity, add: impl FnOnce(&mut LightSamplerBuilder<'_>)) -> LightSampler {
        self.build_between(arity, None, add)
    }

    /// Builds the scene as it moves to another while the shutter is open.
    pub(crate) fn build_moving(&self, arity: Arity, end: &Self) -> LightSampler {
        self.build_between(arity, Some(end), |_| {})
    }

    fn build_between(
        &self,
        arity: Arity,
        end: Option<&Self>,
        add: impl FnOnce(&mut LightSamplerBuilder<'_>),
    ) -> LightSampler {
        let builder = LightSampler::builder().environment(self.environment()).illumination(self.illumination);
        let mut builder = builder.arity(arity);
        let textures: Vec<_> = self.images.iter().map(|image| builder.add_texture(image.texture())).collect();
        for (i, light) in self.meshes.iter().enumerate() {
            let mesh = if light.portal { Mesh::portal } else { Mesh::emitter };
            let weight = match light.paint {
                Paint::Constant(value) => Weight::Constant(value),
                Paint::Image(image) => Weight::Texture(textures[image]),
            };
            let sides = if light.two_sided { Sides::Two } else { Sides::One };
            let mesh = mesh(&light.positions, &light.indices).uvs(&light.uvs).weight(weight).sides(sides);
            let mesh = end.map_or(mesh, |end| mesh.moving_to(&end.meshes[i].positions));
            builder.add_mesh(&mesh).expect("the mesh is valid");
        }
        add(&mut builder);
        builder.build().expect("there are not too many triangles")
    }

    /// Mesh and triangle numbers of all triangles.
    pub(crate) fn triangles(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.meshes.iter().enumerate().flat_map(|(m, mesh)| (0..mesh.indices.len()).map(move |t| (m, t)))
    }
}

/// A shading point in and around the unit cube: 0 surface, 1 transmissive, 2 volume.
pub(crate) fn random_point(pcg: &mut Pcg32, kind: usize) -> ShadingPoint {
    let position = 2.0 * Vec3::from(pcg.cube()) - 0.5;
    let normal = pcg.direction();
    let receiver = [Receiver::Surface(normal), Receiver::Transmissive(normal), Receiver::Volume][kind % 3];
    ShadingPoint::new(position, receiver)
}

/// Number of the first kind of [`point_of_kind`] with a lobe; those below have none.
pub(crate) const LOBES: usize = 3;
/// Number of its first kind with microfacets.
pub(crate) const MICROFACETS: usize = 6;
/// Number of its first kind with the least effort.
pub(crate) const LEAST_EFFORT: usize = 9;

/// Least roughness of lobes whose densities an integration resolves.
const LEAST_ROUGHNESS: f32 = 0.1;
/// Least roughness of microfacets, which are narrower along an axis and in a refraction.
const LEAST_MICROFACETS: f32 = 0.3;

/// A random point of one of twelve kinds: three receivers, the same with lobes and with microfacets, the first again
/// with the least effort.
pub(crate) fn point_of_kind(pcg: &mut Pcg32, kind: usize) -> ShadingPoint {
    let x = random_point(pcg, kind);
    match kind {
        0..LOBES => x,
        LOBES..MICROFACETS => with_lobe(x, pcg, LEAST_ROUGHNESS),
        MICROFACETS..LEAST_EFFORT => with_microfacets(x, pcg, LEAST_MICROFACETS),
        _ => x.with_effort(Effort::Least),
    }
}

/// Returns the point with a lobe: a glossy surface in place of a surface, of a roughness between `least` and 1, and a
/// phase function in a volume.
pub(crate) fn with_lobe(x: ShadingPoint, pcg: &mut Pcg32, least: f32) -> ShadingPoint {
    let (any, kind, roughness) = (pcg.direction(), pcg.below(8), least.powf(pcg.f32()));
    let (Receiver::Surface(normal) | Receiver::Transmissive(normal)) = x.receiver else {
        return ShadingPoint::scattering(x.position, Scattering::new(any, pcg.within(-0.95, 0.95)));
    };
    let above = if any.dot(normal) < 0.0 { -any } else { any };
    let outgoing = match kind {
        // Grazing, below the horizon, and straight above.
        0 => above - (1.0 - 1e-4) * normal * above.dot(normal),
        1 => -above,
        2 => normal,
        _ => above,
    };
    let diffuse = if kind % 2 == 0 { 0.0 } else { pcg.f32() };
    ShadingPoint::glossy(x.position, Glossy::new(normal, outgoing, roughness).with_weights(diffuse, 1.0))
}

/// Returns the point with microfacets of roughnesses between `least` and 1 along a tangent and across: opaque in place
/// of a surface, and with a transmission in place of all others.
pub(crate) fn with_microfacets(x: ShadingPoint, pcg: &mut Pcg32, least: f32) -> ShadingPoint {
    let (any, tangent, kind) = (pcg.direction(), pcg.direction(), pcg.below(8));
    let (normal, transmits) = match x.receiver {
        Receiver::Surface(normal) => (normal, false),
        Receiver::Transmissive(normal) => (normal, true),
        _ => (pcg.direction(), true),
    };
    let above = if any.dot(normal) < 0.0 { -any } else { any };
    let outgoing = match kind {
        // Grazing, below the horizon, and straight above.
        0 => above - (1.0 - 1e-4) * normal * above.dot(normal),
        1 => -above,
        2 => normal,
        _ => above,
    };
    let roughness = [(); 2].map(|()| least.powf(pcg.f32()));
    let [diffuse, reflected] = [(); 2].map(|()| if pcg.below(2) == 0 { 0.0 } else { pcg.f32() });
    let transmitted = if transmits { 0.1 + pcg.f32() } else { 0.0 };
    let reflected = if transmits { reflected } else { 0.1 + reflected };
    let surface = Microfacet::new(normal, outgoing, 0.5)
        .anisotropic(tangent, roughness)
        .with_weights(diffuse, reflected, transmitted)
        .with_ior([1.0, 1.5, 1.0 / 1.5, 2.4][pcg.below(4)]);
    ShadingPoint::microfacet(x.position, surface)
}
