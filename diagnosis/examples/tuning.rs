//! Prints the constants of a diagnosis as a page in Markdown: `cargo run -p backdrive-diagnosis --example tuning`.

fn main() {
    print!("{}", backdrive_diagnosis::tuning::document::tuning_page());
}
