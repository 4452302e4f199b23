//! Buildings whose files are no part of the repository, and ways through them.
//!
//! Routes are files that `nearmiss slices walk --route` takes as they are.

/// A building, and a way through it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scene {
    /// Of the file, in the folder of data.
    pub file: &'static str,
    /// The axis that points up.
    pub up: &'static str,
    /// A route, as JSON.
    pub route: &'static str,
    /// How far one must climb at once on it.
    pub climb: f64,
}

/// A scan of two storeys: up the two flights of its staircase, over the landing, to the upper floor, and down
/// again.
pub const TWO_STOREYS: Scene = Scene {
    file: "buildings/two-storey-scan-zup-753k.ply",
    up: "z",
    route: include_str!("../routes/two-storey-scan.json"),
    climb: 0.35,
};

/// A court with arcades: from end to end, to and fro between the columns.
pub const SPONZA: Scene = Scene {
    file: "buildings/sponza.obj",
    up: "y",
    route: include_str!("../routes/sponza.json"),
    climb: 0.35,
};

/// Once around the court on the upper storey, to which no stairs lead.
pub const GALLERY: Scene = Scene { route: include_str!("../routes/sponza-gallery.json"), ..SPONZA };

/// Vaults on three levels: up a winding stair, through the corridors, up a straight one, and
/// back. Rubble lies on the steps, two of which are then climbed at once.
pub const DUNGEON: Scene = Scene {
    file: "buildings/dungeon.obj",
    up: "y",
    route: include_str!("../routes/dungeon.json"),
    climb: 0.9,
};

/// Houses on a hilly ground: up a ramp to a platform, and down again.
pub const NAV_TEST: Scene = Scene {
    file: "buildings/nav-test.obj",
    up: "y",
    route: include_str!("../routes/nav-test.json"),
    climb: 0.35,
};
