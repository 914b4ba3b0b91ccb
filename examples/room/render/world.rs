//! Everything that a picture is taken of.

use super::Error;
use super::lighting::Lighting;
use super::room::{Opening, Room};
use super::scene::Scene;
use super::sky::Sky;
use super::window::Window;

/// A room under a sky.
pub(crate) struct World {
    pub(crate) scene: Scene,
    pub(crate) sky: Sky,
    pub(crate) lighting: Lighting,
}

impl World {
    /// Builds the room, and what is needed to find the light in it.
    pub(crate) fn new(window: Window, opening: Opening, sky: Sky) -> Result<Self, Error> {
        let room = Room::new(window, opening);
        let lighting = Lighting::new(&room, &sky)?;
        Ok(Self { scene: Scene::new(room), sky, lighting })
    }
}
