//! Lights of all kinds as plain descriptions that are edited beside a sampler.

extern crate alloc;

use alloc::collections::BTreeMap;

use crate::common::lights::ARITIES;
use crate::common::pcg::Pcg32;
use fanlight::{
    DiskLight, DistantLight, Environment, Error, Filter, Hit, Instance, InstanceId, Lamp, LightEdits, LightId,
    LightSampler, Mesh, MeshId, MeshUpdate, ObjectId, PointLight, PointSampler, SampledLight, Sides, SphereLight,
    SpotLight, Texture, TextureId, TriangleId, TubeLight, Weight,
};
use glam::{Affine3A, Quat, Vec2, Vec3};

/// Triangles side by side, with or without a texture.
#[derive(Clone, Debug)]
struct Patch {
    positions: Vec<Vec3>,
    /// Positions at the end of the shutter interval, if the mesh moves.
    end: Option<Vec<Vec3>>,
    uvs: Vec<Vec2>,
    weight: f32,
    scale: f32,
    is_textured: bool,
    is_portal: bool,
    groups: u32,
}

/// The lights of a scene.
#[derive(Clone, Debug)]
pub(crate) struct World {
    kind: usize,
    /// Whether meshes and instances may move while the shutter is open.
    pub(crate) moves: bool,
    /// Whether most light is of lights with an extent.
    has_extents: bool,
    lamps: BTreeMap<LightId, (Lamp, u32)>,
    patches: BTreeMap<MeshId, Patch>,
    instances: BTreeMap<InstanceId, Instance>,
}

/// The id of a light that may be sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Id {
    Lamp(LightId),
    Triangle(TriangleId),
    Placed(InstanceId, TriangleId),
}

/// A fresh build, with the ids of its lights in the order of [`World::lights`].
pub(crate) struct Built {
    pub(crate) lights: LightSampler,
    pub(crate) ids: Vec<Id>,
}

const ALL: u32 = u32::MAX;
/// Kinds of worlds in which nothing moves.
pub(crate) const KINDS: usize = 12;
/// Texels of the only texture.
const TEXELS: [f32; 16] = [0.1, 0.9, 0.4, 0.0, 2.0, 0.3, 0.2, 0.7, 0.5, 0.0, 1.0, 0.8, 0.6, 0.1, 0.3, 5.0];

impl Id {
    pub(crate) fn pmf(&self, at: &PointSampler<'_>) -> f32 {
        match *self {
            Self::Lamp(id) => at.pmf_light(id),
            Self::Triangle(id) => at.pmf(id),
            Self::Placed(instance, id) => at.pmf_within(instance, id),
        }
    }
}

impl Patch {
    fn random(pcg: &mut Pcg32, groups: u32) -> Self {
        let mut positions = Vec::new();
        let size = [0.02, 0.3, 2.0][pcg.below(3)];
        for _ in 0..1 + pcg.below(6) {
            let at = 4.0 * Vec3::from_array(pcg.cube()) - 2.0;
            positions.extend([at, at + size * pcg.direction(), at + size * pcg.direction()]);
        }
        let uvs = positions.iter().map(|p| Vec2::new(p.x, p.y)).collect();
        Self {
            positions,
            end: None,
            uvs,
            weight: pcg.within(0.1, 4.0),
            scale: 1.0,
            is_textured: pcg.below(3) == 0,
            is_portal: pcg.below(3) == 0,
            groups,
        }
    }

