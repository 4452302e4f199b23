//! Whether two scans meet: the search, its certificates, and what is remembered of it.

pub(crate) mod ball_leaves;
pub(crate) mod balls;
pub(crate) mod certificate;
pub(crate) mod collide;
pub(crate) mod compare;
pub(crate) mod hint;
pub(crate) mod manifold;
pub(crate) mod margin;
pub(crate) mod search;
