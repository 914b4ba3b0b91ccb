//! Instances that move or change their brightness.

use alloc::vec::Vec;

use super::{Instance, InstanceRecord, Object, records, records_mut};
use crate::error::{Error, ErrorKind};
use crate::light::Lights;
use crate::light::motion::EndColumns;
use crate::record::{InstanceId, ObjectId};

impl Lights {
    /// Replaces instances by others of the same objects, or none of them if one is invalid.
    pub(crate) fn update_instances(&mut self, updates: &[(InstanceId, Instance)]) -> Result<(), Error> {
        let replace = |&(InstanceId(number), instance): &(InstanceId, Instance)| {
            let number = number as usize;
            let records = records(&self.instances);
            let instances = records.len();
            let unknown = Error(ErrorKind::UnknownInstance { instance: number, instances });
            let current = records.get(number).ok_or(unknown)?;
            let ObjectId(object) = instance.object;
            if object != current.number {
                let expected = current.number;
                return Err(Error(ErrorKind::OtherObject { instance: number, object, expected }));
            }
            let corners = Object::at(&self.instances, current.object).corners();
            let record = InstanceRecord::new(&instance, number, current.object, corners)?;
            Ok((number, InstanceRecord { leaf: current.leaf, ..record }, instance.end_columns()))
        };
        let replaced: Vec<(usize, InstanceRecord, Option<EndColumns>)> =
            updates.iter().map(replace).collect::<Result<_, _>>()?;
        let is_moving = !self.view().extras().motion().is_empty();
        if is_moving || replaced.iter().any(|(_, _, end)| end.is_some()) {
            self.update_motion(|motion| {
                replaced.iter().for_each(|(number, _, end)| motion.set_instance(*number as u32, *end));
            });
        }
        let records = records_mut(&mut self.instances);
        for (number, record, _) in replaced {
            records[number] = record;
        }
        Ok(())
    }
}
