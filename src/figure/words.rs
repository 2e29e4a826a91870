//! Numbers as text for readers.

/// Four significant digits, or the whole part if it is longer. Whole numbers below 10^15 are written in full, in groups
/// of three digits. Other numbers below 10^-4 or from 10^7 on are written as 1.234e-5.
pub fn human(number: f64) -> String {
    let size = number.abs();
    if !number.is_finite() {
        return match number {
            n if n.is_nan() => "not a number".into(),
            n if n > 0.0 => "infinite".into(),
            _ => "-infinite".into(),
        };
    }
    if number == 0.0 {
        return "0".into();
    }
    if number.fract() == 0.0 && size < 1e15 {
        return grouped(number);
    }
    if !(1e-4..1e7).contains(&size) {
        let text = format!("{number:.3e}");
        let (mantissa, exponent) = text.split_once('e').expect("{:e} writes an e");
        return format!("{}e{exponent}", trimmed(mantissa));
    }
    // Digits before the point, at most 0 for numbers below 1. Rounding may add a digit.
    let before = size.log10().floor() as i32 + 1;
    let text = format!("{number:.*}", (4 - before).max(0) as usize);
    match text.split_once('.') {
        Some(_) if size < 10_000.0 => trimmed(&text).to_string(),
        _ => grouped(number.round()),
    }
}

/// The text without trailing zeros of a fraction.
fn trimmed(text: &str) -> &str {
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.'),
        false => text,
    }
}

/// Groups the digits by narrow no-break spaces (ISO 80000-1), from five digits on: 1 234 567.
fn grouped(whole: f64) -> String {
    let digits = format!("{:.0}", whole.abs());
    let sign = if whole < 0.0 { "-" } else { "" };
    if digits.len() < 5 {
        return format!("{sign}{digits}");
    }
    let mut text = String::from(sign);
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// [`human`], but with large powers of two as 2¹⁸.
pub fn tick(number: f64) -> String {
    let power = number.log2();
    if number >= 4096.0 && power.fract() == 0.0 && power < 100.0 {
        let raised = |digit: char| {
            ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit.to_digit(10).expect("a digit") as usize]
        };
        return format!("2{}", power.to_string().chars().map(raised).collect::<String>());
    }
    human(number)
}

#[cfg(test)]
mod tests {
    use super::{human, tick};

    #[test]
    fn numbers_have_four_digits_but_whole_numbers_have_all_their_digits() {
        for (number, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (1.0, "1"),
            (-1234.0, "-1234"),
            (12345.0, "12\u{202f}345"),
            (1_048_576.0, "1\u{202f}048\u{202f}576"),
            (84.3, "84.3"),
            (84.321_9, "84.32"),
            (0.1, "0.1"),
            (0.123_456, "0.1235"),
            (0.001_234_56, "0.001235"),
            (0.000_012_34, "1.234e-5"),
            (12_345.67, "12\u{202f}346"),
            (1.0e7 + 0.5, "1e7"),
            (3.5e15, "3.5e15"),
            (9.999_96, "10"),
            (f64::INFINITY, "infinite"),
            (f64::NAN, "not a number"),
        ] {
            assert_eq!(human(number), text, "{number:?}");
        }
    }

    #[test]
    fn large_powers_of_two_are_written_as_powers() {
        assert_eq!(
            [tick(64.0), tick(4096.0), tick(262_144.0), tick(6000.0)],
            ["64", "2¹²", "2¹⁸", "6000"].map(String::from)
        );
    }
}
