//! Scenes from a fuzzer's bytes.

use std::sync::OnceLock;

use fanlight::{
    DiskLight, DistantLight, Environment, Filter, Illumination, Instance, InstanceId, Lamp, LightId, LightSample,
    LightSampler, LightSamplerBuilder, Mesh, MeshId, MeshUpdate, ObjectId, PointLight, Profile, ProfileLight,
    Projection, ShadingPoint, Sides, SphereLight, SpotLight, Texture, TextureId, TubeLight, Visibility, Weight, Wrap,
};
use glam::{Affine3A, Mat3, Quat, Vec2, Vec3, Vec3Swizzles};

use super::reader::Reader;

/// Lights of any kind, or `None` if the builder refuses them.
pub(crate) fn lights(reader: &mut Reader<'_>) -> Option<LightSampler> {
    let images: Vec<Image> = (0..reader.below(3)).map(|_| Image::read(reader)).collect();
    let meshes: Vec<Soup> = (0..1 + reader.below(3)).map(|_| Soup::read(reader)).collect();
    let mut builder = LightSampler::builder();
    if let Some(environment) = environment(reader) {
        builder = builder.environment(environment);
    }
    // By no byte of its own, so that inputs that were found keep their meaning.
    if meshes.len() % 4 == 3 {
        builder = builder.environment_as_light();
    }
    let terms =
        [Illumination::default(), Illumination::Conservative, Illumination::PointToPoint, Illumination::Boundary];
    builder = builder.illumination(terms[reader.below(terms.len())]);
    let textures: Vec<TextureId> =
        images.iter().filter_map(|image| Some(builder.add_texture(image.texture()?))).collect();
    for soup in &meshes {
        // A mesh that is refused leaves the builder as it was.
        let _ = builder.add_mesh(&soup.moving(&textures));
        if let Some(lamp) = soup.lamp(&mut builder) {
            let _ = builder.add_light_to(soup.groups(), lamp);
        }
    }
    add_instances(&mut builder, &meshes, &textures);
    builder.build().ok()
}

/// Instances of the meshes, where one of them has many vertices: by no byte of its own.
fn add_instances(builder: &mut LightSamplerBuilder<'_>, meshes: &[Soup], textures: &[TextureId]) {
    let parts: Vec<Mesh<'_>> = meshes.iter().map(|soup| soup.mesh(textures)).collect();
    let Some(frame) = meshes.iter().find(|soup| soup.positions.len() >= 8) else { return };
    // One that is refused leaves the builder as it was.
    let objects = [builder.add_object(&parts), builder.add_object(&parts[..1])];
    for (i, object) in objects.into_iter().flatten().enumerate() {
        for corner in frame.positions.chunks_exact(4).chain([&frame.positions[1..5]]) {
            let [x, y, z, place] = [0, 1, 2, 3].map(|k| corner[(k + i) % 4]);
            let transform = Affine3A::from_mat3_translation(Mat3::from_cols(x, y, z), place);
            let instance = Instance::new(object, transform).scaled(frame.uvs[i].x);
            let _ = builder.add_instance(instance);
            let end = Affine3A::from_mat3_translation(Mat3::from_cols(x + place, y, z), -place);
            let _ = builder.add_instance(instance.moving_to(end));
        }
        let _ = builder.add_instance(Instance::new(object, Affine3A::from_translation(frame.positions[0])));
    }
}

