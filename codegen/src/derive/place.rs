//! Where in the law file a refusal of the derivation belongs.

use crate::expr::Expr;
use crate::law::Place;
use crate::law::ast::{Acceptance, Law, Scalar};

use super::{DeriveError, Session};

const UNSUPPORTED: &str = "write the term in another form: see laws/README.md";

/// The error with its place: that of the innermost expression of the energy which is refused for the same reason, or the
/// energy's own.
pub(super) fn placed(law: &Law, error: DeriveError) -> DeriveError {
    let (reason, remedy) = match &error {
        DeriveError::Split(split) => match split.parts() {
            Some(parts) => parts,
            None => return error,
        },
        DeriveError::Unsupported(reason) => (reason.clone(), UNSUPPORTED.to_owned()),
        DeriveError::Cas(_) | DeriveError::Invalid(_) | DeriveError::Law(_) | DeriveError::DampingAtRest(_) => {
            return error;
        }
    };
    let place = innermost(law, &reason).unwrap_or_else(|| whole(law));
    DeriveError::Law(Box::new(law.error(place, reason, remedy)))
}

/// The refusal of an acceptance that nothing needed.
pub(super) fn unused(law: &Law, acceptance: &Acceptance) -> DeriveError {
    let (kind, constant) = (acceptance.kind.name(), &acceptance.constant);
    let reason = format!("nothing needs the acceptance of the {kind} of `{constant}`");
    let remedy = "remove it, or write the constant as the refusal without it names it";
    DeriveError::Law(Box::new(law.error(acceptance.place, reason, remedy)))
}

/// The place of the energy, or of its first part.
fn whole(law: &Law) -> Place {
    let first = law.parts.first().map_or(&law.energy, |(_, part)| part);
    let found = law.places.iter().find(|(node, _)| std::rc::Rc::ptr_eq(node, first));
    found.map_or(Place { line: 1, column: 1 }, |(_, place)| *place)
}

/// The place of the first expression, in the order of the places, that is refused for this reason.
fn innermost(law: &Law, reason: &str) -> Option<Place> {
    let nodes: Vec<Scalar> = law.places.iter().map(|(node, _)| node.clone()).collect();
    let (mut session, expressions) = Session::new(law, &nodes).ok()?;
    let mut refused = |e: &Expr| match session.try_part(e) {
        Err(DeriveError::Split(split)) => split.parts().is_some_and(|(found, _)| found == reason),
        _ => false,
    };
    law.places.iter().zip(&expressions).find(|(_, e)| refused(e)).map(|((_, place), _)| *place)
}
