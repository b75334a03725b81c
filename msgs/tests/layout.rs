//! What two processes must agree on: where every field of a shared-memory message stands.

use backdrive_msgs::{Event, Gains, LAYOUT, MAX_AXES, Margin, Sample, Status, WrongLayout, check_layout, source_id, text::Text};
use std::mem::{align_of, offset_of, size_of};

macro_rules! layout {
    ($type:ty, size $size:expr, $($field:ident at $offset:expr),+ $(,)?) => {
        assert_eq!(size_of::<$type>(), $size, concat!("size of ", stringify!($type)));
        assert_eq!(align_of::<$type>(), 8, concat!("alignment of ", stringify!($type)));
        $(assert_eq!(offset_of!($type, $field), $offset, concat!(stringify!($type), ".", stringify!($field)));)+
    };
}

/// A change that fails this test changes what travels: raise `LAYOUT` and the type names with it.
#[test]
fn fields_stand_where_other_processes_expect_them() {
    assert_eq!((LAYOUT, MAX_AXES), (1, 8));
    layout!(Sample, size 232, layout at 0, source at 4, step at 8, sequence at 16, stamp_ns at 24, axes at 32, flags at 36,
        position at 40, velocity at 104, effort at 168);
    layout!(Gains, size 56, layout at 0, source at 4, step at 8, sequence at 16, stamp_ns at 24, mu at 32, lambda at 40, ramp_s at 48);
    layout!(Event, size 208, layout at 0, source at 4, step at 8, sequence at 16, stamp_ns at 24, severity at 32, reserved at 36,
        value at 40, kind at 48, text at 80);
    layout!(Status, size 72, layout at 0, source at 4, step at 8, sequence at 16, stamp_ns at 24, steps at 32, missed_deadlines at 40,
        lost at 48, loop_p50_s at 56, loop_p99_s at 64);
    layout!(Margin, size 80, layout at 0, source at 4, step at 8, sequence at 16, stamp_ns at 24, axis at 32, known at 36, gain at 40,
        factor at 48, deviation at 56, frequency_hz at 64, decay_per_s at 72);
    assert_eq!((size_of::<Text<32>>(), align_of::<Text<32>>()), (32, 1));
}

#[test]
fn another_layout_version_is_refused() {
    assert_eq!(check_layout(LAYOUT), Ok(()));
    for found in [0, LAYOUT + 1, u32::MAX] {
        assert_eq!(check_layout(found), Err(WrongLayout { found }));
    }
}

#[test]
fn a_source_is_the_fnv_hash_of_its_name() {
    // The published test vectors of 32-bit FNV-1a.
    assert_eq!(source_id(""), 0x811c_9dc5);
    assert_eq!(source_id("a"), 0xe40c_292c);
    assert_eq!(source_id("foobar"), 0xbf9c_f968);
}
