//! What training normalises by, of a dataset and of each of its episodes.

use crate::number_type::NumberType;
use crate::parquet_writer::{Values, Written};
use backdrive_signal::statistics::quantile;
use serde_json::{Map, Value, json};

/// Quantiles that a dataset contains, by their names.
const QUANTILES: [(&str, f64); 5] = [("q01", 0.01), ("q10", 0.1), ("q50", 0.5), ("q90", 0.9), ("q99", 0.99)];

/// A feature of all episodes.
pub(super) struct Feature<'a> {
    pub(super) name: &'a str,
    /// The rows of all episodes, one after the other.
    pub(super) values: &'a [f64],
    /// Numbers of a row.
    pub(super) width: usize,
}

impl Feature<'_> {
    /// Each figure of some of its rows: a number for each number of a row, and how many rows there are.
    fn figures(&self, values: &[f64]) -> Vec<(&'static str, Vec<f64>)> {
        let count = (values.len() / self.width) as f64;
        let axes: Vec<Vec<f64>> = (0..self.width)
            .map(|axis| {
                let mut sorted: Vec<f64> = values.iter().skip(axis).step_by(self.width).copied().collect();
                sorted.sort_by(f64::total_cmp);
                sorted
            })
            .collect();
        let of_each = |figure: &dyn Fn(&[f64]) -> f64| axes.iter().map(|sorted| figure(sorted)).collect::<Vec<f64>>();
        let mean = |sorted: &[f64]| sorted.iter().sum::<f64>() / count;
        let deviation = |sorted: &[f64]| {
            let middle = mean(sorted);
            (sorted.iter().map(|value| (value - middle).powi(2)).sum::<f64>() / count).sqrt()
        };
        let mut figures = vec![
            ("min", of_each(&|sorted| sorted.first().copied().unwrap_or(f64::NAN))),
            ("max", of_each(&|sorted| sorted.last().copied().unwrap_or(f64::NAN))),
            ("mean", of_each(&mean)),
            ("std", of_each(&deviation)),
            ("count", vec![count]),
        ];
        figures.extend(QUANTILES.map(|(name, share)| (name, of_each(&|sorted| quantile(sorted, share)))));
        figures
    }

    /// Of all episodes, for `meta/stats.json`.
    pub(super) fn of_dataset(&self) -> Value {
        let figures = self.figures(self.values).into_iter().map(|(name, values)| match name {
            "count" => (name.to_owned(), json!(values.iter().map(|count| *count as u64).collect::<Vec<_>>())),
            _ => (name.to_owned(), json!(values)),
        });
        Value::Object(figures.collect::<Map<_, _>>())
    }

    /// Of each episode, with its number of rows: columns `stats/FEATURE/FIGURE` by name, their type, the length of a row's list, and the rows one after the
    /// other.
    pub(super) fn of_episodes(&self, rows: &[usize]) -> Vec<(String, NumberType, usize, Vec<f64>)> {
        let mut columns: Vec<(String, NumberType, usize, Vec<f64>)> = Vec::new();
        let mut from = 0;
        for rows in rows {
            let to = from + rows * self.width;
            for (place, (figure, values)) in self.figures(&self.values[from..to]).into_iter().enumerate() {
                match columns.get_mut(place) {
                    Some(column) => column.3.extend(values),
                    None => {
                        let of = if figure == "count" { NumberType::Int64 } else { NumberType::Double };
                        columns.push((format!("stats/{}/{figure}", self.name), of, values.len(), values));
                    }
                }
            }
            from = to;
        }
        columns
    }
}

/// The columns as they are written.
pub(super) fn written(columns: &[(String, NumberType, usize, Vec<f64>)]) -> impl Iterator<Item = Written<'_>> {
    columns.iter().map(|(name, of, width, values)| Written { name: name.clone(), values: Values::Lists(values, *width, *of) })
}
