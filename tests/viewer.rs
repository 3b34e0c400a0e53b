//! What viewers show of a fused log: the rules themselves, the sample logs' layout, and an independent check.

#![allow(clippy::unwrap_used)]

mod viewer_rules;

mod viewer {
    mod bad_logs;
    mod fused;
    mod independent;
    mod layout;
}