    fn indices(&self) -> Vec<[u32; 3]> {
        (0..self.positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect()
    }

    /// Passes the mesh on. `scale` multiplies a constant weight, as it cannot one of a texture.
    fn with<R>(&self, texture: TextureId, then: impl FnOnce(&Mesh<'_>) -> R) -> R {
        let indices = self.indices();
        let mesh = if self.is_portal {
            Mesh::portal(&self.positions, &indices)
        } else {
            Mesh::emitter(&self.positions, &indices)
        };
        let weight = if self.is_textured { Weight::Texture(texture) } else { Weight::Constant(self.weight) };
        let mesh = mesh.weight(weight).uvs(&self.uvs).sides(Sides::Two).groups(self.groups);
        then(&match &self.end {
            Some(end) => mesh.moving_to(end),
            None => mesh,
        })
    }

    /// Begins, changes or ends a motion.
    fn move_at_random(&mut self, pcg: &mut Pcg32) {
        let (by, turn) = (pcg.direction(), Quat::from_axis_angle(pcg.direction(), pcg.within(0.0, 1.5)));
        self.end = (pcg.below(3) > 0).then(|| self.positions.iter().map(|p| turn * *p + 0.5 * by).collect());
    }
}

fn texture() -> Texture<'static> {
    Texture::new(4, 4, &TEXELS).expect("the texels are valid").filter(Filter::Nearest)
}

fn lamp(pcg: &mut Pcg32) -> Lamp {
    let at = 4.0 * Vec3::from_array(pcg.cube()) - 2.0;
    let bright = pcg.within(-3.0, 3.0).exp2();
    match pcg.below(8) {
        0 => DistantLight::new(pcg.direction(), bright).into(),
        1 => SpotLight::new(at, pcg.direction(), bright, [0.3, 1.2]).into(),
        2 => DiskLight::new(at, pcg.direction(), 0.2, bright).sides(Sides::Two).into(),
        3 => TubeLight::new([at, at + pcg.direction()], 0.05, bright).into(),
        4 => SphereLight::new(at, pcg.within(0.01, 0.5), bright).into(),
        5 => PointLight::new(at, 1e3 * bright).into(),
        6 => PointLight::new(at, if pcg.below(3) == 0 { 0.0 } else { bright }).into(),
        _ => PointLight::new(at, bright).into(),
    }
}

impl World {
    /// Lights of some kinds: without an extent, of all kinds, with light groups, with instances. From the twelfth kind
    /// on, they are the same, and some move.
    pub(crate) fn random(pcg: &mut Pcg32, kind: usize, count: usize) -> Self {
        Self::with(pcg, kind, count, false)
    }

    /// Lights as [`Self::random`] makes them, where `has_extents` leaves out most lamps without an extent and makes
    /// instances brighter.
    pub(crate) fn with(pcg: &mut Pcg32, kind: usize, count: usize, has_extents: bool) -> Self {
        let (kind, moves) = (kind % KINDS, kind >= KINDS);
        let (lamps, patches, instances) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        let mut world = Self { kind, moves, has_extents, lamps, patches, instances };
        for _ in 0..count {
            let groups = world.groups(pcg);
            match pcg.below(3) {
                0 if world.has_meshes() => {
                    let id = MeshId::from_index(world.patches.len() as u32);
                    world.patches.insert(id, world.patch(pcg, groups));
                }
                1 if world.has_instances() => {
                    let id = InstanceId::from_index(world.instances.len() as u32);
                    world.instances.insert(id, world.instance(pcg, groups));
                }
                _ => {
                    let id = LightId::from_index(world.lamps.len() as u32);
                    world.lamps.insert(id, (world.lamp(pcg), groups));
                }
            }
        }
        world
    }

    fn patch(&self, pcg: &mut Pcg32, groups: u32) -> Patch {
        let mut patch = Patch::random(pcg, groups);
        if self.moves {
            // Some have no triangles: their place among all is that of another mesh.
            if pcg.below(4) == 0 {
                (patch.positions, patch.uvs) = (Vec::new(), Vec::new());
            }
            patch.move_at_random(pcg);
        }
        patch
    }

    fn has_meshes(&self) -> bool {
        self.kind % 4 > 0
    }

    fn has_instances(&self) -> bool {
        self.kind % 4 == 3
    }

    fn groups(&self, pcg: &mut Pcg32) -> u32 {
        // A point receives all groups, so that no light is left out.
        if self.kind % 4 == 2 && pcg.below(3) == 0 { 1 << pcg.below(4) } else { ALL }
    }

    fn lamp(&self, pcg: &mut Pcg32) -> Lamp {
        loop {
            let lamp = lamp(pcg);
            if self.has_extents && matches!(lamp, Lamp::Point(_) | Lamp::Distant(_)) && pcg.below(16) > 0 {
                continue;
            }
            // Without an extent, the density of a direction is known to be that of a light.
            if self.kind % 4 > 0 || matches!(lamp, Lamp::Point(_)) {
                return lamp;
            }
        }
    }