/// Makes some edits, of which any may be refused, and applies the others.
pub(crate) fn edit(lights: &mut LightSampler, reader: &mut Reader<'_>) {
    let images: Vec<Image> = (0..reader.below(2)).map(|_| Image::read(reader)).collect();
    let mut edits = lights.edit();
    let textures: Vec<TextureId> =
        images.iter().filter_map(|image| Some(edits.add_texture(image.texture()?))).collect();
    for _ in 0..reader.below(12) {
        let (action, number) = (reader.below(9), reader.below(6) as u32);
        let instance = |reader: &mut Reader<'_>| {
            let [x, y, z, place] = [(); 4].map(|()| reader.vector());
            let transform = Affine3A::from_mat3_translation(Mat3::from_cols(x, y, z), place);
            let end = Affine3A::from_mat3_translation(Mat3::from_cols(x + place, y, z), -place);
            let instance = Instance::new(ObjectId::from_index(number % 3), transform).scaled(reader.float());
            // By no byte of its own.
            if number > 3 { instance.moving_to(end) } else { instance }
        };
        // What is refused leaves the batch as it was.
        let _ = match action {
            0..3 => {
                let soup = Soup { indices: Vec::new(), ..Soup::read(reader) };
                let id = LightId::from_index(number);
                match soup.lamp(&mut LightSampler::builder()) {
                    Some(lamp) if action == 0 => edits.add_light_to(soup.groups(), lamp).map(drop),
                    Some(lamp) if action == 1 => edits.set_light(id, lamp),
                    _ => edits.remove_light(id),
                }
            }
            3 => edits.add_mesh(&Soup::read(reader).moving(&textures)).map(drop),
            4 => {
                let soup = Soup::read(reader);
                let update = MeshUpdate::new(MeshId::from_index(number)).scaled(reader.float());
                let moved = match soup.is_moving() {
                    true => update.moving(&soup.positions, &soup.end, &soup.indices),
                    false => update.moved(&soup.positions, &soup.indices),
                };
                edits.update_mesh(&moved).or(edits.update_mesh(&update))
            }
            5 => edits.remove_mesh(MeshId::from_index(number)),
            6 => edits.add_instance(instance(reader)).map(drop),
            7 => edits.set_instance(InstanceId::from_index(number), instance(reader)),
            _ => edits.remove_instance(InstanceId::from_index(number)),
        };
    }
    let _ = edits.apply();
}

/// The bytes of lights that are accepted, of several kinds. Each is built once only.
pub(crate) fn some_bytes(kind: u8) -> &'static [u8] {
    static BYTES: [OnceLock<Vec<u8>>; 16] = [const { OnceLock::new() }; 16];
    let kind = kind % 16;
    BYTES[usize::from(kind)].get_or_init(|| some_lights(kind).to_bytes())
}

fn some_lights(kind: u8) -> LightSampler {
    let texels = [0.0, 1.0, 0.5, 2.0];
    let sky = [0.5, 1.0, 0.0, 100.0, 0.1, 0.2, 0.3, 0.4];
    let positions: Vec<Vec3> = (0..12_u8).map(|i| Vec3::from([i % 3, i % 4, i % 5].map(f32::from))).collect();
    let uvs: Vec<Vec2> = positions.iter().map(|p| Vec2::new(p.x, p.y)).collect();
    let indices =
        [[0, 1, 2], [3, 4, 5], [6, 7, 8], [9, 10, 11], [0, 4, 8], [1, 5, 9], [2, 6, 10], [3, 7, 11], [0, 5, 11]];
    let mut builder = LightSampler::builder();
    if kind & 1 != 0 {
        builder = builder.environment(Environment::from_lat_long(4, 2, &sky, Filter::Nearest).expect("a valid sky"));
    }
    let texture = builder.add_texture(Texture::new(2, 2, &texels).expect("a valid texture"));
    let weight = if kind & 2 != 0 { Weight::Texture(texture) } else { Weight::Constant(1.0) };
    let count = if kind & 4 != 0 { indices.len() } else { 1 };
    let indices = &indices[..count];
    let mesh = if kind & 8 != 0 { Mesh::portal(&positions, indices) } else { Mesh::emitter(&positions, indices) };
    let mesh = mesh.uvs(&uvs).weight(weight).sides(Sides::Two);
    builder.add_mesh(&mesh).expect("a valid mesh");
    if kind == 15 {
        // What few scenes have.
        let profile = Profile { vertical: &[0.0, 1.0], horizontal: &[0.0], intensities: &[1.0, 0.5] };
        let profile = builder.add_profile(&profile).expect("a valid profile");
        builder.add_light_to(3, ProfileLight::new(Vec3::X, Vec3::Z, profile, 1.0)).expect("a valid light");
        builder.add_light_to(1, DistantLight::new(Vec3::Z, 1.0).angular_radius(0.1)).expect("a valid light");
        let end: Vec<Vec3> = positions.iter().map(|p| *p + p.yzx()).collect();
        builder.add_mesh(&mesh.moving_to(&end)).expect("a valid mesh");
        let intensities = [1.0, 0.0, 0.5, 0.0, 0.0, 2.0];
        let slide =
            Projection { angles: [1.0, 0.8], size: [3, 2], intensities: &intensities, filter: Filter::Bilinear };
        let slide = builder.add_projection(&slide).expect("a valid projection");
        builder.add_light(ProfileLight::new(Vec3::Y, Vec3::X, slide, 1.0)).expect("a valid light");
    }
    // An instance of every other kind.
    if kind & 1 == kind >> 2 & 1 {
        let object = builder.add_object(&[mesh]).expect("a valid object");
        let transform = Affine3A::from_scale(Vec3::new(1.0, -0.5, 2.0));
        let instance = Instance::new(object, transform);
        let end =
            Affine3A::from_scale_rotation_translation(Vec3::new(2.0, -0.5, 1.0), Quat::from_rotation_x(0.5), Vec3::X);
        builder.add_instance(if kind == 15 { instance.moving_to(end) } else { instance }).expect("a valid instance");
    }
    builder.build().expect("few triangles")
}

