//! Calls of a host in a building of many rooms, without and with a table of what its walls hide.

use fanlight::{LightSample, LightSampler, Mesh, ShadingPoint, Visibility, VisibilityView, Weight};

use super::cases::{CALLS, next_event_of};
use crate::scenes::building;

/// Rays that a table is learned by before calls are counted, as in the rows of the quality bench.
const RAYS: u64 = 1_000_000;
/// Rays where nothing is counted.
const FEW_RAYS: u64 = 10_000;
/// Tells a case with a table which file its table is in.
pub(crate) const TABLE: &str = "--table";

/// Floors of the building of each case with a table.
const LEARNED: [(&str, u32); 2] =
    [("building/learned-nee", building::FLOORS), ("building-10/learned-nee", building::MANY_FLOORS)];

/// Learns the table of a case that has one, before the case runs: under Valgrind it would take minutes.
pub(crate) fn table(case: &str) -> Option<Vec<u8>> {
    let (_, floors) = LEARNED.into_iter().find(|(name, _)| *name == case)?;
    Some(learn(&lights(floors), floors, RAYS).to_bytes())
}

/// A call of a host that knows nothing of walls.
pub(super) fn blind(floors: u32) {
    next_event_of(&lights(floors).as_view(), &points(floors));
}

/// A call of a host with a table: that of the file on the command line, or one of few rays.
pub(super) fn learned(floors: u32) {
    let lights = lights(floors);
    let path = std::env::args().skip_while(|word| word != TABLE).nth(1);
    let table = path.map_or_else(|| learn(&lights, floors, FEW_RAYS), |path| load(&path));
    next_event_of(&lights.with_visibility(&table).expect("it was learned for these lights"), &points(floors));
}

fn load(path: &str) -> Visibility {
    let file = std::fs::read(path).expect("the table was written");
    // At a multiple of four bytes.
    let mut memory = vec![0; file.len() + 3];
    let start = memory.as_ptr().align_offset(4);
    let bytes = &mut memory[start..start + file.len()];
    bytes.copy_from_slice(&file);
    VisibilityView::from_bytes(bytes).expect("the table is whole").to_owned()
}

fn points(floors: u32) -> Vec<ShadingPoint> {
    building::points(floors, 36, CALLS)
}

fn lights(floors: u32) -> LightSampler {
    let mut builder = LightSampler::builder();
    for lamp in building::lamps(floors) {
        let mesh = Mesh::emitter(&lamp.positions, &lamp.indices).weight(Weight::Constant(lamp.radiance));
        builder.add_mesh(&mesh).expect("the lamp is sound");
    }
    builder.build().expect("the building is small")
}

fn learn(lights: &LightSampler, floors: u32, rays: u64) -> Visibility {
    let seen =
        |x: &ShadingPoint, sample: &LightSample| f32::from(u8::from(building::sees(x, sample.position.as_dvec3())));
    let point = |i: u64| building::learning_point(floors, i);
    Visibility::learn(&lights.as_view(), rays, point, seen).expect("nobody cancels")
}
