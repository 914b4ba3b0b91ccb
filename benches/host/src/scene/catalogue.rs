//! All scenes by name.

use super::data::Data;
use super::{Scene, building, cornell, dome, night, room, star, street, two_rooms};
use crate::Error;

/// A scene that can be built.
pub(crate) struct Entry {
    pub(crate) name: &'static str,
    /// The file that it needs, if any.
    pub(crate) needs: Option<&'static str>,
    /// Whether a short run looks at it.
    pub(crate) quick: bool,
    pub(crate) build: fn(&Data) -> Result<Scene, Error>,
}

/// The captured courtyard, without a sun.
const COURTYARD: Option<&str> = Some("environments/courtyard.exr");
/// The captured city, with a sun.
const CITY: Option<&str> = Some("environments/city.exr");

/// All scenes, in the order of the table.
pub(crate) const ENTRIES: &[Entry] = &[
    Entry { name: "windows-only", needs: COURTYARD, quick: true, build: room::windows_only },
    Entry { name: "sun-room", needs: CITY, quick: false, build: room::sun_room },
    Entry { name: "night-room", needs: None, quick: true, build: night::night_room },
    Entry { name: "bulbs", needs: None, quick: true, build: room::bulbs },
    Entry { name: "room-bulbs", needs: COURTYARD, quick: false, build: room::room_bulbs },
    Entry { name: "grid", needs: CITY, quick: false, build: room::grid },
    Entry { name: "star", needs: Some("room/sky.exr"), quick: false, build: star::star },
    Entry { name: "two-rooms", needs: COURTYARD, quick: false, build: two_rooms::two_rooms },
    Entry { name: "glossy-0.05", needs: COURTYARD, quick: false, build: |data| room::glossy(data, 0.05) },
    Entry { name: "glossy-0.1", needs: COURTYARD, quick: false, build: |data| room::glossy(data, 0.1) },
    Entry { name: "glossy-0.3", needs: COURTYARD, quick: false, build: |data| room::glossy(data, 0.3) },
    Entry { name: "cornell", needs: None, quick: true, build: cornell::cornell },
    Entry { name: "dome-lamps", needs: None, quick: true, build: dome::dome_lamps },
    Entry { name: "building", needs: None, quick: false, build: building::building },
    Entry { name: "building-windows", needs: None, quick: false, build: building::building_windows },
    Entry { name: "street", needs: CITY, quick: false, build: street::street },
];
