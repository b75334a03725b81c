//! Tables that are damaged, or made to cost more than they seem to: an error with its cause and place, at once.

#[path = "../../tests/common/naming.rs"]
mod naming;

use backdrive_bags::{BagError, ImportOptions, import_table};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use naming::assert_names;
use parquet::basic::{Compression as ParquetCompression, ZstdLevel};
use parquet::data_type::DoubleType;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn import(table: &Path, most_bytes: u64) -> Result<u64, BagError> {
    let bag = table.with_extension("mcap");
    let result = import_table(table, &bag, &ImportOptions { most_bytes, ..ImportOptions::default() });
    assert_eq!(result.is_ok(), bag.exists(), "a bag is left where the import fails, or none where it does not");
    result.map(|report| report.rows)
}

fn written(folder: &tempfile::TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("it writes");
    path
}

#[test]
fn a_panic_in_the_decoder_of_a_damaged_parquet_file_is_an_error_with_its_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let table = written(&folder, "dictionary.parquet", include_bytes!("damaged/dictionary.parquet"));
    let error = import(&table, backdrive_bags::MOST_BYTES).expect_err("it is damaged").to_string();
    assert_names(&error, &["dictionary.parquet"]);
}

/// A MAT file whose only variable is a column `t` of zeros, compressed.
fn zeros(count: usize) -> Vec<u8> {
    let word = |number: usize| u32::try_from(number).expect("it fits").to_le_bytes();
    let bytes = 8 * count;
    let mut inner = Vec::new();
    for number in [6, 8, 6, 0, 5, 8, count, 1] {
        inner.extend(word(number));
    }
    inner.extend([1, 0, 1, 0]); // a small element: one byte of text
    inner.extend(b"t\0\0\0");
    inner.extend([word(9), word(bytes)].concat());
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::best());
    packed.write_all(&[word(14), word(inner.len() + bytes)].concat()).expect("it packs");
    packed.write_all(&inner).expect("it packs");
    let block = vec![0; 1 << 20];
    for at in (0..bytes).step_by(block.len()) {
        packed.write_all(&block[..block.len().min(bytes - at)]).expect("it packs");
    }
    let packed = packed.finish().expect("it packs");
    let mut file = b"MATLAB 5.0 MAT-file".to_vec();
    file.resize(124, b' ');
    file.extend([0, 1, b'I', b'M']);
    file.extend([word(15), word(packed.len())].concat());
    file.extend(packed);
    file
}

#[test]
fn a_small_file_that_unpacks_to_more_than_is_allowed_is_refused_with_both_sizes() {
    let folder = tempfile::tempdir().expect("a folder");
    let mat = written(&folder, "zeros.mat", &zeros(8 << 20));
    assert!(std::fs::metadata(&mat).expect("it is there").len() < 1 << 18);
    let rows = 4 << 20;
    let schema = Arc::new(parse_message_type("message table { required double t; required double x; }").expect("a schema"));
    let compression = ParquetCompression::ZSTD(ZstdLevel::default());
    let properties = Arc::new(WriterProperties::builder().set_compression(compression).build());
    let parquet = folder.path().join("equal.parquet");
    let file = std::fs::File::create(&parquet).expect("it writes");
    let mut writer = SerializedFileWriter::new(file, schema, properties).expect("it writes");
    let mut group = writer.next_row_group().expect("it writes");
    while let Some(mut column) = group.next_column().expect("it writes") {
        column.typed::<DoubleType>().write_batch(&vec![1.5; rows], None, None).expect("it writes");
        column.close().expect("it writes");
    }
    group.close().expect("it writes");
    writer.close().expect("it writes");
    let csv = written(&folder, "rows.csv", ["t,x\n".to_owned(), (0..200_000).map(|i| format!("{i},1\n")).collect()].concat().as_bytes());
    for (table, allowed_mib) in [(&mat, 16), (&parquet, 16), (&csv, 1)] {
        let error = import(table, allowed_mib << 20).expect_err("it is too large").to_string();
        let name = table.file_name().and_then(|name| name.to_str()).expect("a name");
        assert_names(&error, &[name, &format!("{allowed_mib} MiB"), "--memory"]);
    }
    // What is allowed is read: these are refused or taken for what they hold.
    assert!(import(&parquet, 1 << 30).expect_err("its times do not rise").to_string().contains("time"));
    assert_eq!(import(&csv, 1 << 30).expect("it is imported"), 200_000);
}

#[test]
fn more_columns_than_a_bag_can_hold_are_refused_and_many_are_taken() {
    let folder = tempfile::tempdir().expect("a folder");
    let table = |columns: usize| {
        let heading: String = (0..columns).map(|column| format!(",c{column}")).collect();
        let row = |t: &str| format!("{t}{}\n", ",1.5".repeat(columns));
        format!("t{heading}\n{}{}", row("0"), row("0.001"))
    };
    let many = written(&folder, "many.csv", table(20_000).as_bytes());
    assert_eq!(import(&many, 1 << 30).expect("it is imported"), 2);
    let too_many = written(&folder, "too-many.csv", table(70_000).as_bytes());
    let error = import(&too_many, 1 << 30).expect_err("MCAP has 16 bits for a channel").to_string();
    assert_names(&error, &["70000", "--map"]);
}
