//! Buildings whose files are not in the repository, and routes through them.
//!
//! Routes are files that `nearmiss slices walk --route` reads as they are.

/// A building and a route through it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scene {
    /// Name of the file, in the folder of data.
    pub file: &'static str,
    /// The axis that points up.
    pub up: &'static str,
    /// A route, as JSON.
    pub route: &'static str,
    /// The climb that the route needs.
    pub climb: f64,
}

/// A scan of two storeys. The route goes up the two flights of the staircase, over the landing, to
/// the upper floor, and down again.
pub const TWO_STOREYS: Scene = Scene {
    file: "buildings/two-storey-scan-zup-753k.ply",
    up: "z",
    route: include_str!("../routes/two-storey-scan.json"),
    climb: 0.35,
};

/// A court with arcades, from end to end, to and fro between the columns.
pub const SPONZA: Scene = Scene {
    file: "buildings/sponza.obj",
    up: "y",
    route: include_str!("../routes/sponza.json"),
    climb: 0.35,
};

/// Once around the court on the upper storey, which has no stairs.
pub const GALLERY: Scene = Scene { route: include_str!("../routes/sponza-gallery.json"), ..SPONZA };

/// Vaults on three levels: up a winding stair, through the corridors, up a straight one, and back.
/// Rubble lies on the steps, so two of them are climbed at once.
pub const DUNGEON: Scene = Scene {
    file: "buildings/dungeon.obj",
    up: "y",
    route: include_str!("../routes/dungeon.json"),
    climb: 0.9,
};

/// Houses on hilly ground: up a ramp to a platform, and down again.
pub const NAV_TEST: Scene = Scene {
    file: "buildings/nav-test.obj",
    up: "y",
    route: include_str!("../routes/nav-test.json"),
    climb: 0.35,
};
