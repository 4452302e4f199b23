//! Options that describe an avatar, and places on the command line.

use std::path::Path;

use clap::Args;
use nearmiss::slices::{Avatar, AvatarOptions, Grid, SliceFolder, SliceMap};

use super::report::open;
use crate::console::{self, Console};
use crate::error::CliError;
use crate::input::pieces;
use crate::parse::parse_length;
use crate::{output, picture};

/// Options of the avatar.
#[derive(Debug, Clone, Args)]
pub struct AvatarArgs {
    /// Width, depth and height of the avatar
    #[arg(long, value_name = "W,D,H", default_value = "0.4,0.4,1.6", value_parser = parse_avatar)]
    pub avatar: AvatarBox,
    /// Climb: the greatest height that the avatar steps up at once, and the height that it falls in
    /// one step
    #[arg(long, value_name = "C", default_value = "0.35", allow_hyphen_values = true, value_parser = parse_length)]
    pub climb: f64,
    /// Length of a step; by default a pixel's side
    ///
    /// It is also the distance between the places that the search tests. A step is never longer than
    /// the lesser side of the avatar's base, so that the avatar cannot pass over an obstacle.
    #[arg(long, value_name = "L", allow_hyphen_values = true, value_parser = parse_length)]
    pub step: Option<f64>,
}

impl AvatarArgs {
    /// Returns the avatar for a map.
    pub(super) fn avatar(&self, grid: &Grid) -> Result<Avatar, CliError> {
        let AvatarBox([width, depth, height]) = self.avatar;
        let options = AvatarOptions::default()
            .with_box([width, depth], height)
            .with_climb(self.climb)
            .with_step(self.step.unwrap_or(grid.pixel));
        Avatar::new(&options).map_err(|e| CliError::Usage(e.to_string()))
    }
}

/// Width, depth and height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AvatarBox(
    /// The lengths.
    pub [f64; 3],
);

pub(super) fn parse_avatar(text: &str) -> Result<AvatarBox, String> {
    let lengths: Vec<f64> = pieces(text).map_while(|piece| parse_length(piece).ok()).collect();
    match <[f64; 3]>::try_from(lengths) {
        Ok(lengths) if pieces(text).count() == 3 => Ok(AvatarBox(lengths)),
        _ => Err("expected three lengths, width,depth,height".into()),
    }
}

/// A place in the frame of the input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot(
    /// x, y and z.
    pub [f64; 3],
);

/// Reads a place as people write it or as answers print it: `x,y,z`, in brackets or without.
pub(super) fn parse_spot(text: &str) -> Result<Spot, String> {
    let text = text.trim();
    let bare = [('[', ']'), ('(', ')')].map(|(open, close)| text.strip_prefix(open)?.strip_suffix(close));
    let text = bare.into_iter().flatten().next().unwrap_or(text);
    let numbers: Vec<f64> =
        pieces(text).map_while(|piece| piece.parse().ok().filter(|x: &f64| x.is_finite())).collect();
    match <[f64; 3]>::try_from(numbers) {
        Ok(place) if pieces(text).count() == 3 => Ok(Spot(place)),
        _ => Err("expected three numbers, x,y,z, in the frame of the input".into()),
    }
}

/// Opens a map and loads all of it, with a warning for each missing slice.
pub(super) fn load(folder: &Path, quiet: bool) -> Result<(SliceFolder, SliceMap), CliError> {
    let folder = open(folder)?;
    let _bar = Console::new(quiet).spinner("loading");
    let (map, faults) = folder.load_all();
    faults.iter().for_each(console::warn);
    Ok((folder, map))
}

/// Fails if an output would overwrite the map, or two outputs name one file.
pub(super) fn check_outputs(
    folder: &Path,
    outputs: &[(&str, Option<&Path>)],
    image: Option<&Path>,
) -> Result<(), CliError> {
    let files: Vec<_> =
        std::fs::read_dir(folder).into_iter().flatten().flatten().map(|file| file.path()).collect();
    let inputs: Vec<&Path> = files.iter().map(|path| path.as_path()).collect();
    let given: Vec<(&str, &Path)> =
        outputs.iter().filter_map(|(name, path)| Some((*name, (*path)?))).collect();
    for (i, (name, path)) in given.iter().enumerate() {
        output::check_apart(path, &inputs)?;
        if let Some((other, _)) = given[..i].iter().find(|(_, other)| output::is_same(path, other)) {
            return Err(CliError::Usage(format!(
                "expected two files for {other} and {name}, got the same file"
            )));
        }
    }
    image.map_or(Ok(()), picture::check_name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_three_finite_numbers() {
        assert_eq!(parse_spot("1,-2.5,3e2"), Ok(Spot([1.0, -2.5, 300.0])));
        for text in ["", "1,2", "1,2,3,4", "1,2,x", "1,2,nan", "1,2,inf"] {
            assert!(parse_spot(text).is_err(), "{text}");
        }
    }
}
