//! Instances that move or change their brightness.

use alloc::vec::Vec;

use super::{Instance, InstanceRecord, Object};
use crate::error::{Error, ErrorKind};
use crate::light::Lights;
use crate::record::{InstanceId, ObjectId};

impl Lights {
    /// Replaces instances by others of the same objects, or none of them if one is invalid.
    pub(crate) fn update_instances(&mut self, updates: &[(InstanceId, Instance)]) -> Result<(), Error> {
        let replace = |&(InstanceId(number), instance): &(InstanceId, Instance)| {
            let number = number as usize;
            let instances = self.instances.len();
            let unknown = Error(ErrorKind::UnknownInstance { instance: number, instances });
            let current = self.instances.get(number).ok_or(unknown)?;
            let ObjectId(object) = instance.object;
            if object != current.number {
                let expected = current.number;
                return Err(Error(ErrorKind::OtherObject { instance: number, object, expected }));
            }
            let corners = Object::at(&self.objects, current.object).corners();
            let record = InstanceRecord::new(&instance, number, current.object, corners)?;
            Ok((number, InstanceRecord { leaf: current.leaf, ..record }))
        };
        let replaced: Vec<(usize, InstanceRecord)> = updates.iter().map(replace).collect::<Result<_, _>>()?;
        for (number, record) in replaced {
            self.instances[number] = record;
        }
        Ok(())
    }
}
