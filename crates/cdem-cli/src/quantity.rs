//! Formats numbers for people: thousands, columns.

pub(crate) use cdem::quantity;

/// Formats a count with a space between groups of thousands: "1 234 567".
pub(crate) fn count(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

/// Formats a count of things: "1 step", "2 000 steps".
pub(crate) fn counted(value: u64, thing: &str) -> String {
    let plural = if value == 1 { "" } else { "s" };
    format!("{} {thing}{plural}", count(value))
}

/// Aligns rows of text in columns: the first left, the others right.
pub(crate) fn columns(rows: &[Vec<String>]) -> Vec<String> {
    let width = |column: usize| {
        let cells = rows.iter().filter_map(|row| row.get(column));
        cells
            .map(|cell| console::measure_text_width(cell))
            .max()
            .unwrap_or(0)
    };
    rows.iter()
        .map(|row| {
            let mut line = String::new();
            for (column, cell) in row.iter().enumerate() {
                let alignment = match column {
                    0 => console::Alignment::Left,
                    _ => console::Alignment::Right,
                };
                line.push_str(if column > 0 { "   " } else { "" });
                line.push_str(&console::pad_str(cell, width(column), alignment, None));
            }
            line.trim_end().to_owned()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_are_set_apart() {
        assert_eq!(count(7), "7");
        assert_eq!(
            (counted(1, "step"), counted(2, "step")),
            ("1 step".into(), "2 steps".into())
        );
        assert_eq!(count(1_234_567), "1 234 567");
    }

    #[test]
    fn columns_line_up() {
        let rows = [["name", "µ"], ["i", "12"]].map(|row| row.map(str::to_owned).to_vec());
        assert_eq!(columns(&rows), ["name    µ", "i      12"]);
    }
}
