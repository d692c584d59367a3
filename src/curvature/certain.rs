//! Values that are certain, or not known.

/// A value, or none where something beyond what was loaded could change it. Half the size of an `Option`: there is one
/// for every vertex of a tile.
#[derive(Debug, Clone, Copy)]
pub struct Certain(f64);

impl Certain {
    /// Not known. No value that is known is NaN.
    pub const NONE: Certain = Certain(f64::NAN);

    /// The value, if it is known.
    pub fn value(self) -> Option<f64> {
        (!self.0.is_nan()).then_some(self.0)
    }

    /// Whether it is known.
    pub fn is_known(self) -> bool {
        !self.0.is_nan()
    }
}

impl From<Option<f64>> for Certain {
    fn from(value: Option<f64>) -> Certain {
        debug_assert!(value.is_none_or(|v| !v.is_nan()), "a certain value that is not a number");
        value.map_or(Certain::NONE, Certain)
    }
}
