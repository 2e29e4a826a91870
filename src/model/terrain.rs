//! Real heights: Mount Everest and 60 km about it, from a 30" grid (scenes/everest.NOTICE).

use super::{Model, generate};
use glam::DVec3;

const PICTURE: &[u8] = include_bytes!("../../scenes/everest.png");
/// Samples on a side, the middle one being the summit.
const SIDE: u32 = 129;
/// 30" on a sphere of 6371 km, and their part along the parallel of 27.9875 degrees.
const NORTH_M: f64 = 926.6;
const EAST_M: f64 = 818.2;

/// Metres east and north of the summit, and above the sea: 32 768 faces, open.
pub(super) fn everest() -> Model {
    let heights = decode().expect("the shipped picture is decoded by a test");
    let middle = f64::from(SIDE / 2);
    generate::heights([SIDE, SIDE], |column, row| {
        // Rows of a model go north, those of the picture south.
        let sample = (SIDE - 1 - row) * SIDE + column;
        let [east, north] = [column, row].map(|index| f64::from(index) - middle);
        DVec3::new(east * EAST_M, north * NORTH_M, heights[sample as usize])
    })
}

/// Metres, rows from the north.
fn decode() -> Result<Vec<f64>, png::DecodingError> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(PICTURE)).read_info()?;
    let mut samples = vec![0; 2 * (SIDE * SIDE) as usize];
    reader.next_frame(&mut samples)?;
    Ok(samples.chunks_exact(2).map(|pair| f64::from(u16::from_be_bytes([pair[0], pair[1]]))).collect())
}
