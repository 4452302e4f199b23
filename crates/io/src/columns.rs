//! Names of columns, the same in every format: coordinates, normals, colours, intensity and class.

use crate::error::Fault;

/// The values of a row: x y z, normal x y z, red green blue, intensity, class.
pub(crate) type Row = [f64; 11];

/// Returns the index in a [`Row`] of a column with this name, in any case.
pub(crate) fn slot(name: &[u8]) -> Option<usize> {
    const NAMES: [&[&str]; 11] = [
        &["x"],
        &["y"],
        &["z"],
        &["nx", "normal_x"],
        &["ny", "normal_y"],
        &["nz", "normal_z"],
        &["red", "r"],
        &["green", "g"],
        &["blue", "b"],
        &["intensity", "scalar_intensity"],
        &["classification", "scalar_classification", "class"],
    ];
    NAMES.iter().position(|names| names.iter().any(|known| name.eq_ignore_ascii_case(known.as_bytes())))
}

/// Returns `true` if a second column for this slot is an error. Files may have several intensities
/// and classes.
pub(crate) const fn is_unique(slot: usize) -> bool {
    slot < 9
}

/// The attributes that the rows of a table have besides coordinates.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Holds {
    pub(crate) normals: bool,
    pub(crate) colours: bool,
    pub(crate) intensities: bool,
    pub(crate) classes: bool,
}

impl Holds {
    /// Finds the attributes from the slots of the columns. Coordinates are required. Normals and
    /// colours are only attributes if all three components are present.
    pub(crate) fn among(slots: impl Iterator<Item = usize>) -> Result<Self, Fault> {
        let mut filled = [false; 11];
        slots.for_each(|slot| filled[slot] = true);
        for (there, what) in filled.iter().zip(["the coordinate x", "the coordinate y", "the coordinate z"]) {
            if !there {
                return Err(Fault::Undeclared { what });
            }
        }
        Ok(Self {
            normals: filled[3..6] == [true; 3],
            colours: filled[6..9] == [true; 3],
            intensities: filled[9],
            classes: filled[10],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_and_colours_count_in_threes() {
        let of = |names: &str| Holds::among(names.split(' ').filter_map(|n| slot(n.as_bytes())));
        let both = Holds { normals: true, colours: true, intensities: true, classes: false };
        assert_eq!(of("X Y Z intensity nx ny nz Red Green Blue"), Ok(both));
        assert_eq!(of("x y z nx ny red green"), Ok(Holds::default()));
        assert_eq!(of("x y z Classification"), Ok(Holds { classes: true, ..Holds::default() }));
        assert_eq!(of("x z nx"), Err(Fault::Undeclared { what: "the coordinate y" }));
    }
}
