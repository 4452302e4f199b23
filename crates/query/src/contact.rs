//! Contact queries: the search, its certificates, and the hints kept between queries.

pub(crate) mod ball_leaves;
pub(crate) mod balls;
pub(crate) mod certificate;
pub(crate) mod collide;
pub(crate) mod compare;
pub(crate) mod hint;
pub(crate) mod manifold;
pub(crate) mod margin;
pub(crate) mod search;
