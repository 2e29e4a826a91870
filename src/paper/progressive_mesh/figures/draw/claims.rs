//! What the numbers of pm.draw say.

use super::super::short;
use super::{
    CELLS, CLASSICAL, COMPACTED, DISCRETE, OURS, RANDOM, RE_OPTIMISED, SHADED, SIMULATED, SKIP_LISTS, TIME,
    VARIANTS,
};
use crate::figure::{Finding, Table, Verdict};

/// `dear` over `cheap` in a cell.
fn ratio(table: &Table, cell: &str, quantity: &str, [dear, cheap]: [&str; 2]) -> Option<f64> {
    let of = |variant| table.number(cell, None, variant, quantity);
    Some(of(dear)? / of(cheap)?)
}

const NONE: &str = "the cell is missing, or the device keeps no time";

pub fn device_counts(table: &Table) -> Finding {
    let found = ratio(table, CELLS[0].0, SHADED, [CLASSICAL, OURS]);
    let simulated = ratio(table, CELLS[0].0, SIMULATED, [CLASSICAL, OURS]);
    let (Some(found), Some(simulated)) = (found, simulated) else {
        return Finding::new(Verdict::NotMeasurable, "", NONE);
    };
    let verdict = match found {
        found if found >= 2.0 => Verdict::Reproduced,
        found if found > 1.0 => Verdict::InPart,
        _ => Verdict::NotReproduced,
    };
    let invocations =
        |variant| table.number(CELLS[0].0, None, variant, SHADED).map_or_else(String::new, short);
    let numbers = format!(
        "classical {}, ours {}, re-optimised {}, skip lists {}, compacted {}, random {}: {} times fewer",
        invocations(CLASSICAL),
        invocations(OURS),
        invocations(RE_OPTIMISED),
        invocations(SKIP_LISTS),
        invocations(COMPACTED),
        invocations(RANDOM),
        short(found)
    );
    Finding::new(verdict, numbers, format!("a FIFO of 16 entries would say {} times", short(simulated)))
}

/// Whether the vertices' needless work is most of the heavy draw, and how much of it, by the cheapest order.
fn heavy_share(table: &Table) -> Option<(bool, f64)> {
    let of = |cell: usize| table.number(CELLS[cell].0, None, OURS, TIME);
    let share = 1.0 - of(0)? / of(1)?;
    Some((share >= 0.75, share))
}

pub fn vertex_bound(table: &Table) -> Finding {
    let found =
        CELLS[..2].iter().map(|(cell, ..)| Some((cell, ratio(table, cell, TIME, [CLASSICAL, OURS])?)));
    let found = found.collect::<Option<Vec<_>>>();
    let (Some(found), Some((bound, share))) = (found, heavy_share(table)) else {
        return Finding::new(Verdict::NotMeasurable, "", NONE);
    };
    let heavy = found[1].1;
    let verdict = match heavy {
        _ if !bound => Verdict::NotMeasurable,
        heavy if heavy >= 2.0 => Verdict::Reproduced,
        heavy if heavy > 1.1 => Verdict::InPart,
        _ => Verdict::NotReproduced,
    };
    let numbers: Vec<String> =
        found.iter().map(|(cell, ratio)| format!("{cell} {}", short(*ratio))).collect();
    let mut why = format!(
        "classical over ours; {:.0} % of the heavy draw in our order is the vertices' needless work",
        100.0 * share
    );
    if table.machine.is_software() {
        why += "; where it is none (the first number), a software device's times rank nothing on a GPU";
    }
    Finding::new(verdict, numbers.join(", "), why)
}

/// The orders of the faces that ours draws too.
fn others() -> impl Iterator<Item = &'static &'static str> {
    VARIANTS.iter().filter(|variant| ![OURS, DISCRETE].contains(*variant))
}

