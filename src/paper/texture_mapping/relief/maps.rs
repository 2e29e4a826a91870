//! The maps that set a tracer's steps, in f32 as on the GPU: Donnelly's distances, refined distances, cones and
//! relaxed cones.
//!
//! A distance depends only on additions, multiplications and comparisons, which the GPU runs in the same order. So
//! the CPU's and the GPU's maps are equal to the bit.

use super::Relief;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::f64::consts::TAU;

/// Number of sectors of directions; each has one horizon.
pub const SECTORS: usize = 64;

/// Search radius of a horizon, in texels. Farther obstacles could only make the horizon steeper, so leaving them out
/// only shortens distances.
pub const REACH: usize = 32;

/// The points of a cell and the rays of a sector for which a distance holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Holds {
    /// Only the cell's centre and the sector's middle, as in Donnelly's and the paper's maps.
    AtCentres,
    /// All points and all rays.
    Everywhere,
}

impl Holds {
    /// The distance between two cells' centres along an axis, less the least distance between their points, in cells.
    fn extent(self) -> f32 {
        f32::from(u8::from(self == Holds::Everywhere))
    }

    /// Side of the squares of a [`Fan`], in cells.
    fn square(self) -> usize {
        if self == Holds::Everywhere { 2 } else { 1 }
    }
}

/// Offsets and sectors for building distance maps; they are the same for every relief.
#[derive(Clone, Debug, PartialEq)]
pub struct Fan {
    pub holds: Holds,
    /// Index into `squares` of the first square for each sector and each distance 1 ..= REACH. The last entry is the
    /// number of squares.
    pub starts: Vec<u32>,
    /// Squares of cells, each given by the offset of its first cell. The squares of a sector and a distance cover the
    /// cells that may contain a point at this distance from a point of cell (0, 0) in a direction of the
    /// sector, and no others.
    pub squares: Vec<[i32; 2]>,
    /// The cells with offsets -radius ..= radius in x and y, the nearest first: the offset, the first of the sectors
    /// opposite to the directions to that cell, and the number of these sectors.
    pub near: Vec<[i32; 4]>,
    pub radius: i32,
}

impl Fan {
    /// Offsets and sectors for reliefs of at most this depth. The depth bounds all distances.
    pub fn new(depth: f32, holds: Holds) -> Fan {
        let radius = depth.ceil() as i32 + 1;
        let mut fan = Fan { holds, starts: vec![0], squares: Vec::new(), near: Vec::new(), radius };
        for sector in 0..SECTORS {
            for distance in 1..=REACH {
                fan.squares.extend(match holds {
                    Holds::AtCentres => vec![cell_towards(sector, distance as f64)],
                    Holds::Everywhere => squares_on_arc(sector, distance as f64),
                });
                fan.starts.push(fan.squares.len() as u32);
            }
        }
        let side = 2 * radius + 1;
        let mut offsets: Vec<[i32; 2]> =
            (0..side * side).map(|at| [at % side - radius, at / side - radius]).collect();
        offsets.sort_by_key(|&offset| across(offset, holds.extent()) as i32);
        let near = offsets.into_iter().map(|[a, b]| {
            let [first, count] = sectors_behind(a, b, holds);
            [a, b, first as i32, count as i32]
        });
        fan.near = near.collect();
        fan
    }

    /// For each cell, row by row, the least height in the square of cells that starts at this cell.
    pub fn lows(&self, bounds: &[[f32; 2]], side: usize) -> Vec<f32> {
        let square = self.holds.square();
        let low = |at: usize| {
            let cells = (0..square * square).map(|n| [at % side + n % square, at / side + n / square]);
            let lows = cells.map(|[x, y]| bounds[y % side * side + x % side][0]);
            lows.fold(f32::INFINITY, f32::min)
        };
        (0..side * side).map(low).collect()
    }
}

/// The square of the least distance along the plane between points of cells (0, 0) and (a, b).
fn across([a, b]: [i32; 2], extent: f32) -> f32 {
    let gap = |at: i32| (at.abs() as f32 - extent).max(0.0);
    gap(a) * gap(a) + gap(b) * gap(b)
}

/// The cell whose centre is nearest to the point at this distance from the centre of cell (0, 0), in the sector's
/// middle.
fn cell_towards(sector: usize, distance: f64) -> [i32; 2] {
    let angle = (sector as f64 + 0.5) * TAU / SECTORS as f64;
    [distance * angle.cos(), distance * angle.sin()].map(|c| c.round() as i32)
}

