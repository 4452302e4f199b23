//! Placement of labels without overlap.

use nearmiss_draw::canvas::Area;

/// The areas of the labels that are placed already.
#[derive(Default)]
pub(super) struct Labels(Vec<Area>);

impl Labels {
    /// Claims an area for a label. Returns `true` if it is free.
    pub(super) fn has_room(&mut self, area: Area) -> bool {
        let ends = |a: &Area| [a.left + a.width, a.top + a.height];
        let [right, bottom] = ends(&area);
        let meets = |other: &Area| {
            let [x, y] = ends(other);
            area.left < x && other.left < right && area.top < y && other.top < bottom
        };
        let has_room = !self.0.iter().any(meets);
        if has_room {
            self.0.push(area);
        }
        has_room
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_labels_are_drawn_than_fit() {
        let mut labels = Labels::default();
        let at = |left: usize, top: usize| Area { left, top, width: 10, height: 5 };
        assert!(labels.has_room(at(20, 20)));
        assert!(!labels.has_room(at(29, 24)) && !labels.has_room(at(11, 16)) && !labels.has_room(at(20, 20)));
        assert!(labels.has_room(at(30, 20)) && labels.has_room(at(20, 15)) && !labels.has_room(at(25, 16)));
    }
}