    fn instance(&self, pcg: &mut Pcg32, groups: u32) -> Instance {
        let scale = Vec3::new(pcg.within(0.2, 1.0), pcg.within(0.2, 1.0), pcg.within(-1.0, -0.2));
        let rotation = Quat::from_rotation_arc(pcg.direction(), pcg.direction());
        let place =
            Affine3A::from_scale_rotation_translation(scale, rotation, 4.0 * Vec3::from_array(pcg.cube()) - 2.0);
        let factor = if pcg.below(6) == 0 { 0.0 } else { pcg.within(0.5, 2.0) };
        let factor = if self.has_extents { 20.0 * factor } else { factor };
        let instance = Instance::new(ObjectId::from_index(pcg.below(2) as u32), place).scaled(factor).groups(groups);
        if !self.moves || pcg.below(3) == 0 {
            return instance;
        }
        // It can be inverted at all times, as it turns by less than a right angle.
        let turn = Affine3A::from_axis_angle(pcg.direction(), pcg.within(0.0, 1.2));
        instance.moving_to(Affine3A::from_translation(pcg.direction()) * turn * place)
    }

    fn environment(&self) -> Environment {
        match self.kind / 4 {
            0 => Environment::constant(0.5),
            kind => {
                let mut sky = vec![0.4; 16 * 16];
                if kind == 2 {
                    sky[70] = 1e3;
                }
                Environment::from_equal_area(16, &sky, Filter::Nearest)
            }
        }
        .expect("the sky is valid")
    }

    /// Builds the lights as they are.
    pub(crate) fn build(&self) -> Built {
        let mut builder = LightSampler::builder().environment(self.environment()).arity(ARITIES[self.kind % 3]);
        let texture = builder.add_texture(texture());
        let (mut ids, mut updates) = (Vec::new(), Vec::new());
        for (lamp, groups) in self.lamps.values() {
            ids.push(Id::Lamp(builder.add_light_to(*groups, *lamp).expect("the lamp is valid")));
        }
        for patch in self.patches.values() {
            let id = patch.with(texture, |mesh| builder.add_mesh(mesh)).expect("the mesh is valid");
            ids.extend((0..patch.indices().len() as u32).map(|i| Id::Triangle(TriangleId::new(id, i))));
            updates.push(MeshUpdate::new(id).scaled(patch.scale));
        }
        for number in 0..2 {
            let positions = [Vec3::ZERO, 0.2 * Vec3::X, 0.3 * Vec3::Y, 0.2 * Vec3::Z];
            let indices = &[[0, 1, 2], [0, 1, 3]][number..];
            builder.add_object(&[Mesh::emitter(&positions, indices).sides(Sides::Two)]).expect("the object is valid");
        }
        for instance in self.instances.values() {
            let id = builder.add_instance(*instance).expect("the instance is valid");
            ids.extend((0..2).map(|i| Id::Placed(id, TriangleId::new(MeshId::from_index(0), i))));
        }
        let mut lights = builder.build().expect("the lights are few");
        if updates.iter().zip(self.patches.values()).any(|(_, patch)| patch.scale != 1.0) {
            lights.refit(&updates).expect("the factors are valid");
        }
        Built { lights, ids }
    }

    /// Ids of all lights but those of no extent that send into a cone alone.
    pub(crate) fn lights(&self) -> impl Iterator<Item = Id> {
        let lamps = self.lamps.keys().map(|&id| Id::Lamp(id));
        let triangles = self.patches.iter().flat_map(|(&id, patch)| {
            (0..patch.indices().len() as u32).map(move |i| Id::Triangle(TriangleId::new(id, i)))
        });
        let placed = self
            .instances
            .keys()
            .flat_map(|&id| (0..2).map(move |i| Id::Placed(id, TriangleId::new(MeshId::from_index(0), i))));
        lamps.chain(triangles).chain(placed)
    }

    /// Whether a light sends only into some directions, so that bounds may or may not find out that it is dark.
    pub(crate) fn is_doubtful(&self, id: Id) -> bool {
        matches!(id, Id::Lamp(id) if matches!(self.lamps[&id].0, Lamp::Spot(_)))
    }

    /// Whether the probabilities of all lights add up to one: no part of the light is sampled without a choice of a
    /// light first, and no cluster turns out to be dark.
    pub(crate) fn is_complete(&self) -> bool {
        self.kind / 4 < 2 && !self.lights().any(|id| self.is_doubtful(id))
    }

    /// Whether a light is one of these.
    pub(crate) fn holds(&self, light: &SampledLight) -> bool {
        match light {
            SampledLight::Triangle(Hit { triangle, instance: None, .. }) => self.patches.contains_key(&triangle.mesh),
            SampledLight::Triangle(Hit { instance: Some(instance), .. }) => self.instances.contains_key(instance),
            SampledLight::Shape(id) | SampledLight::Punctual(id) => self.lamps.contains_key(id),
            _ => false,
        }
    }

