//! Round trips of points through all output formats.

use std::io::Cursor;

use nearmiss_io::{OutError, OutputFormat, PointWriter, Points, ScaleOffset, Survey, read_bytes};

use nearmiss_testdata::files::{foreign, model};

const FORMATS: [OutputFormat; 6] = [
    OutputFormat::Ply,
    OutputFormat::Pcd,
    OutputFormat::Las,
    OutputFormat::Laz,
    OutputFormat::Xyz,
    OutputFormat::Npy,
];

fn written(points: &Points, format: OutputFormat, lattice: Option<ScaleOffset>) -> Result<Vec<u8>, OutError> {
    let mut survey = Survey::default();
    survey.add(points);
    let mut writer = PointWriter::new(Cursor::new(Vec::new()), format, &survey.with_lattice(lattice))?;
    // Written in two blocks.
    let middle = points.len() / 2;
    for part in [0..middle, middle..points.len()] {
        let mut some = points.clone();
        some.retain(|i| part.contains(&i));
        writer.write(&some)?;
    }
    Ok(writer.finish()?.into_inner())
}

fn full() -> Points {
    let mut points = Points::of_positions(foreign::far_points());
    points.normals = model::normals();
    points.colours = model::colours();
    points.intensities = (0..20).map(|i| f32::from(foreign::intensity(i))).collect();
    points.classes = (0..20).map(foreign::class).collect();
    points
}

#[test]
fn every_format_gives_back_what_it_was_given() {
    let points = full();
    for format in FORMATS {
        let bytes = written(&points, format, None).unwrap();
        let cloud =
            read_bytes(&bytes, None, "a.xyz").unwrap_or_else(|error| panic!("{format:?}: {error}")).cloud;
        for (i, exact) in points.positions.iter().enumerate() {
            assert!((0..3).all(|k| (cloud.point(i)[k] - exact[k]).abs() < 1e-7), "{format:?}: point {i}");
        }
        let (is_las, is_npy) =
            (matches!(format, OutputFormat::Las | OutputFormat::Laz), format == OutputFormat::Npy);
        assert_eq!(cloud.normals().is_some(), !is_las && !is_npy, "{format:?}");
        assert_eq!(cloud.normals().unwrap_or(&points.normals), points.normals, "{format:?}");
        assert_eq!(cloud.colours(), (!is_npy).then_some(&points.colours[..]), "{format:?}");
        assert_eq!(cloud.intensities(), (!is_npy).then_some(&points.intensities[..]), "{format:?}");
        assert_eq!(cloud.classes(), (!is_npy).then_some(&points.classes[..]), "{format:?}");
        let mut survey = Survey::default();
        survey.add(&points);
        let lost = format.loses(&survey);
        assert_eq!(lost.len(), if is_npy { 4 } else { usize::from(is_las) }, "{format:?}: {lost:?}");
    }
}

#[test]
fn las_keeps_the_steps_of_its_input() {
    let lattice = ScaleOffset { scale: [0.125, 0.25, 0.125], offset: [4_000_000.0, -500_000.0, 0.0] };
    let exact = foreign::far_points();
    for format in [OutputFormat::Las, OutputFormat::Laz] {
        let points = Points::of_positions(exact.clone());
        let bytes = written(&points, format, Some(lattice)).unwrap();
        assert_eq!(bytes[131..139], lattice.scale[0].to_le_bytes());
        assert_eq!(bytes[139..147], lattice.scale[1].to_le_bytes());
        let cloud = read_bytes(&bytes, None, "a").unwrap().cloud;
        assert!((0..20).all(|i| cloud.point(i) == exact[i]), "whole steps lose nothing");
    }
    let text = written(&Points::of_positions(exact), OutputFormat::Xyz, Some(lattice)).unwrap();
    assert!(text.starts_with(b"4000000.000 -500000.000 -0.250\n"), "three decimals are all there is");
}

#[test]
fn coordinates_that_las_cannot_count_are_refused() {
    let points = Points::of_positions(vec![[0.0; 3], [1e9, 0.0, 0.0]]);
    let fine = ScaleOffset { scale: [1e-3; 3], offset: [0.0; 3] };
    let refused = written(&points, OutputFormat::Laz, Some(fine)).unwrap_err();
    assert!(matches!(refused, OutError::TooWide { .. }), "{refused}");
    assert!(written(&points, OutputFormat::Laz, None).is_ok(), "with steps of its own");
}

#[test]
fn single_precision_is_enough_where_it_is_exact() {
    let points = Points::of_positions(model::points().iter().map(|p| p.map(f64::from)).collect());
    let length = |format| written(&points, format, None).unwrap().len();
    assert_eq!(length(OutputFormat::Npy), 128 + 20 * 12);
    let mut finer = points.clone();
    finer.positions[3][1] += 1e-12;
    assert_eq!(written(&finer, OutputFormat::Npy, None).unwrap().len(), 128 + 20 * 24);
}
