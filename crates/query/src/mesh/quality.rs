//! The quality of a time-critical query.

/// The quality at which a time-critical query may stop (Klein & Zachmann, slides, 2003).
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct MeshQuality {
    /// The probability from which on a pair of nodes counts as colliding, `p_min`. 1, the default, to
    /// stop only at two triangles that meet.
    pub p_min: f64,
    /// The number of such pairs at which the search stops, `k_min`. Default: 3.
    pub k_min: u32,
    /// The number of cells that both surfaces must fill in a collision, 1 to 16. Default: 6.
    pub shared: u32,
}

impl Default for MeshQuality {
    fn default() -> Self {
        Self { p_min: 1.0, k_min: 3, shared: 6 }
    }
}

impl MeshQuality {
    /// The same quality with this probability.
    #[must_use]
    pub const fn with_p_min(self, p_min: f64) -> Self {
        Self { p_min, ..self }
    }

    /// The same quality with this number of pairs.
    #[must_use]
    pub const fn with_k_min(self, k_min: u32) -> Self {
        Self { k_min, ..self }
    }

    /// The same quality with this number of cells.
    #[must_use]
    pub const fn with_shared(self, shared: u32) -> Self {
        Self { shared, ..self }
    }
}
