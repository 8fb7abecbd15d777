//! A table as Parquet: a file that pandas, `DuckDB`, Spark and the like read with its types.

use std::{io, path::Path, sync::Arc};

use parquet::{
    basic::{Compression, LogicalType, Repetition, Type as Physical, ZstdLevel},
    data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type},
    errors::Result,
    file::{
        properties::WriterProperties,
        writer::{SerializedColumnWriter, SerializedFileWriter},
    },
    schema::types::{Type, TypePtr},
};
use serde_json::Value;
use toile_capture::files::atomic_write;

use super::query::Table;
use crate::ArchiveError;

/// What a column holds: what all its values fit into. One without any value is text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Whole,
    Number,
    Text,
}

impl Table {
    /// Writes the table as a Parquet file, whole: every column may be null; whole numbers are INT64, others DOUBLE, text is UTF-8.
    ///
    /// # Errors
    /// [`ArchiveError`] where the file cannot be written.
    pub fn write_parquet(&self, path: &Path) -> std::result::Result<(), ArchiveError> {
        let bytes = self.parquet().map_err(|error| ArchiveError::io(path, io::Error::other(error)))?;
        Ok(atomic_write(path, &bytes)?)
    }

    fn parquet(&self) -> Result<Vec<u8>> {
        let kinds: Vec<Kind> = (0..self.columns.len()).map(|at| self.kind(at)).collect();
        let fields = self.columns.iter().zip(&kinds).map(|(name, kind)| field(name, *kind));
        let schema = Type::group_type_builder("table").with_fields(fields.collect::<Result<_>>()?).build()?;
        let properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_created_by(concat!("toile ", env!("CARGO_PKG_VERSION")).into())
            .build();
        let mut bytes = Vec::new();
        let mut file = SerializedFileWriter::new(&mut bytes, Arc::new(schema), Arc::new(properties))?;
        let mut group = file.next_row_group()?;
        let mut columns = kinds.iter().enumerate();
        while let Some(mut writer) = group.next_column()? {
            if let Some((at, kind)) = columns.next() {
                self.write_column(at, *kind, &mut writer)?;
            }
            writer.close()?;
        }
        group.close()?;
        file.close()?;
        Ok(bytes)
    }

    fn write_column(&self, at: usize, kind: Kind, writer: &mut SerializedColumnWriter) -> Result<()> {
        // 1 where there is a value, 0 for null.
        let there: Vec<i16> = self.rows.iter().map(|row| i16::from(!row[at].is_null())).collect();
        let values = || self.rows.iter().map(|row| &row[at]).filter(|value| !value.is_null());
        let written = match kind {
            Kind::Whole => {
                let all: Vec<i64> = values().filter_map(Value::as_i64).collect();
                writer.typed::<Int64Type>().write_batch(&all, Some(&there), None)
            }
            Kind::Number => {
                let all: Vec<f64> = values().filter_map(Value::as_f64).collect();
                writer.typed::<DoubleType>().write_batch(&all, Some(&there), None)
            }
            Kind::Text => {
                let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), String::from);
                let all: Vec<ByteArray> = values().map(|value| text(value).into_bytes().into()).collect();
                writer.typed::<ByteArrayType>().write_batch(&all, Some(&there), None)
            }
        };
        written.map(drop)
    }

    fn kind(&self, at: usize) -> Kind {
        let values = || self.rows.iter().map(|row| &row[at]).filter(|value| !value.is_null());
        if values().next().is_none() || !values().all(Value::is_number) {
            Kind::Text
        } else if values().all(Value::is_i64) {
            Kind::Whole
        } else {
            Kind::Number
        }
    }
}

fn field(name: &str, kind: Kind) -> Result<TypePtr> {
    let (physical, logical) = match kind {
        Kind::Whole => (Physical::INT64, None),
        Kind::Number => (Physical::DOUBLE, None),
        Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let built = Type::primitive_type_builder(name, physical).with_repetition(Repetition::OPTIONAL);
    built.with_logical_type(logical).build().map(Arc::new)
}

#[cfg(test)]
mod tests {
    use parquet::{
        file::reader::{FileReader, SerializedFileReader},
        record::Field,
    };

    use super::*;

    #[test]
    fn another_reader_gets_values_types_and_nulls_back() {
        let columns = ["name", "n", "cm", "nothing", "mixed"].map(String::from).into();
        let rows = vec![
            vec!["ä, \"b\"".into(), 3.into(), 1.5.into(), Value::Null, 1.into()],
            vec![Value::Null, Value::Null, 2.into(), Value::Null, "x".into()],
        ];
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("table.parquet");
        Table { columns, rows }.write_parquet(&path).unwrap();
        let reader = SerializedFileReader::new(std::fs::File::open(&path).unwrap()).unwrap();
        let rows: Vec<Vec<Field>> = reader
            .get_row_iter(None)
            .unwrap()
            .map(|row| row.unwrap().get_column_iter().map(|(_, field)| field.clone()).collect())
            .collect();
        let text = |text: &str| Field::Str(text.into());
        assert_eq!(rows[0], [text("ä, \"b\""), Field::Long(3), Field::Double(1.5), Field::Null, text("1")]);
        assert_eq!(rows[1], [Field::Null, Field::Null, Field::Double(2.0), Field::Null, text("x")]);
    }

    #[test]
    fn a_table_without_rows_keeps_its_columns() {
        let table = Table { columns: vec!["subject".into()], rows: Vec::new() };
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("empty.parquet");
        table.write_parquet(&path).unwrap();
        let reader = SerializedFileReader::new(std::fs::File::open(&path).unwrap()).unwrap();
        assert_eq!((reader.metadata().file_metadata().num_rows(), reader.metadata().num_row_groups()), (0, 1));
        assert_eq!(reader.metadata().file_metadata().schema_descr().column(0).name(), "subject");
    }
}
