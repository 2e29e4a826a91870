//! The error of instances without room in their index buffer.

use crate::paper::progressive_mesh::run::TooMany;
use crate::vk::Error;

/// Instances without room.
#[derive(Debug)]
pub enum Unfit {
    TooMany(TooMany),
    Vulkan(Error),
}

impl From<TooMany> for Unfit {
    fn from(error: TooMany) -> Unfit {
        Unfit::TooMany(error)
    }
}

impl From<Error> for Unfit {
    fn from(error: Error) -> Unfit {
        Unfit::Vulkan(error)
    }
}

impl Unfit {
    /// The error for the index buffer `indices`; its limit is reported as one of the device.
    pub fn of(self, indices: &str) -> Error {
        match self {
            Unfit::TooMany(error) => Error::Limit { object: indices.to_owned(), what: error.to_string() },
            Unfit::Vulkan(error) => error,
        }
    }
}
