//! Axes: positions of values, and the values to label.

/// Maps an interval of values to an interval of a drawing.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    low: f64,
    high: f64,
    log: bool,
    from: f64,
    to: f64,
}

impl Scale {
    /// Covers `values` with a margin; a linear scale of non-negative values starts at 0. `None` without
    /// values, or on a logarithmic scale without positive values.
    pub fn covering(values: &[f64], log: bool, [from, to]: [f64; 2]) -> Option<Scale> {
        let usable = || values.iter().copied().filter(|v| v.is_finite() && (!log || *v > 0.0));
        let low = usable().reduce(f64::min)?;
        let high = usable().reduce(f64::max)?;
        let (low, high) = match log {
            // The margin is a twentieth of the interval, but at least a quarter of an octave.
            true => {
                let room = (high / low).powf(0.05).max(2f64.powf(0.25));
                (low / room, high * room)
            }
            false if low >= 0.0 => (0.0, if high > 0.0 { high * 1.06 } else { 1.0 }),
            false => {
                let room = if high > low { (high - low) * 0.06 } else { low.abs() };
                (low - room, (high + room).max(0.0))
            }
        };
        Some(Scale { low, high, log, from, to })
    }

    /// As [`Scale::covering`], but the scale starts at 0 only if this leaves at most half of the drawing empty. For
    /// line charts, in which the distance from 0 carries no meaning.
    pub fn around(values: &[f64], log: bool, ends: [f64; 2]) -> Option<Scale> {
        let usable = || values.iter().copied().filter(|v| v.is_finite());
        let (low, high) = (usable().reduce(f64::min)?, usable().reduce(f64::max)?);
        match !log && low > high / 2.0 && low < high {
            true => Scale::along(values, log, ends),
            false => Scale::covering(values, log, ends),
        }
    }

    /// As [`Scale::covering`], with margins on both sides and without a forced zero: for a sweep.
    pub fn along(values: &[f64], log: bool, [from, to]: [f64; 2]) -> Option<Scale> {
        let mut scale = Scale::covering(values, log, [from, to])?;
        if !log {
            let usable = || values.iter().copied().filter(|v| v.is_finite());
            let (low, high) = (usable().reduce(f64::min)?, usable().reduce(f64::max)?);
            let room = if high > low { (high - low) * 0.05 } else { 1.0 };
            (scale.low, scale.high) = (low - room, high + room);
        }
        Some(scale)
    }

    /// True if the scale can show `value`.
    pub fn shows(&self, value: f64) -> bool {
        value.is_finite() && (!self.log || value > 0.0)
    }

    /// Position of a value; values outside are placed at the edge.
    pub fn at(&self, value: f64) -> f64 {
        let share = match self.log {
            true => (value / self.low).ln() / (self.high / self.low).ln(),
            false => (value - self.low) / (self.high - self.low),
        };
        self.from + share.clamp(0.0, 1.0) * (self.to - self.from)
    }

    /// Round values to label. On a linear scale: about `count` multiples of 1, 2 or 5 times a power of ten. On a
    /// logarithmic scale of more than 2.2 decades: powers of ten, or every n-th power if there are many. Up to 2.2
    /// decades, also 3 times each power. Up to 1.2 decades, instead 1, 2 and 5 times each power. Up to 0.6 decades, as
    /// on a linear scale.
    pub fn ticks(&self, count: usize) -> Vec<f64> {
        if !self.log {
            return self.linear_ticks(count);
        }
        let decades = (self.high / self.low).log10();
        let (first, last) = (self.low.log10().floor() as i32, self.high.log10().ceil() as i32);
        let digits: &[f64] = match decades {
            d if d > 2.2 => &[1.0],
            d if d > 1.2 => &[1.0, 3.0],
            d if d > 0.6 => &[1.0, 2.0, 5.0],
            _ => return self.linear_ticks(count),
        };
        let step = (decades / count as f64).ceil().max(1.0) as i32;
        (first..=last)
            .filter(|decade| decade.rem_euclid(step) == 0)
            .flat_map(|decade| digits.iter().map(move |digit| decimal(*digit, decade)))
            .filter(|value| (self.low..=self.high).contains(value))
            .collect()
    }

