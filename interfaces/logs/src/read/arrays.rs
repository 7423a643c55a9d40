//! Columns of Arrow of any type as floats, whole numbers or texts. The package `arrow-cast` does this, too, and brings
//! eight more.

use arrow_array::cast::AsArray;
use arrow_array::types::{
    ArrowPrimitiveType, Decimal32Type, Decimal64Type, Decimal128Type, Decimal256Type, Float16Type,
    Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type, UInt16Type,
    UInt32Type, UInt64Type,
};
use arrow_array::{Array, Float64Array, Int64Array};
use arrow_schema::DataType;

/// The numbers of a column, truth values as 0 and 1; none of a column of something else.
pub(super) fn floats(column: &dyn Array) -> Option<Float64Array> {
    let scaled = |scale: &i8| 10f64.powi((*scale).into());
    Some(match column.data_type() {
        DataType::Float64 => column.as_primitive::<Float64Type>().clone(),
        DataType::Float32 => float::<Float32Type>(column, f64::from),
        DataType::Float16 => float::<Float16Type>(column, f64::from),
        DataType::Int8 => float::<Int8Type>(column, f64::from),
        DataType::Int16 => float::<Int16Type>(column, f64::from),
        DataType::Int32 => float::<Int32Type>(column, f64::from),
        DataType::Int64 => float::<Int64Type>(column, |x| x as f64),
        DataType::UInt8 => float::<UInt8Type>(column, f64::from),
        DataType::UInt16 => float::<UInt16Type>(column, f64::from),
        DataType::UInt32 => float::<UInt32Type>(column, f64::from),
        DataType::UInt64 => float::<UInt64Type>(column, |x| x as f64),
        DataType::Decimal32(_, s) => float::<Decimal32Type>(column, |x| f64::from(x) / scaled(s)),
        DataType::Decimal64(_, s) => float::<Decimal64Type>(column, |x| x as f64 / scaled(s)),
        DataType::Decimal128(_, s) => float::<Decimal128Type>(column, |x| x as f64 / scaled(s)),
        DataType::Decimal256(_, s) => float::<Decimal256Type>(column, |x| {
            x.to_string().parse().unwrap_or(f64::NAN) / scaled(s)
        }),
        DataType::Boolean => {
            let values = column.as_boolean().iter();
            values.map(|x| x.map(|x| f64::from(u8::from(x)))).collect()
        }
        DataType::Dictionary(..) => {
            let dictionary = column.as_any_dictionary();
            let values = floats(dictionary.values().as_ref())?;
            let keys = integers(dictionary.keys())?;
            let value = |key: i64| Some(key as usize).filter(|k| values.is_valid(*k));
            let value = |key: Option<i64>| value(key?).map(|k| values.value(k));
            keys.iter().map(value).collect()
        }
        _ => return None,
    })
}

/// The whole numbers of a column, and the ticks of a column of times; none of a column of something else. A number that
/// an `i64` cannot hold is missing.
pub(super) fn integers(column: &dyn Array) -> Option<Int64Array> {
    Some(match column.data_type() {
        DataType::Int64 => column.as_primitive::<Int64Type>().clone(),
        DataType::Int32 => integer::<Int32Type>(column),
        DataType::Int16 => integer::<Int16Type>(column),
        DataType::Int8 => integer::<Int8Type>(column),
        DataType::UInt64 => integer::<UInt64Type>(column),
        DataType::UInt32 => integer::<UInt32Type>(column),
        DataType::UInt16 => integer::<UInt16Type>(column),
        DataType::UInt8 => integer::<UInt8Type>(column),
        DataType::Timestamp(..) | DataType::Duration(_) => {
            let ticks = column.to_data().into_builder().data_type(DataType::Int64);
            Int64Array::from(ticks.build().ok()?)
        }
        _ => return None,
    })
}

/// The texts of a column; none of a column of something else.
pub(super) fn words(column: &dyn Array) -> Option<Vec<Option<&str>>> {
    Some(match column.data_type() {
        DataType::Utf8 => column.as_string::<i32>().iter().collect(),
        DataType::LargeUtf8 => column.as_string::<i64>().iter().collect(),
        DataType::Utf8View => column.as_string_view().iter().collect(),
        _ => return None,
    })
}

fn float<T: ArrowPrimitiveType>(
    column: &dyn Array,
    each: impl Fn(T::Native) -> f64,
) -> Float64Array {
    column.as_primitive::<T>().unary(each)
}

fn integer<T: ArrowPrimitiveType>(column: &dyn Array) -> Int64Array
where
    T::Native: TryInto<i64>,
{
    column.as_primitive::<T>().unary_opt(|x| x.try_into().ok())
}

#[cfg(test)]
mod tests {
    use super::*;
    use arrow_array::{
        BooleanArray, Decimal128Array, Decimal256Array, DurationMillisecondArray, Float32Array,
        Int32Array, LargeStringArray, StringArray, StringViewArray, TimestampNanosecondArray,
        UInt64Array,
    };
    use arrow_buffer::i256;

    fn as_floats(column: &dyn Array) -> Vec<Option<f64>> {
        floats(column).unwrap().iter().collect()
    }

    fn as_integers(column: &dyn Array) -> Vec<Option<i64>> {
        integers(column).unwrap().iter().collect()
    }

    #[test]
    fn numbers_of_every_kind() {
        let ints = Int32Array::from(vec![Some(-7), None]);
        assert_eq!(as_floats(&ints), [Some(-7.0), None]);
        assert_eq!(as_integers(&ints), [Some(-7), None]);
        let large = UInt64Array::from(vec![3, u64::MAX]);
        assert_eq!(as_floats(&large), [Some(3.0), Some(u64::MAX as f64)]);
        assert_eq!(as_integers(&large), [Some(3), None]);
        let single = Float32Array::from(vec![0.1]);
        assert_eq!(as_floats(&single), [Some(f64::from(0.1f32))]);
        assert!(integers(&single).is_none());
        let switch = BooleanArray::from(vec![Some(true), Some(false), None]);
        assert_eq!(as_floats(&switch), [Some(1.0), Some(0.0), None]);
        let prices = Decimal128Array::from(vec![-1250]);
        let prices = prices.with_precision_and_scale(6, 3).unwrap();
        assert_eq!(as_floats(&prices), [Some(-1.25)]);
        let long = Decimal256Array::from(vec![i256::from_i128(-1250)]);
        let long = long.with_precision_and_scale(60, 3).unwrap();
        assert_eq!(as_floats(&long), [Some(-1.25)]);
    }

    #[test]
    fn times_and_texts() {
        let stamps = TimestampNanosecondArray::from(vec![None, Some(5), Some(6)]);
        assert_eq!(as_integers(&stamps), [None, Some(5), Some(6)]);
        assert_eq!(as_integers(&stamps.slice(1, 1)), [Some(5)]);
        let spans = DurationMillisecondArray::from(vec![-4]);
        assert_eq!(as_integers(&spans), [Some(-4)]);
        assert!(floats(&stamps).is_none());
        let written = [Some("a"), None];
        assert_eq!(
            words(&StringArray::from(written.to_vec())).unwrap(),
            written
        );
        assert_eq!(
            words(&LargeStringArray::from(written.to_vec())).unwrap(),
            written
        );
        assert_eq!(
            words(&StringViewArray::from(written.to_vec())).unwrap(),
            written
        );
        assert!(words(&spans).is_none());
    }
}