/// Intervals between the sample points of a sector's arc.
const SAMPLES: usize = 64;

/// Points at `distance` from the origin, evenly spaced over the sector, and a reach. A cell counts if its centre is
/// within this reach of a point along both axes. The reach is one cell, because both points may lie anywhere in their
/// cells, plus the distance between two points of the arc.
fn arc(sector: usize, distance: f64) -> (impl Iterator<Item = [f64; 2]>, f64) {
    let turn = TAU / SECTORS as f64;
    let points = (0..=SAMPLES).map(move |n| {
        let angle = (sector as f64 + n as f64 / SAMPLES as f64) * turn;
        [distance * angle.cos(), distance * angle.sin()]
    });
    (points, 1.0 + distance * turn / SAMPLES as f64)
}

/// Squares of 2 x 2 cells. Together they are the cells that contain a point at `distance` from a point of cell (0, 0)
/// in a direction of the sector.
fn squares_on_arc(sector: usize, distance: f64) -> Vec<[i32; 2]> {
    let (points, reach) = arc(sector, distance);
    let squares = points.flat_map(|point| {
        // Along an axis, two or three cells are within reach.
        let [a, b] = point.map(|c| (c - reach).ceil() as i32..(c + reach).floor() as i32);
        b.flat_map(move |b| a.clone().map(move |a| [a, b]))
    });
    squares.collect::<BTreeSet<_>>().into_iter().collect()
}

/// The sectors opposite to the directions from a point of cell (0, 0) to a point of cell (a, b): the first sector and
/// the number of sectors.
fn sectors_behind(a: i32, b: i32, holds: Holds) -> [u32; 2] {
    let centre = f64::from(b).atan2(f64::from(a));
    let sector = |angle: f64| ((angle + centre + 0.5 * TAU) * SECTORS as f64 / TAU).floor();
    let reach = match holds {
        Holds::AtCentres => return [sector(0.0).rem_euclid(SECTORS as f64) as u32, 1],
        // Between points of touching cells, every direction occurs.
        Holds::Everywhere if a.abs() <= 1 && b.abs() <= 1 => return [0, SECTORS as u32],
        Holds::Everywhere => [[-1, -1], [1, -1], [-1, 1], [1, 1]],
    };
    let corners = reach.map(|[x, y]| {
        let angle = f64::from(b + y).atan2(f64::from(a + x)) - centre;
        // Maps the angle relative to the cell's centre to -1/2 ..= 1/2 turn.
        angle - (angle / TAU).round() * TAU
    });
    let (low, high) = corners.iter().fold((0f64, 0f64), |(low, high), &c| (low.min(c), high.max(c)));
    let (first, last) = (sector(low - 1e-9), sector(high + 1e-9));
    [first.rem_euclid(SECTORS as f64) as u32, (last - first) as u32 + 1]
}

/// Least and greatest height of each cell, row by row. With `AtCentres` both are the height at the centre.
pub fn bounds(relief: &Relief, holds: Holds) -> Vec<[f32; 2]> {
    let side = relief.side as i64;
    let cells = (0..side).flat_map(|j| (0..side).map(move |i| (i, j)));
    let of_cell = |(i, j)| {
        let corners = relief.corners(i, j);
        match holds {
            Holds::AtCentres => [0.25 * ((corners[0] + corners[1]) + (corners[2] + corners[3])); 2],
            Holds::Everywhere => {
                [corners.into_iter().fold(f32::INFINITY, f32::min), corners.into_iter().fold(0.0, f32::max)]
            }
        }
    };
    cells.map(of_cell).collect()
}

/// Distances by which a ray may step, for cells of 1 x 1 x depth / layers texels, layer by layer from below.
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceMap {
    pub layers: usize,
    /// In texels.
    pub distances: Vec<f32>,
}

/// A cell whose distance is being computed.
struct Cell<'a> {
    relief: &'a Relief,
    bounds: &'a [[f32; 2]],
    lows: &'a [f32],
    at: [i32; 2],
    /// Least and greatest height of the points of the cell for which the distance must hold.
    low: f32,
    high: f32,
    /// [`Holds::extent`].
    extent: f32,
}