    fn linear_ticks(&self, count: usize) -> Vec<f64> {
        let rough = (self.high - self.low) / count as f64;
        let decade = rough.log10().floor() as i32;
        let mantissa = rough / 10f64.powi(decade);
        // The nearest of 1, 2, 5 and 10 by ratio. The bounds are the square roots of 2, 10 and 50.
        let digit = match mantissa {
            m if m < 2f64.sqrt() => 1.0,
            m if m < 10f64.sqrt() => 2.0,
            m if m < 50f64.sqrt() => 5.0,
            _ => 10.0,
        };
        let step = decimal(digit, decade);
        let first = (self.low / step).ceil() as i64;
        // A product n * step could print as 0.30000000000000004.
        (first..).map(|n| decimal(n as f64 * digit, decade)).take_while(|value| *value <= self.high).collect()
    }

    /// The `values` whose labels fit: each is at least `apart` units after the previous label.
    pub fn with_room(&self, values: &[f64], apart: f64) -> Vec<f64> {
        let mut kept: Vec<f64> = Vec::new();
        for &value in values.iter().filter(|v| self.shows(**v)) {
            if kept.last().is_none_or(|&last| (self.at(value) - self.at(last)).abs() >= apart) {
                kept.push(value);
            }
        }
        kept
    }
}

/// `digit * 10^decade`, rounded once.
fn decimal(digit: f64, decade: i32) -> f64 {
    match decade {
        0.. => digit * 10f64.powi(decade),
        _ => digit / 10f64.powi(-decade),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let scale = |values: &[f64], log| Scale::covering(values, log, [0.0, 100.0]).unwrap();
        assert_eq!(scale(&[84.3, 20.0], false).ticks(5), [0.0, 20.0, 40.0, 60.0, 80.0]);
        assert_eq!(scale(&[0.31, 0.1], false).ticks(4), [0.0, 0.1, 0.2, 0.3]);
        assert_eq!(scale(&[0.01, 100.0], true).ticks(5), [0.01, 0.1, 1.0, 10.0, 100.0]);
        assert_eq!(scale(&[3.0, 9.0], true).ticks(5), [5.0, 10.0]);
        assert_eq!(scale(&[-3.0, 5.0], false).ticks(4), [-2.0, 0.0, 2.0, 4.0]);
        let wide = scale(&[1e-9, 1e9], true).ticks(5);
        assert!(wide.len() <= 6 && wide.iter().all(|tick| tick.log10().fract() == 0.0), "{wide:?}");
    }

    #[test]
    fn a_value_maps_to_its_share_of_the_interval() {
        let scale = Scale::covering(&[0.0, 100.0], false, [10.0, 116.0]).unwrap();
        assert_eq!((scale.at(0.0), scale.at(50.0), scale.at(100.0)), (10.0, 60.0, 110.0));
        let log = Scale::covering(&[1.0, 100.0], true, [0.0, 1.0]).unwrap();
        assert!((log.at(10.0) - 0.5).abs() < 1e-12);
        // A value that a scale cannot show is placed at its edge; `shows` returns false.
        assert!(log.at(0.0) == 0.0 && !log.shows(0.0) && !log.shows(f64::NAN));
    }

    #[test]
    fn lines_start_at_zero_unless_half_of_the_drawing_would_be_empty() {
        let first = |values: &[f64]| Scale::around(values, false, [0.0, 1.0]).unwrap().low;
        assert_eq!((first(&[1.0, 3.0]), first(&[7.0]), first(&[0.0, 0.0])), (0.0, 0.0, 0.0));
        assert!((0.89..0.9).contains(&first(&[0.9, 1.0])));
    }

    #[test]
    fn a_scale_of_no_value_or_one_value_is_not_empty() {
        assert!(Scale::covering(&[], false, [0.0, 1.0]).is_none());
        assert!(Scale::covering(&[0.0, -1.0], true, [0.0, 1.0]).is_none());
        for log in [false, true] {
            for make in [Scale::covering, Scale::along] {
                let one = make(&[7.0], log, [0.0, 1.0]).unwrap();
                assert!((0.01..=0.99).contains(&one.at(7.0)), "{log}: {}", one.at(7.0));
            }
        }
        let zeros = Scale::covering(&[0.0, 0.0], false, [0.0, 1.0]).unwrap();
        assert_eq!(zeros.at(0.0), 0.0);
    }
}
