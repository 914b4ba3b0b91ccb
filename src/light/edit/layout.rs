//! Edited lights as bytes hold them, and trees over textures without those that nothing refers to.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use crate::blas::{self, LEAF};
use crate::light::instance::{object_records_mut, records_mut};
use crate::light::{Lights, LightsView, NO_AREA, extras};
use crate::tlas::{Tlas, TlasView, relayout};

/// Returns edited lights and their tree without free places.
pub(crate) fn laid_out(lights: &LightsView<'_>, tlas: &TlasView<'_>) -> (Lights, Tlas) {
    let (tlas, _, leaves) = relayout(tlas);
    let records: Vec<_> = leaves.iter().map(|&leaf| lights.records[leaf as usize]).collect();
    let mut place_of = alloc::vec![0; lights.records.len()];
    (0..).zip(&leaves).for_each(|(place, &leaf)| place_of[leaf as usize] = place);
    let moved = |leaf: u32| if leaf < NO_AREA { place_of[leaf as usize] } else { leaf };
    let mut instances = lights.instances.to_vec();
    records_mut(&mut instances).iter_mut().for_each(|instance| instance.leaf = moved(instance.leaf));
    let mut lights = Lights {
        illumination: lights.illumination,
        energy: lights.energy,
        has_portals: lights.has_portals,
        has_lamps: records.iter().any(|record| record.is_lamp()),
        is_crossed_once: lights.is_crossed_once,
        time: lights.time,
        is_edited: false,
        records,
        cells: lights.cells.to_vec(),
        meshes: lights.meshes.to_vec(),
        leaf_of: lights.leaf_of.iter().map(|&leaf| moved(leaf)).collect(),
        scales: lights.scales.to_vec(),
        extras: extras::in_order(lights.extras(), &leaves),
        instances,
    };
    lights.reclaim_cells();
    (lights, tlas)
}

impl Lights {
    /// Removes the trees over textures that nothing refers to.
    pub(super) fn reclaim_cells(&mut self) {
        if self.cells.is_empty() {
            return;
        }
        let old = core::mem::take(&mut self.cells);
        let (cells, mut moved) = (&mut self.cells, BTreeMap::new());
        let mut keep = |node: &mut u32| {
            if *node != LEAF {
                *node = *moved.entry(*node).or_insert_with(|| {
                    let (places, to) = (blas::places(&old, *node), cells.len() as u32);
                    let by = to.wrapping_sub(*node);
                    cells.extend(old[places].iter().map(|cell| cell.moved_by(by)));
                    to
                });
            }
        };
        let is_triangle = |record: &&mut super::LightTriangle| record.instance().is_none() && !record.is_lamp();
        self.records.iter_mut().filter(is_triangle).for_each(|record| keep(&mut record.root.node));
        object_records_mut(&mut self.instances, |record| keep(&mut record.root.node));
    }
}
