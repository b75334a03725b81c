//! A table of named arrays, as MATLAB and NumPy files hold them.

use super::mapping::ImportOptions;
use super::mat_array::{Array, Held};
use super::types::{Cells, Column, Table, name_of};
use crate::number_type::NumberType;

/// Takes the vectors and matrices of numbers that have as many rows as the times; a matrix becomes columns `NAME[0]`, `NAME[1]` and so on. The times are a
/// vector, or a column of a matrix by that name.
///
/// # Errors
/// A sentence: nothing holds the times, and what to do.
pub(super) fn table(arrays: Vec<Array>, options: &ImportOptions) -> Result<Table, String> {
    let Some(rows) = rows(&arrays, options) else { return Err(no_times(&arrays, options)) };
    let (mut columns, mut others) = (Vec::new(), Vec::new());
    for array in arrays {
        match length(&array) {
            Some(count) if count == rows => columns.push(Column { cells: cells(array.held), name: array.name }),
            None if is_matrix(&array, rows) => columns.extend(matrix(&array, rows)),
            _ => others.push(match array.held {
                Held::Fields(_) => format!("{} (a structure)", array.name),
                Held::Text(_) => format!("{} (text)", array.name),
                Held::Other(what) => format!("{} ({what})", array.name),
                Held::Numbers(..) | Held::Whole(..) => array.name,
            }),
        }
    }
    let notes = match (others.is_empty(), options.rate_hz) {
        (true, _) => Vec::new(),
        (false, None) if options.headings.is_none() => {
            vec![format!("omitted, because they are not numeric columns as long as {}: {}", options.time, others.join(", "))]
        }
        (false, _) => vec![format!("omitted, because they are not numeric columns of {rows} rows: {}", others.join(", "))],
    };
    Ok(Table { columns, notes, lines: None })
}

/// Rows of the table: the length of the times; where a rate or headings stand for their name, the most rows that anything has.
fn rows(arrays: &[Array], options: &ImportOptions) -> Option<usize> {
    let longest = |array: &Array| if is_numbers(array) { array.size.iter().copied().max().filter(|rows| *rows > 1) } else { None };
    if options.rate_hz.is_some() || options.headings.is_some() {
        return arrays.iter().filter_map(longest).max();
    }
    let asked = name_of(&options.time);
    let named = |name: &str| arrays.iter().find(|array| array.name == name);
    let of_vector = [options.time.as_str(), asked].into_iter().find_map(named).and_then(length);
    // `X[0]`: a column of the matrix X.
    let of_matrix = || {
        let (name, place) = asked.strip_suffix(']')?.rsplit_once('[')?;
        place.parse::<usize>().ok()?;
        named(name).filter(|array| is_numbers(array)).and_then(longest)
    };
    of_vector.or_else(of_matrix)
}

fn no_times(arrays: &[Array], options: &ImportOptions) -> String {
    let names = |is: &dyn Fn(&Array) -> bool| arrays.iter().filter(|array| is(array)).map(|array| array.name.as_str()).collect::<Vec<_>>();
    let vectors = names(&|array| length(array).is_some());
    let matrices: Vec<&Array> =
        arrays.iter().filter(|array| array.size.iter().copied().max().is_some_and(|rows| is_matrix(array, rows))).collect();
    let structures = names(&|array| matches!(array.held, Held::Fields(_)));
    let by_rate = "or give the sampling rate with --rate HZ";
    let what = match (vectors.as_slice(), matrices.as_slice(), structures.as_slice()) {
        ([], [], []) => "there are no vectors".to_owned(),
        ([], [matrix, ..], _) => {
            let (name, count) = (&matrix.name, matrix.size.iter().copied().min().unwrap_or(0));
            let last = count.saturating_sub(1);
            format!(
                "{name} is a matrix of {count} columns, {name}[0] to {name}[{last}]: name the one with the times, as --time \"{name}[0]\", {by_rate}"
            )
        }
        ([], [], _) => format!("name the structure whose fields the columns are with --variable: {}", structures.join(", ")),
        _ => format!("vectors are {}: name one with --time, {by_rate}", vectors.join(", ")),
    };
    format!("{}: is not a vector of times; {what}", options.time)
}

fn is_numbers(array: &Array) -> bool {
    matches!(array.held, Held::Numbers(..) | Held::Whole(..)) && array.size.len() == 2 && !array.size.contains(&0)
}

/// Values of a vector of numbers, lying or standing.
fn length(array: &Array) -> Option<usize> {
    let [a, b] = array.size[..] else { return None };
    (is_numbers(array) && (a == 1) != (b == 1)).then_some(a * b)
}

fn is_matrix(array: &Array, rows: usize) -> bool {
    matches!(array.held, Held::Numbers(..)) && is_numbers(array) && !array.size.contains(&1) && array.size.contains(&rows)
}

fn matrix(array: &Array, rows: usize) -> Vec<Column> {
    let (Held::Numbers(values, of), [high, wide]) = (&array.held, &array.size[..]) else { return Vec::new() };
    let column = |number: usize| match *high == rows {
        true => values[number * rows..(number + 1) * rows].to_vec(),
        false => values.iter().skip(number).step_by(*high).copied().collect(),
    };
    let count = if *high == rows { *wide } else { *high };
    (0..count).map(|number| Column::new(format!("{}[{number}]", array.name), column(number), *of)).collect()
}

fn cells(held: Held) -> Cells {
    match held {
        Held::Numbers(values, of) => Cells::Numbers(values, of),
        Held::Whole(_, NumberType::Uint64) => Cells::Other("whole numbers beyond 2^53".to_owned()),
        Held::Whole(values, _) => Cells::Large { values, per_second: None },
        Held::Text(_) | Held::Fields(_) | Held::Other(_) => Cells::Other("something that is not a number".to_owned()),
    }
}
