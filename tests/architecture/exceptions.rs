//! What does not keep the rules yet. The lists only get shorter.

/// Files that may still be in a circle.
pub const CIRCLES: &[&str] = &[
    "src/diagnose_page/force.rs",
    "src/diagnose_page/held_out.rs",
    "src/diagnose_page/mod.rs",
    "src/diagnose_page/tables.rs",
    "studies/src/ball_screw/drift.rs",
    "studies/src/ball_screw/identify.rs",
    "studies/src/ball_screw/mod.rs",
    "studies/src/ball_screw/nested.rs",
    "studies/src/ball_screw/tracking.rs",
    "studies/src/brfd_friction_damper.rs",
    "studies/src/csv_columns.rs",
    "studies/src/data.rs",
    "studies/src/emps/mod.rs",
    "studies/src/emps/null.rs",
    "studies/src/emps/pipeline.rs",
    "studies/src/emps/prepare.rs",
    "studies/src/engine_bench/compare.rs",
    "studies/src/engine_bench/mod.rs",
    "studies/src/engine_bench/page.rs",
    "studies/src/engine_bench/user_force.rs",
    "studies/src/engine_bench/world.rs",
    "studies/src/kuka_kr300.rs",
    "studies/src/lib.rs",
    "studies/src/odrive_cogging.rs",
    "studies/src/papers/ball_screw.rs",
    "studies/src/papers/engine_bench.rs",
    "studies/src/papers/impulse_engine.rs",
    "studies/src/papers/mod.rs",
    "studies/src/papers/steering_compensator.rs",
    "studies/src/piezo_p885.rs",
    "studies/src/run.rs",
    "studies/src/silverbox.rs",
    "studies/src/steering/bench.rs",
    "studies/src/steering/identify.rs",
    "studies/src/steering/mod.rs",
    "studies/src/steering/page.rs",
];

/// Files that may still be too long.
pub const LONG: &[&str] = &[];