fn environment(reader: &mut Reader<'_>) -> Option<Environment> {
    let filter = filter(reader);
    let environment = match reader.below(4) {
        0 => return None,
        1 => Environment::constant(reader.float()),
        2 => {
            let (width, height) = (1 + reader.below(8), 1 + reader.below(8));
            Environment::from_lat_long(width, height, &reader.floats(width * height), filter)
        }
        _ => {
            let size = 1 << reader.below(4);
            Environment::from_equal_area(size, &reader.floats(size * size), filter)
        }
    };
    let axis = reader.vector().normalize_or(Vec3::X);
    let environment = environment.ok()?;
    environment.clone().with_rotation(Mat3::from_axis_angle(axis, reader.float())).ok().or(Some(environment))
}

fn filter(reader: &mut Reader<'_>) -> Filter {
    [Filter::Nearest, Filter::Bilinear][reader.below(2)]
}

struct Image {
    size: [usize; 2],
    texels: Vec<f32>,
    filter: Filter,
    wrap: [Wrap; 2],
}

impl Image {
    fn read(reader: &mut Reader<'_>) -> Self {
        let size = [1 + reader.below(6), 1 + reader.below(6)];
        let wrap = [(); 2].map(|()| [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp][reader.below(3)]);
        Self { size, texels: reader.floats(size[0] * size[1]), filter: filter(reader), wrap }
    }

    fn texture(&self) -> Option<Texture<'_>> {
        let texture = Texture::new(self.size[0], self.size[1], &self.texels).ok()?;
        Some(texture.filter(self.filter).wrap(self.wrap[0], self.wrap[1]))
    }
}

/// Triangles in any places.
struct Soup {
    positions: Vec<Vec3>,
    /// Positions in another order: where the vertices move to, now and then.
    end: Vec<Vec3>,
    indices: Vec<[u32; 3]>,
    uvs: Vec<Vec2>,
    /// A constant, or the number of an image.
    weight: Result<f32, usize>,
    sides: Sides,
    portal: bool,
}