    /// Makes an edit that is chosen by numbers, here and of a sampler.
    pub(crate) fn edit(
        &mut self,
        edits: &mut LightEdits<'_, 'static>,
        [action, which, _]: [u16; 3],
        pcg: &mut Pcg32,
    ) -> Result<(), Error> {
        let groups = self.groups(pcg);
        let which = usize::from(which);
        let nth = |count: usize| which % count.max(1);
        match action % 12 {
            0..2 => {
                let lamp = self.lamp(pcg);
                let id = edits.add_light_to(groups, lamp)?;
                assert!(self.lamps.insert(id, (lamp, groups)).is_none(), "an id is given out twice");
            }
            2..4 => {
                let Some(id) = self.lamps.keys().nth(nth(self.lamps.len())).copied() else { return Ok(()) };
                let lamp = self.lamp(pcg);
                edits.set_light(id, lamp)?;
                self.lamps.entry(id).and_modify(|entry| entry.0 = lamp);
            }
            4 => {
                let Some(id) = self.lamps.keys().nth(nth(self.lamps.len())).copied() else { return Ok(()) };
                edits.remove_light(id)?;
                self.lamps.remove(&id);
            }
            5 if self.has_meshes() => {
                let patch = self.patch(pcg, groups);
                let texture = edits.add_texture(texture());
                let id = patch.with(texture, |mesh| edits.add_mesh(mesh))?;
                assert!(self.patches.insert(id, patch).is_none(), "an id is given out twice");
            }
            6..8 => {
                let place = nth(self.patches.len());
                let (moves, keeps_place) = (self.moves, self.moves && which % 2 == 0);
                let Some((&id, patch)) = self.patches.iter_mut().nth(place) else { return Ok(()) };
                let (by, turn) = (pcg.direction(), Quat::from_rotation_arc(pcg.direction(), pcg.direction()));
                let indices = patch.indices();
                if which % 3 > 0 && !keeps_place {
                    patch.positions.iter_mut().for_each(|p| *p = turn * *p + 0.5 * by);
                }
                if which % 3 < 2 {
                    patch.scale = if pcg.below(4) == 0 { 0.0 } else { pcg.within(0.2, 3.0) };
                }
                if moves && !keeps_place {
                    patch.move_at_random(pcg);
                }
                let update = MeshUpdate::new(id).scaled(patch.scale);
                edits.update_mesh(&match &patch.end {
                    _ if keeps_place => update,
                    Some(end) => update.moving(&patch.positions, end, &indices),
                    None => update.moved(&patch.positions, &indices),
                })?;
            }
            8 => {
                let Some(id) = self.patches.keys().nth(nth(self.patches.len())).copied() else { return Ok(()) };
                edits.remove_mesh(id)?;
                self.patches.remove(&id);
            }
            9 if self.has_instances() => {
                let instance = self.instance(pcg, groups);
                let id = edits.add_instance(instance)?;
                assert!(self.instances.insert(id, instance).is_none(), "an id is given out twice");
            }
            10 => {
                let Some(id) = self.instances.keys().nth(nth(self.instances.len())).copied() else { return Ok(()) };
                let instance = self.instance(pcg, groups);
                edits.set_instance(id, instance)?;
                self.instances.insert(id, instance);
            }
            11 => {
                let Some(id) = self.instances.keys().nth(nth(self.instances.len())).copied() else { return Ok(()) };
                edits.remove_instance(id)?;
                self.instances.remove(&id);
            }
            _ => {}
        }
        Ok(())
    }

    /// Removes what there is of each kind beyond a number.
    pub(crate) fn shrink_to(&mut self, edits: &mut LightEdits<'_, 'static>, count: usize) -> Result<(), Error> {
        for id in self.lamps.keys().copied().skip(count).collect::<Vec<_>>() {
            edits.remove_light(id)?;
            self.lamps.remove(&id);
        }
        for id in self.patches.keys().copied().skip(count).collect::<Vec<_>>() {
            edits.remove_mesh(id)?;
            self.patches.remove(&id);
        }
        for id in self.instances.keys().copied().skip(count).collect::<Vec<_>>() {
            edits.remove_instance(id)?;
            self.instances.remove(&id);
        }
        Ok(())
    }
}
