//! Checks of objects and instances that come from outside.

use alloc::collections::BTreeSet;
use alloc::vec::Vec;

use super::object::{Object, Parts};
use super::{InstanceRecord, first_object, records};
use crate::blas;
use crate::error::Error;
use crate::light::{LightTriangle, LightsView, NO_AREA, NO_LEAF, POSITION_LIMIT};

impl LightsView<'_> {
    /// Checks that every object is whole and sound, and that instances and leaves refer to each other.
    pub(in crate::light) fn validate_instances(&self) -> Result<(), Error> {
        let (all, records) = (self.instances, records(self.instances));
        Error::unless_equal("number of instances", records.len(), all.first().map_or(0, |&count| count as usize))?;
        let mut starts = BTreeSet::new();
        let mut start = first_object(records.len()).min(all.len());
        while start < all.len() {
            let object = Object::at(all, u32::try_from(start).unwrap_or(u32::MAX));
            let words = object.header.words as usize;
            if Object::word_count(object.header) != Some(words) || words > all.len() - start {
                return Err(Error::bytes("number of words of an object", start, words, all.len() - start));
            }
            self.validate_object(&object, start)?;
            starts.insert(start as u32);
            start += words;
        }
        for (i, instance) in records.iter().enumerate() {
            if !starts.contains(&instance.object) {
                return Err(Error::bytes("object of an instance", i, instance.object, all.len()));
            }
            let object = Object::at(all, instance.object);
            if instance.check(object.corners()).is_err() {
                return Err(Error::bytes("transform or factor of an instance", i, 0, 0));
            }
            let end = self.extras().motion().end_of_instance(i as u32);
            if end.is_some_and(|end| instance.check_motion(end, object.corners()).is_err()) {
                return Err(Error::bytes("transform of an instance at the end", i, 0, 0));
            }
            let is_here =
                |leaf: u32| self.records.get(leaf as usize).and_then(LightTriangle::instance) == Some(i as u32);
            // An instance that can emit has lights.
            let is_absent = instance.leaf == NO_LEAF;
            let is_placed = is_here(instance.leaf) && object.len() > 0;
            if !(is_absent || is_placed) {
                return Err(Error::bytes("leaf of an instance", i, instance.leaf, self.records.len()));
            }
        }
        Ok(())
    }

    /// Whether the instance that a record stands for knows the record's leaf.
    pub(in crate::light) fn is_instance_at(&self, number: u32, leaf: u32) -> bool {
        records(self.instances).get(number as usize).is_some_and(|instance: &InstanceRecord| instance.leaf == leaf)
    }

    fn validate_object(&self, object: &Object<'_>, start: usize) -> Result<(), Error> {
        let fault = |what| Err(Error::bytes(what, start, 0, 0));
        let (header, Parts { tree, records, meshes, leaf_of }) = (object.header, object.parts());
        tree.validate()?;
        Error::unless_equal("number of triangles of an object", records.len(), tree.leaves.len())?;
        let plain = |record: &LightTriangle| {
            record.index_and_flags & LightTriangle::LAMP == 0
                && record.is_valid()
                && leaf_of.get(record.index() as usize).is_some()
        };
        if !records.iter().all(plain) {
            return fault("triangle of an object");
        }
        let roots: Vec<blas::Root> = records.iter().map(|record| record.root).collect();
        blas::validate_roots(&roots, self.cells)?;
        let leads_back = |(leaf, record): (u32, &LightTriangle)| leaf_of.get(record.index() as usize) == Some(&leaf);
        let leads_on = |(i, leaf): (usize, &u32)| {
            *leaf >= NO_AREA || records.get(*leaf as usize).is_some_and(|record| record.index() as usize == i)
        };
        if !(0..).zip(records).all(leads_back) || !leaf_of.iter().enumerate().all(leads_on) {
            return fault("leaf of a triangle of an object");
        }
        let sorted = meshes.is_sorted() && meshes.first() == Some(&0);
        if !sorted || meshes.last().map(|&end| end as usize) != Some(leaf_of.len()) {
            return fault("starts of the meshes of an object");
        }
        // NaN fails each of these.
        let is_place = |v: &[f32; 3]| v.iter().all(|x| x.abs() <= POSITION_LIMIT);
        let is_unit = |v: &[f32; 3]| v.iter().all(|x| x.abs() <= 1.0);
        let is_sound = [header.low, header.high, header.mean].iter().all(is_place)
            && (0..3).all(|axis| header.low[axis] <= header.high[axis])
            && is_unit(&header.axis)
            && is_unit(&header.normal)
            && (0.0..=core::f32::consts::PI).contains(&header.theta)
            && header.covariance.iter().all(|value| value.abs() <= POSITION_LIMIT * POSITION_LIMIT)
            && header.normals.iter().all(|value| value.abs() <= 1.01)
            && [header.flux, header.portal].iter().all(|value| (0.0..f32::INFINITY).contains(value))
            && header.two_sided <= 1;
        if is_sound { Ok(()) } else { fault("summary of an object") }
    }
}
