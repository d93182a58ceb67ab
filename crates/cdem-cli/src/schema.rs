//! `cdem schema`: the JSON Schema of scenes.

use crate::failure::{Failure, Outcome};
use crate::terminal::print;

pub(crate) fn schema() -> Result<Outcome, Failure> {
    print(format_args!("{:#}", cdem::scene::json_schema()));
    Ok(Outcome::Done)
}
