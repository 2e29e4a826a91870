//! The model's wedges: their lists by position, and the most similar of several.

use super::curve::Curve;
use crate::model::Model;

/// The wedges of each position, numbered along a [`Curve`].
pub struct WedgeLists {
    ends: Vec<u32>,
    wedges: Vec<u32>,
}

impl WedgeLists {
    pub fn new(model: &Model, curve: &Curve) -> WedgeLists {
        let mut ends = vec![0; model.positions.len()];
        let place = |&position: &u32| curve.places[position as usize];
        model.wedge_positions.iter().for_each(|position| ends[place(position) as usize] += 1);
        let mut sum = 0;
        for end in &mut ends {
            sum += *end;
            *end = sum;
        }
        let mut wedges = vec![0; model.wedge_positions.len()];
        let mut next = ends.clone();
        for (wedge, place) in model.wedge_positions.iter().map(place).enumerate().rev() {
            next[place as usize] -= 1;
            wedges[next[place as usize] as usize] = wedge as u32;
        }
        WedgeLists { ends, wedges }
    }

    pub fn of(&self, position: u32) -> &[u32] {
        let start = if position == 0 { 0 } else { self.ends[position as usize - 1] };
        &self.wedges[start as usize..self.ends[position as usize] as usize]
    }
}

/// The wedge of `choices` whose attributes are nearest to those of `wedge`.
pub fn nearest_wedge(model: &Model, wedge: u32, choices: &[u32]) -> u32 {
    let attributes = &model.attributes;
    let squared = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(x, y)| f64::from(x - y).powi(2)).sum::<f64>();
    let bytes = |a: &[u8], b: &[u8]| {
        a.iter().zip(b).map(|(&x, &y)| ((f64::from(x) - f64::from(y)) / 255.0).powi(2)).sum::<f64>()
    };
    let difference = |other: u32| {
        let (i, j) = (wedge as usize, other as usize);
        let mut sum = 0.0;
        if !attributes.normals.is_empty() {
            sum += squared(&attributes.normals[i], &attributes.normals[j]);
        }
        if !attributes.coordinates.is_empty() {
            sum += squared(&attributes.coordinates[i], &attributes.coordinates[j]);
        }
        if !attributes.colors.is_empty() {
            sum += bytes(&attributes.colors[i], &attributes.colors[j]);
        }
        sum
    };
    let min = choices.iter().copied().min_by(|&x, &y| difference(x).total_cmp(&difference(y)));
    min.expect("a position has a wedge")
}
