//! Prints the part of `docs/tuning.md` that the code knows: `cargo run -p backdrive-diagnosis --example tuning`.

fn main() {
    print!("{}", backdrive_diagnosis::document::tuning_page());
}
