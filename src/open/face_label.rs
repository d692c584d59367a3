//! The number of a face record that says to which instance (grain, segment) the face belongs.

use super::ply_header::{Element, Kind, Property};
use super::scalar::Scalar;

/// Names under which instances are written, for faces and vertices, the likelier first.
pub const LABEL_NAMES: [&str; 8] =
    ["segment", "label", "grain_id", "segment_id", "grain", "instance", "instance_id", "id"];

/// Whether a property is a number that may be a label.
pub(super) fn may_be_label(property: &Property) -> bool {
    matches!(property.kind, Kind::Number(_)) && LABEL_NAMES.contains(&property.name.as_str())
}

/// Where the label lies in a face record, seen from its list of corners.
#[derive(Debug, Clone)]
pub(super) struct FaceLabel {
    pub(super) name: &'static str,
    pub(super) scalar: Scalar,
    place: Place,
}

#[derive(Debug, Clone, Copy)]
enum Place {
    /// So many bytes before the list begins.
    Before(usize),
    /// So many bytes behind its end.
    Behind(usize),
}

impl FaceLabel {
    /// The label of the likeliest name; none if there is none, or if another list lies between it and the corners,
    /// which are property number `corners`.
    pub(super) fn find(element: &Element, corners: usize) -> Option<FaceLabel> {
        LABEL_NAMES.iter().find_map(|&name| {
            let at = element.properties.iter().position(|p| p.name == name)?;
            let Kind::Number(scalar) = element.properties[at].kind else { return None };
            let place = if at < corners {
                Place::Before(numbers_bytes(&element.properties[at..corners])?)
            } else {
                Place::Behind(numbers_bytes(&element.properties[corners + 1..at])?)
            };
            Some(FaceLabel { name, scalar, place })
        })
    }

    /// The label, in a file of these bytes, of a face whose list of corners is so long and begins at byte `list`.
    #[inline]
    pub(super) fn number(&self, bytes: &[u8], list: usize, list_bytes: usize) -> f64 {
        let at = match self.place {
            Place::Before(back) => list - back,
            Place::Behind(offset) => list + list_bytes + offset,
        };
        self.scalar.number(&bytes[at..])
    }
}

/// Length of some properties; none if one is a list.
fn numbers_bytes(properties: &[Property]) -> Option<usize> {
    properties
        .iter()
        .map(|p| match p.kind {
            Kind::Number(scalar) => Some(scalar.size()),
            Kind::List { .. } => None,
        })
        .sum()
}
