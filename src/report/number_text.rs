//! Numbers as a person reads them, in one form on the terminal, in results and on pages: true minus, powers of ten raised.

/// A number of so many significant digits: `−0.00273`, `2.11×10⁻⁴`, `10,642,020`; what is none is `undefined`.
///
/// ```
/// use haloray::report::number_text;
/// assert_eq!(number_text(-0.002_731_2, 3), "−0.00273");
/// assert_eq!(number_text(20.9, 3), "20.9");
/// assert_eq!(number_text(2.109e-4, 3), "2.11×10⁻⁴");
/// assert_eq!(number_text(10_642_020.0, 3), "10,642,020");
/// ```
pub fn number_text(value: f64, digits: usize) -> String {
    /// Whole numbers up to here are counts, and written whole.
    const LARGEST_COUNT: f64 = 1e12;
    let size = value.abs();
    if value.is_nan() {
        return "undefined".into();
    }
    if value.is_infinite() {
        return if value > 0.0 { "∞".into() } else { "−∞".into() };
    }
    if value.fract() == 0.0 && size < LARGEST_COUNT {
        return sign(value).to_owned() + &grouped(size);
    }
    let digits = digits.max(1);
    // Rounded first, as 9.999 has another power of ten than 10.0.
    let scientific = format!("{size:.*e}", digits - 1);
    let (mantissa, power) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let power: i32 = power.parse().unwrap_or(0);
    if !(-3..6).contains(&power) {
        return format!("{}{mantissa}×10{}", sign(value), raised(power));
    }
    let decimals = usize::try_from(digits as i32 - 1 - power).unwrap_or(0);
    let text = format!("{size:.decimals$}");
    let (whole, part) = text.split_at(text.find('.').unwrap_or(text.len()));
    format!("{}{}{part}", sign(value), separated(whole))
}

/// The same with a plus before what is not negative, for tensors.
pub fn signed_text(value: f64, digits: usize) -> String {
    let text = number_text(value, digits);
    if value > 0.0 && value.is_finite() { "+".to_owned() + &text } else { text }
}

/// A number with so many decimals, for columns of one scale; a true minus.
pub fn decimals_text(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return number_text(value, decimals);
    }
    let text = format!("{:.decimals$}", value.abs());
    // No minus before what is rounded to nothing.
    let is_zero = text.bytes().all(|byte| byte == b'0' || byte == b'.');
    if is_zero { text } else { sign(value).to_owned() + &text }
}

/// A number and its standard error, both to the second digit of the error: `0.0280 ± 0.0041`.
///
/// ```
/// use haloray::report::with_error_text;
/// assert_eq!(with_error_text(0.028_004, 0.004_12), "0.0280 ± 0.0041");
/// assert_eq!(with_error_text(-12.0, 0.0), "−12 ± 0");
/// ```
pub fn with_error_text(value: f64, error: f64) -> String {
    const ERROR_DIGITS: i32 = 2;
    if !(value.is_finite() && error.is_finite() && error > 0.0) {
        return format!("{} ± {}", number_text(value, 4), number_text(error, 2));
    }
    let size = value.abs().max(error);
    let last = error.log10().floor() as i32 + 1 - ERROR_DIGITS;
    let decimals = usize::try_from(-last).unwrap_or(0);
    if !(-3.0..6.0).contains(&size.log10()) || decimals > 12 {
        let digits = (size.log10().floor() as i32 - last + 1).clamp(1, 15);
        return format!("{} ± {}", number_text(value, digits as usize), number_text(error, 2));
    }
    format!("{} ± {}", decimals_text(value, decimals), decimals_text(error, decimals))
}

/// A number and its interval, all to the second digit of the interval's width: `1.49275 [1.49245, 1.49306]`.
pub fn interval_text(value: f64, [low, high]: [f64; 2]) -> String {
    let power = |value: f64| if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    let last = power(high - low) - 1;
    let number = |value: f64| number_text(value, (power(value) - last + 1).clamp(1, 10) as usize);
    format!("{} [{}, {}]", number(value), number(low), number(high))
}

/// A probability with its relation: `= 0.020`, or what it is below where it is too small for a number.
pub fn probability_text(value: f64, digits: usize) -> String {
    if value == 0.0 { "< 10⁻³⁰⁰".into() } else { format!("= {}", number_text(value, digits)) }
}

/// A count with thousands separated: 10,642,020.
pub fn grouped(value: f64) -> String {
    separated(&format!("{:.0}", value.max(0.0)))
}

fn separated(digits: &str) -> String {
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A text with a true minus before its numbers: `68% in [-0.02, 0.1]` becomes `68% in [−0.02, 0.1]`.
pub fn true_minus(text: &str) -> String {
    let mut before = ' ';
    let mut rest = text.chars().peekable();
    let mut written = String::with_capacity(text.len());
    while let Some(c) = rest.next() {
        let is_minus = c == '-' && " [(".contains(before) && rest.peek().is_some_and(char::is_ascii_digit);
        written.push(if is_minus { '−' } else { c });
        before = c;
    }
    written
}

fn sign(value: f64) -> &'static str {
    if value < 0.0 { "−" } else { "" }
}

fn raised(power: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let digit = |c: char| c.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize]);
    power.to_string().chars().map(digit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_size_has_one_form() {
        let shown = [0.00273, 2.11e-4, 0.0, f64::NAN, f64::INFINITY, 1e94, 999_999.96, -0.5]
            .map(|value| number_text(value, 3));
        let wanted = ["0.00273", "2.11×10⁻⁴", "0", "undefined", "∞", "1.00×10⁹⁴", "1.00×10⁶", "−0.500"];
        assert_eq!(shown, wanted);
        assert_eq!([number_text(-15_125.3, 3), number_text(4_772.75, 5)], ["−15,125", "4,772.8"]);
        assert_eq!(signed_text(0.00273, 2), "+0.0027");
        assert_eq!(signed_text(0.0, 2), "0");
        assert_eq!([decimals_text(-0.00001, 3), decimals_text(-1.25, 1)], ["0.000", "−1.2"]);
    }

    #[test]
    fn thousands_are_grouped() {
        assert_eq!(grouped(10_642_020.4), "10,642,020");
        assert_eq!(grouped(999.0), "999");
    }
}
