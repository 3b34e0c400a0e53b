//! The tables in `docs/paper.md`.

use super::{acceleration, claims, orders, sea_trial, segments, table_1};

/// The tables with their names.
pub(crate) fn all() -> Vec<(String, String)> {
    let tables = [
        ("claims", claims::table()),
        ("table 1", table_1::table()),
        ("accelerations", acceleration::table()),
        ("orders", orders::table()),
        ("conditions", orders::condition_table()),
        ("segments", segments::table()),
        ("joins", segments::join_table()),
        ("characteristic points", sea_trial::table()),
        ("forty ahead", sea_trial::forty_ahead_table()),
    ];
    tables.map(|(name, table)| (name.to_owned(), table)).into()
}
