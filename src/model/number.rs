//! Numbers as stored in files.

/// A fixed-size number type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NumberType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Endian {
    Little,
    Big,
}

impl NumberType {
    /// Size in bytes.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The number at the start of `bytes`; f64 holds every value of these types exactly.
    ///
    /// # Panics
    /// If there are fewer bytes than [`Self::size`].
    #[inline]
    pub(super) fn read(self, bytes: &[u8], endian: Endian) -> f64 {
        match self {
            Self::I8 => f64::from(bytes[0] as i8),
            Self::U8 => f64::from(bytes[0]),
            Self::I16 => f64::from(i16::from_le_bytes(little(bytes, endian))),
            Self::U16 => f64::from(u16::from_le_bytes(little(bytes, endian))),
            Self::I32 => f64::from(i32::from_le_bytes(little(bytes, endian))),
            Self::U32 => f64::from(u32::from_le_bytes(little(bytes, endian))),
            Self::F32 => f64::from(f32::from_le_bytes(little(bytes, endian))),
            Self::F64 => f64::from_le_bytes(little(bytes, endian)),
        }
    }

    /// A colour channel of this type as 0 ..= 255. A u16 is scaled from 0 ..= 65535 and a float from 0 ..= 1; other
    /// integers are clamped to 0 ..= 255.
    pub(super) fn channel(self, value: f64) -> u8 {
        let scaled = match self {
            Self::U16 => value / 257.0,
            Self::F32 | Self::F64 => value * 255.0,
            _ => value,
        };
        // NaN becomes 0.
        scaled.round().clamp(0.0, 255.0) as u8
    }
}

#[inline]
fn little<const N: usize>(bytes: &[u8], endian: Endian) -> [u8; N] {
    let bytes: [u8; N] = std::array::from_fn(|i| bytes[i]);
    match endian {
        Endian::Little => bytes,
        Endian::Big => std::array::from_fn(|i| bytes[N - 1 - i]),
    }
}