impl Cell<'_> {
    /// The index of a cell at an offset.
    fn place(&self, [a, b]: [i32; 2]) -> usize {
        let wrap = |at: i32| at.rem_euclid(self.relief.side as i32) as usize;
        wrap(self.at[1] + b) * self.relief.side + wrap(self.at[0] + a)
    }

    /// The least tangent of the horizon over all directions of a sector and all points of the cell.
    fn horizon(&self, fan: &Fan, sector: usize) -> f32 {
        (0..REACH).fold(0.0, |steepest: f32, n| {
            let range = fan.starts[sector * REACH + n] as usize..fan.starts[sector * REACH + n + 1] as usize;
            let lowest = fan.squares[range].iter().map(|&at| self.lows[self.place(at)]);
            steepest.max((lowest.fold(f32::INFINITY, f32::min) - self.high) * inverse(n + 1))
        })
    }

    /// The square of the least distance from this cell to a surface point in the cell at `offset`. A point counts only
    /// if the line to it from this cell descends with a tangent of at least `slope`. If no point counts, the result is
    /// infinite.
    fn squared_distance(&self, offset: [i32; 2], slope: f32) -> f32 {
        let across = across(offset, self.extent);
        let [lowest, highest] = self.bounds[self.place(offset)];
        let drop = slope * exact_root(across);
        if self.high - drop < lowest {
            return f32::INFINITY;
        }
        let below = (self.low - highest).max(drop).max(0.0);
        across + below * below
    }
}

/// 1 / distance, equal on every device.
pub fn inverse(distance: usize) -> f32 {
    (1.0 / distance as f64) as f32
}

/// The largest f32 whose rounded square is at most `square`. Every device finds the same number, however the device
/// rounds square roots.
pub fn exact_root(square: f32) -> f32 {
    // Squares of smaller roots underflow.
    if square < f32::MIN_POSITIVE {
        return 0.0;
    }
    let mut root = square.sqrt();
    while root * root > square {
        root = f32::from_bits(root.to_bits() - 1);
    }
    while f32::from_bits(root.to_bits() + 1) * f32::from_bits(root.to_bits() + 1) <= square {
        root = f32::from_bits(root.to_bits() + 1);
    }
    root
}

/// Donnelly's map, or the refined one if `refined`.
pub fn distance_map(relief: &Relief, layers: usize, fan: &Fan, refined: bool) -> DistanceMap {
    let (side, bounds) = (relief.side, bounds(relief, fan.holds));
    let lows = fan.lows(&bounds, side);
    let thickness = relief.depth / layers as f32;
    // The heights between which the distance must hold, as shares of a layer's thickness.
    let [lowest, highest] = match fan.holds {
        Holds::AtCentres => [0.5, 0.5],
        Holds::Everywhere => [0.0, 1.0],
    };
    let extent = fan.holds.extent();
    let distance = |index: usize| {
        let [i, j, layer] = [index % side, index / side % side, index / (side * side)];
        let [low, high] = [lowest, highest].map(|share| (layer as f32 + share) * thickness);
        let at = [i as i32, j as i32];
        let cell = Cell { relief, bounds: &bounds, lows: &lows, at, low, high, extent };
        if cell.high <= bounds[j * side + i][0] {
            return 0.0;
        }
        let horizon = |sector| if refined { cell.horizon(fan, sector) } else { 0.0 };
        let horizons: Vec<f32> = (0..SECTORS).map(horizon).collect();
        let squares = fan.near.iter().map(|&[a, b, first, count]| {
            let behind = (first..first + count).map(|sector| horizons[sector as usize % SECTORS]);
            cell.squared_distance([a, b], behind.fold(f32::INFINITY, f32::min))
        });
        exact_root(squares.fold(f32::INFINITY, f32::min))
    };
    let distances = (0..side * side * layers).into_par_iter().map(distance).collect();
    DistanceMap { layers, distances }
}

impl DistanceMap {
    /// The map's words with 8, 16 or 32 bits per cell, and the distance that the value 1 represents. Values are rounded
    /// down, so that no distance grows. 32 bits keep the f32 unchanged.
    pub fn packed(&self, bits: u32) -> (Vec<u32>, f32) {
        if bits == 32 {
            return (self.distances.iter().map(|distance| distance.to_bits()).collect(), 1.0);
        }
        let max = (1u32 << bits) - 1;
        let unit = self.distances.iter().copied().fold(f32::MIN_POSITIVE, f32::max) / max as f32;
        let quantised = |distance: &f32| {
            let mut steps = ((distance / unit) as u32).min(max);
            while steps as f32 * unit > *distance {
                steps -= 1;
            }
            steps
        };
        let word = |cells: &[f32]| {
            cells
                .iter()
                .enumerate()
                .fold(0, |word, (n, distance)| word | quantised(distance) << (n as u32 * bits))
        };
        (self.distances.chunks((32 / bits) as usize).map(word).collect(), unit)
    }