pub fn time_follows_vertices(table: &Table) -> Finding {
    let cell = CELLS[1].0;
    let of = |variant: &&str| {
        let of = |quantity| ratio(table, cell, quantity, [variant, OURS]);
        Some((of(TIME)?, of(SHADED)?))
    };
    let found: Option<Vec<(f64, f64)>> = others().map(of).collect();
    let (Some(found), Some((bound, _))) = (found, heavy_share(table)) else {
        return Finding::new(Verdict::NotMeasurable, "", NONE);
    };
    let near = found.iter().filter(|(time, shaded)| (time / shaded - 1.0).abs() <= 0.2).count();
    let verdict = match near {
        _ if !bound => Verdict::NotMeasurable,
        near if near == found.len() => Verdict::Reproduced,
        0 => Verdict::NotReproduced,
        _ => Verdict::InPart,
    };
    let words = others().zip(&found).map(|(variant, (time, shaded))| {
        format!("{variant} {}x the time at {}x the vertices", short(*time), short(*shaded))
    });
    let why = "over ours, `heavy vertices`; the rest of a draw does not grow with them";
    Finding::new(verdict, words.collect::<Vec<_>>().join(", "), why)
}

pub fn pixel_bound(table: &Table) -> Finding {
    let Some(found) = ratio(table, CELLS[2].0, TIME, [CLASSICAL, OURS]) else {
        return Finding::new(Verdict::NotMeasurable, "", NONE);
    };
    let verdict = match found {
        _ if table.machine.is_software() => Verdict::NotMeasurable,
        found if (found - 1.0).abs() < 0.1 => Verdict::Reproduced,
        _ => Verdict::NotReproduced,
    };
    let why = match table.machine.is_software() {
        true => "a software device shades vertices and pixels on the same cores, one after the other",
        false => "classical over ours",
    };
    Finding::new(verdict, short(found), why)
}

#[cfg(test)]
mod tests {
    use super::super::super::tests::table;
    use super::*;

    /// Vertices cost `light` and then `heavy` in our order, and `more` times that in the others.
    fn cells(light: f64, heavy: f64, more: f64) -> Vec<(&'static str, &'static str, &'static str, f64)> {
        let [first, second, third] = [CELLS[0].0, CELLS[1].0, CELLS[2].0];
        let mut rows = vec![
            (first, CLASSICAL, SHADED, 4.0),
            (first, OURS, SHADED, 1.6),
            (first, CLASSICAL, SIMULATED, 4.0),
            (first, OURS, SIMULATED, 1.3),
            (first, CLASSICAL, TIME, 1.2 * light),
            (first, OURS, TIME, light),
            (third, CLASSICAL, TIME, 5.1),
            (third, OURS, TIME, 5.0),
        ];
        for variant in VARIANTS {
            let times = if variant == OURS { 1.0 } else { more };
            rows.push((second, variant, SHADED, if variant == OURS { 1.6 } else { 4.0 }));
            rows.push((second, variant, TIME, heavy * times));
        }
        rows
    }

    #[test]
    fn an_order_is_judged_by_what_the_device_shades_and_by_time_where_vertices_are_most_of_it() {
        let verdicts = |kind, more, heavy| {
            let table = table(kind, &cells(2.0, heavy, more));
            [device_counts, vertex_bound, time_follows_vertices, pixel_bound]
                .map(|check| check(&table).verdict)
        };
        use Verdict::{InPart, NotMeasurable, NotReproduced, Reproduced};
        assert_eq!(verdicts("discrete", 2.5, 10.0), [Reproduced; 4]);
        assert_eq!(verdicts("cpu", 2.5, 10.0), [Reproduced, Reproduced, Reproduced, NotMeasurable]);
        assert_eq!(verdicts("cpu", 1.9, 10.0)[1..3], [InPart, NotReproduced], "1.9 of 2.5");
        assert_eq!(verdicts("cpu", 1.0, 10.0)[1..3], [NotReproduced; 2]);
        assert_eq!(
            verdicts("discrete", 2.5, 7.0)[1..3],
            [NotMeasurable; 2],
            "vertices are not the bottleneck"
        );
        assert_eq!(device_counts(&table("cpu", &[])).verdict, NotMeasurable);
    }
}
