//! `cdem report`: writes the page on a run.

use std::path::Path;

use crate::drive::wrong_folder;
use crate::failure::{Failure, Outcome};
use crate::terminal::{print, strong};

pub(crate) fn report(results: &Path) -> Result<Outcome, Failure> {
    let page = cdem_io::report::write(results).map_err(wrong_folder)?;
    print(format_args!(
        "report    {}; open it in a browser",
        strong(&page.display().to_string())
    ));
    Ok(Outcome::Done)
}