impl Soup {
    fn read(reader: &mut Reader<'_>) -> Self {
        let vertices = reader.below(10);
        let positions: Vec<Vec3> = (0..vertices).map(|_| reader.vector()).collect();
        let end = positions.iter().skip(1).chain(positions.first()).copied().collect();
        // Now and then one too many.
        let index = |reader: &mut Reader<'_>| {
            let one_more = usize::from(reader.byte() == 0);
            reader.below(vertices.max(1) + one_more) as u32
        };
        let indices = (0..reader.below(12)).map(|_| [(); 3].map(|()| index(reader))).collect();
        let uvs = (0..vertices).map(|_| Vec2::new(reader.float(), reader.float())).collect();
        let weight = if reader.byte().is_multiple_of(2) { Ok(reader.float()) } else { Err(reader.below(3)) };
        let sides = if reader.byte().is_multiple_of(2) { Sides::One } else { Sides::Two };
        Self { positions, end, indices, uvs, weight, sides, portal: reader.byte().is_multiple_of(2) }
    }

    /// A light that is no mesh, where there is no triangle: by no byte of its own.
    fn lamp(&self, builder: &mut LightSamplerBuilder<'_>) -> Option<Lamp> {
        let ([a, b, ..], true) = (&self.positions[..], self.indices.is_empty()) else { return None };
        let (weight, size) = (self.weight.unwrap_or(1.0), self.uvs[0].x);
        Some(match self.positions.len() % 5 {
            0 if self.sides == Sides::Two => DistantLight::new(*a, weight).angular_radius(size).into(),
            1 if self.sides == Sides::Two && self.portal => {
                let intensities = [weight, 0.0, 1.0, size, b.y, 0.0];
                let filter = if size > 0.5 { Filter::Nearest } else { Filter::Bilinear };
                let slide = Projection { angles: [b.x, 3.0 * size], size: [2, 3], intensities: &intensities, filter };
                ProfileLight::new(*a, *b, builder.add_projection(&slide).ok()?, weight).facing(*a).into()
            }
            1 if self.sides == Sides::Two => {
                let profile =
                    Profile { vertical: &[0.0, b.x], horizontal: &[0.0, b.y], intensities: &[weight, 0.0, 1.0, size] };
                ProfileLight::new(*a, *b, builder.add_profile(&profile).ok()?, weight).facing(*a).into()
            }
            0 => PointLight::new(*a, weight).into(),
            1 => SpotLight::new(*a, *b, weight, [0.2, size]).into(),
            2 => SphereLight::new(*a, size, weight).sides(self.sides).into(),
            3 => DiskLight::new(*a, *b, size, weight).sides(self.sides).into(),
            _ => TubeLight::new([*a, *b], size, weight).into(),
        })
    }

    /// Light groups, by no byte of their own.
    fn groups(&self) -> u32 {
        if self.positions.len() % 3 == 2 { 2 } else { u32::MAX }
    }

    /// Whether the vertices move: by no byte of its own.
    fn is_moving(&self) -> bool {
        matches!(self.positions.len(), 7 | 9)
    }

    /// The mesh, whose vertices may move.
    fn moving(&self, textures: &[TextureId]) -> Mesh<'_> {
        let mesh = self.mesh(textures);
        if self.is_moving() { mesh.moving_to(&self.end) } else { mesh }
    }

    fn mesh(&self, textures: &[TextureId]) -> Mesh<'_> {
        let mesh = if self.portal {
            Mesh::portal(&self.positions, &self.indices)
        } else {
            Mesh::emitter(&self.positions, &self.indices)
        };
        let weight = match self.weight {
            Ok(constant) => Weight::Constant(constant),
            Err(image) => textures.get(image).map_or(Weight::Constant(1.0), |texture| Weight::Texture(*texture)),
        };
        mesh.uvs(&self.uvs).weight(weight).sides(self.sides).groups(self.groups())
    }
}

/// Lights of two kinds, and the bytes of a table of visibility that was learned for them. Both are made once only.
pub(crate) fn learned() -> (&'static LightSampler, Vec<u8>) {
    static LEARNED: OnceLock<(LightSampler, Vec<u8>)> = OnceLock::new();
    let (lights, bytes) = LEARNED.get_or_init(|| {
        let lights = some_lights(13);
        let point = |i: u64| {
            let position = Vec3::from([i % 5, i % 7, i % 3].map(|k| k as f32));
            if i.is_multiple_of(4) { ShadingPoint::volume(position) } else { ShadingPoint::surface(position, -Vec3::Z) }
        };
        let seen = |_: &ShadingPoint, sample: &LightSample| f32::from(u8::from(sample.position.x > 1.0));
        let table = Visibility::learn(&lights.as_view(), 2000, point, seen).expect("nobody cancels");
        let bytes = table.to_bytes();
        (lights, bytes)
    });
    (lights, bytes.clone())
}
