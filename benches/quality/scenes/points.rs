//! The shading points of every workload.

use fanlight::ShadingPoint;
use glam::DVec3;

use super::pcg::Pcg32;

/// Where the shading points of a workload lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PointSet {
    /// In and around the unit cube.
    Cube,
    /// In and around the unit cube, but outside of the bumpy sphere.
    AroundSphere,
    /// Above and below the horizon of the unit square.
    OverQuad,
    /// In the room behind the wall `y = 0`.
    Room,
}

impl PointSet {
    /// The first points of the set that variance is measured at.
    pub(crate) fn quality(self, count: usize) -> Vec<ShadingPoint> {
        let seed = match self {
            Self::Cube | Self::AroundSphere => 6,
            Self::OverQuad => 12,
            Self::Room => 8,
        };
        self.draw(seed, count)
    }

    /// The first points of the set that calls are timed at.
    pub(crate) fn timing(self, count: usize) -> Vec<ShadingPoint> {
        self.draw(2, count)
    }

    fn draw(self, seed: u64, count: usize) -> Vec<ShadingPoint> {
        let mut pcg = Pcg32::new(seed, 2);
        (0..count).map(|_| self.point(&mut pcg)).collect()
    }

    fn point(self, pcg: &mut Pcg32) -> ShadingPoint {
        let (position, normal) = match self {
            Self::Cube => (cube(pcg), pcg.direction()),
            Self::AroundSphere => loop {
                let drawn = (cube(pcg), pcg.direction());
                if (drawn.0 - 0.5).length() >= 0.45 {
                    break drawn;
                }
            },
            Self::OverQuad => {
                let z = 0.1 + 1.9 * pcg.f();
                let y = -0.5 + 2.0 * pcg.f();
                let x = -0.5 + 2.0 * pcg.f();
                (DVec3::new(x, y, z), pcg.direction())
            }
            Self::Room => {
                let x = -2.0 + 4.0 * pcg.f();
                let y = -3.0 + 3.0 * pcg.f();
                let z = 3.0 * pcg.f();
                (DVec3::new(x, y, z), pcg.direction())
            }
        };
        ShadingPoint::surface(position.as_vec3(), normal.as_vec3())
    }
}

fn cube(pcg: &mut Pcg32) -> DVec3 {
    DVec3::from_array(core::array::from_fn(|_| -0.5 + 2.0 * pcg.f()))
}