    /// The map as a tracer reads it from [`DistanceMap::packed`].
    pub fn rounded_down(&self, bits: u32) -> DistanceMap {
        let (words, unit) = self.packed(bits);
        let each = (32 / bits) as usize;
        let cell = |at: usize| match bits {
            32 => f32::from_bits(words[at]),
            _ => (words[at / each] >> (at % each * bits as usize) & ((1 << bits) - 1)) as f32 * unit,
        };
        DistanceMap { layers: self.layers, distances: (0..self.distances.len()).map(cell).collect() }
    }
}

/// Steps of a ray inside the solid, from its entry to the floor.
const MARCH: u32 = 32;

/// Cones on the texels as ratios of radius to height, at most 1. Dummer's cones contain no other texel. Inside a
/// relaxed cone a ray may enter the solid once. For each other texel, a ray starts on the top plane above the cone's
/// own texel and passes through the other texel. The point at which this ray leaves the solid limits the relaxed cone.
pub fn cone_map(relief: &Relief, relaxed: bool) -> Vec<f32> {
    let (side, reach) = (relief.side as i64, relief.side as i64 / 2);
    let offsets = || (-reach..=reach).flat_map(move |b| (-reach..=reach).map(move |a| [a, b]));
    let cone = |at: i64| {
        let own = [at % side, at / side];
        let height = relief.texel(own[0], own[1]);
        offsets().fold(1.0, |widest: f32, [a, b]| {
            let mut obstacle = [a as f32, b as f32, relief.texel(own[0] + a, own[1] + b)];
            if obstacle[2] <= height {
                return widest;
            }
            if relaxed && obstacle[2] < relief.depth {
                obstacle = leaves(relief, own, obstacle);
            }
            let above = obstacle[2] - height;
            if above > 0.0 { widest.min(obstacle[0].hypot(obstacle[1]) / above) } else { widest }
        })
    };
    (0..side * side).into_par_iter().map(cone).collect()
}

/// The point at which the ray from the top plane above texel `own` leaves the solid again; the ray passes through
/// `[x, y, z]`, relative to that texel.
fn leaves(relief: &Relief, own: [i64; 2], [x, y, z]: [f32; 3]) -> [f32; 3] {
    let scale = z / (relief.depth - z) / MARCH as f32;
    let along = [x * scale, y * scale, (z - relief.depth) * scale];
    let points =
        (0..=MARCH).map(|n| [x + n as f32 * along[0], y + n as f32 * along[1], z + n as f32 * along[2]]);
    let outside = |[x, y, z]: &[f32; 3]| {
        let [i, j] = [x, y].map(|c| (c + 0.5).floor() as i64);
        relief.texel(own[0] + i, own[1] + j) < *z
    };
    points.into_iter().find(outside).unwrap_or([x, y, 0.0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_cover_the_cells_within_reach_of_an_arc_and_no_others() {
        for (sector, distance) in (0..SECTORS).flat_map(|sector| [1, 2, 7, REACH].map(|n| (sector, n))) {
            let (points, reach) = arc(sector, distance as f64);
            let points: Vec<[f64; 2]> = points.collect();
            let near = |&[a, b]: &[i32; 2]| {
                let within = |c: f64, at: i32| (c - f64::from(at)).abs() <= reach;
                points.iter().any(|&[x, y]| within(x, a) && within(y, b))
            };
            let side = distance as i32 + 2;
            let all = (-side..=side).flat_map(|b| (-side..=side).map(move |a| [a, b]));
            let squares = squares_on_arc(sector, distance as f64);
            let covered = squares.iter().flat_map(|[a, b]| [0, 1, 2, 3].map(|n| [a + n % 2, b + n / 2]));
            assert_eq!(covered.collect::<BTreeSet<_>>(), all.filter(near).collect(), "{sector} {distance}");
        }
    }

    #[test]
    fn near_cells_are_sorted_by_distance_and_each_is_listed_once() {
        for holds in [Holds::AtCentres, Holds::Everywhere] {
            let fan = Fan::new(3.5, holds);
            let distances: Vec<f32> =
                fan.near.iter().map(|&[a, b, ..]| across([a, b], holds.extent())).collect();
            assert!(distances.is_sorted());
            let cells: BTreeSet<[i32; 2]> = fan.near.iter().map(|&[a, b, ..]| [a, b]).collect();
            assert_eq!((cells.len(), fan.near.len()), (121, 121));
        }
    }
}
