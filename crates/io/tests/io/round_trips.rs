//! Round trips: content is read back as written, in every format and encoding.

use std::path::Path;

use nearmiss_io::{Column, Format, Model, PlyPoints, read, read_bytes, read_mesh};
use nearmiss_testdata::files::foreign;
use nearmiss_testdata::files::model::{colours, normals, points, triangles};
use nearmiss_testdata::files::plain::{Encoding, csv, obj, pcd, ply};

fn model(bytes: &[u8], name: &str) -> Model {
    read_bytes(bytes, None, Path::new(name)).unwrap_or_else(|e| panic!("{e}"))
}

#[track_caller]
fn assert_same(model: &Model, mesh: bool, with_normals: bool) {
    assert_eq!(model.cloud.positions(), points(), "positions");
    assert_eq!(model.cloud.normals(), with_normals.then(normals).as_deref(), "normals");
    assert_eq!(model.cloud.colours(), Some(&colours()[..]), "colours");
    let found = model.mesh.as_ref().map(|mesh| mesh.triangles().to_vec());
    assert_eq!(found, mesh.then(triangles), "triangles");
}

#[test]
fn ply_in_all_encodings_and_types() {
    for encoding in [Encoding::Ascii, Encoding::Little, Encoding::Big] {
        for coordinate in ["float", "double"] {
            for index in ["char", "uchar", "short", "ushort", "int", "uint", "float"] {
                assert_same(&model(&ply(encoding, coordinate, index), "a"), true, true);
            }
        }
        let whole = model(&ply(encoding, "double", "int"), "a");
        for kind in ["char", "uchar", "short", "ushort", "int", "uint"] {
            let bytes = ply(encoding, kind, "int");
            if encoding != Encoding::Ascii {
                let rounded = model(&bytes, "a").cloud;
                assert_eq!(rounded.point(1)[0].to_bits(), whole.cloud.point(1)[0].to_bits(), "{kind}");
            }
        }
    }
}

#[test]
fn ply_with_other_line_ends_and_a_mark_of_byte_order() {
    let text = String::from_utf8(ply(Encoding::Ascii, "float", "int")).unwrap();
    for text in [
        text.replace('\n', "\r\n"),
        text.replace('\n', "\r"),
        text.replace(' ', "\t").replace("\t1.0", " 1.0"),
        text.replace('\n', " \n\n"),
        text.trim_end().to_owned(),
        format!("\u{feff}{text}"),
    ] {
        assert_same(&model(text.as_bytes(), "a.ply"), true, true);
    }
    let binary = ply(Encoding::Little, "float", "int");
    let end = binary.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = String::from_utf8(binary[..end].to_vec()).unwrap();
    for line_end in ["\r\n", "\r"] {
        let mut bytes = header.replace('\n', line_end).into_bytes();
        bytes.extend(&binary[end..]);
        bytes.extend(b"trailing bytes are ignored");
        assert_same(&model(&bytes, "a.ply"), true, true);
    }
}

#[test]
fn pcd_in_all_encodings() {
    for data in ["ascii", "binary", "binary_compressed"] {
        let model = model(&pcd(data), "a");
        assert_same(&model, false, true);
        assert_eq!(model.cloud.dropped().not_finite, 2, "{data}");
    }
}

#[test]
fn pcd_of_older_versions_and_colours_as_floats() {
    let mut text =
        String::from("# .PCD v.5\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\nPOINTS 20\nDATA ascii\n");
    for (p, &[r, g, b]) in points().iter().zip(&colours()) {
        let packed = f32::from_bits(u32::from_be_bytes([0, r, g, b]));
        text += &format!("{} {} {} {packed:e}\n", p[0], p[1], p[2]);
    }
    assert_same(&model(text.as_bytes(), "a"), false, false);
}

#[test]
fn text_with_names_in_all_divisions() {
    for divider in [",", ";", " ", "\t", " , ", "; "] {
        assert_same(&model(&csv(divider), "a.txt"), false, true);
    }
    let quoted = String::from_utf8(csv("\",\"")).unwrap().replace("wall", "wall\"");
    let quoted = quoted.lines().map(|line| format!("\"{line}\n")).collect::<String>();
    let quoted = quoted.replace("\"#", "#").replace("label\n", "label\"\n");
    assert_same(&model(quoted.as_bytes(), "a.csv"), false, true);
}

#[test]
fn text_without_names_is_three_columns() {
    let rows = |ends: &str| -> String {
        let row = |p: &[f32; 3]| format!(" {}\t{}  {}{ends}", p[0], p[1], p[2]);
        points().iter().map(row).collect()
    };
    for text in [
        rows("\n"),
        rows("\r\n"),
        rows(" 0 0 1 255 a b\n// a comment\n\n# another\n"),
        format!("20\n{}", rows("\n").trim_end()),
        format!("# points\n20\nx y z\n{}", rows("\n")),
    ] {
        let model = model(text.as_bytes(), "a.xyz");
        assert_eq!(model.cloud.positions(), points(), "{text}");
        assert!(model.cloud.normals().is_none() && model.cloud.colours().is_none() && model.mesh.is_none());
    }
}

#[test]
fn obj_with_all_kinds_of_corners() {
    assert_same(&model(&obj(), "a.obj"), true, false);
    let text = String::from_utf8(obj()).unwrap();
    let plain: String = text.lines().map(|line| line.replace("0.000000", "") + "\r\n").collect();
    let plain = model(plain.as_bytes(), "a.obj");
    assert!(plain.cloud.colours().is_none(), "one vertex without colour takes it from all");
    assert_eq!(plain.mesh.unwrap().triangles(), triangles());
    let (vertices, faces) = text.split_at(text.find("vt").unwrap());
    let faces_first = faces.lines().filter(|l| !l.contains('-')).collect::<Vec<_>>().join("\n");
    let turned = model(format!("{faces_first}\n{vertices}").as_bytes(), "a.obj");
    assert_eq!(turned.mesh.unwrap().triangles().len(), 20, "two of twelve quads left out");
}

#[test]
fn duplicates_leave_the_mesh_alone() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 0\nv 2 0 0\nv 2 1 0\nv 2 2 0\nv 3 3 0\nf 5 7 8\n";
    let model = model(text.as_bytes(), "a.obj");
    assert_eq!(model.cloud.len(), 8);
    assert_eq!(model.cloud.source(), [0, 1, 2, 3, 5, 6, 7, 8]);
    let mesh = model.mesh.unwrap();
    assert_eq!((mesh.vertices().len(), mesh.triangles()), (9, &[[4, 6, 7]][..]));
}

#[test]
fn what_we_write_we_read_byte_for_byte_alike() {
    let (single, normals, colours, triangles) = (points(), normals(), colours(), triangles());
    let double: Vec<[f64; 3]> = single.iter().map(|p| p.map(|x| 1e6 + f64::from(x) / 3.0)).collect();
    let source: Vec<u32> = (100..120).collect();
    for points in [PlyPoints::single(&single), PlyPoints::double(&double)] {
        let full = points
            .with_normals(&normals)
            .with_colours(&colours)
            .with_source(&source)
            .with_edges(&[[0, 19]])
            .with_triangles(&triangles);
        let mut bytes = Vec::new();
        full.write(&mut bytes).unwrap();
        let model = model(&bytes, "a");
        assert_eq!(model.cloud.normals(), Some(&normals[..]));
        assert_eq!(model.cloud.colours(), Some(&colours[..]));
        let mesh = model.mesh.unwrap();
        assert_eq!(mesh.triangles(), triangles);
        let mut again = Vec::new();
        PlyPoints::double(mesh.vertices()).write(&mut again).unwrap();
        let vertices = read_bytes(&again, Some(Format::Ply), Path::new("a")).unwrap();
        assert_eq!(vertices.cloud.positions(), model.cloud.positions());
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("points.ply");
    let mut file = std::fs::File::create(&path).unwrap();
    PlyPoints::double(&double).with_triangles(&triangles[..1]).write(&mut file).unwrap();
    let mesh = read_mesh(&path, None).unwrap();
    assert_eq!(mesh.vertices(), double, "no bit of double precision is lost");
    assert_eq!(read(&path, None).unwrap().mesh, Some(mesh));
}

fn source_of(count: u32) -> Vec<u32> {
    (100..100 + count).collect()
}

#[test]
fn what_does_not_fit_the_points_is_not_written() {
    let points = points();
    let mut out = Vec::new();
    let short = PlyPoints::single(&points).with_source(&[1, 2]).write(&mut out);
    assert_eq!(
        short.unwrap_err().to_string(),
        "expected source indices for each of 20 points, got 2; give one for each"
    );
    let missing = PlyPoints::single(&points).with_edges(&[[0, 1], [2, 20]]).write(&mut out);
    assert_eq!(missing.unwrap_err().to_string(), "expected point indices below 20, got 20 (edge 1)");
    let columns = [Column::Uint("node", &source_of(20)), Column::Float("radius", &[0.5; 19])];
    let short = PlyPoints::single(&points).with_columns(&columns).write(&mut out);
    assert_eq!(
        short.unwrap_err().to_string(),
        "expected values of a column for each of 20 points, got 19; give one for each"
    );
    assert!(out.is_empty(), "nothing written before the checks");
    PlyPoints::single(&points).with_columns(&columns[..1]).write(&mut out).unwrap();
    assert_eq!(out[out.len() - 4..], 119_u32.to_le_bytes(), "the last of the last point");
    let text = String::from_utf8_lossy(&out);
    assert!(text.contains("property uint node\nend_header"), "{text}");
    let mut full: &mut [u8] = &mut [0; 10];
    let failed = PlyPoints::single(&points).write(&mut full).unwrap_err();
    assert!(failed.to_string().starts_with("cannot write the PLY file ("), "{failed}");
}

#[test]
fn las_and_laz_in_all_point_formats() {
    for format in 0..=10 {
        for (extra, packed) in [(0, None), (3, None), (0, Some(50_000)), (2, Some(7)), (0, Some(1))] {
            // `laz` has no compressor for waveforms in the new formats.
            let bytes = foreign::las(format, extra, packed);
            let cloud = model(&bytes, "a").cloud;
            let case = format!("format {format}, {extra} extra bytes, chunks {packed:?}");
            for (i, exact) in foreign::far_points().into_iter().enumerate() {
                assert!((0..3).all(|k| (cloud.point(i)[k] - exact[k]).abs() < 1e-6), "{case}: point {i}");
            }
            let classes: Vec<u8> = (0..20).map(foreign::class).collect();
            let intensities: Vec<f32> = (0..20).map(|i| f32::from(foreign::intensity(i))).collect();
            assert_eq!(cloud.classes(), Some(&classes[..]), "{case}");
            assert_eq!(cloud.intensities(), Some(&intensities[..]), "{case}");
            let has_colours = matches!(format, 2 | 3 | 5 | 7 | 8 | 10);
            assert_eq!(cloud.colours(), has_colours.then(colours).as_deref(), "{case}");
        }
    }
}

#[test]
fn e57_of_two_scans_with_poses() {
    let model = model(&foreign::e57(), "a");
    assert_same(&model, false, false);
    assert_eq!(model.cloud.dropped().not_finite, 1, "the point that is marked as invalid");
    let intensities: Vec<f32> = (0_u8..20).map(|i| f32::from(i) / 32.0).collect();
    assert_eq!(model.cloud.intensities(), Some(&intensities[..]));
    let [low, high] = model.cloud.scanners() else { panic!("two scanners") };
    assert_eq!((low.position, low.points.clone()), ([0.0, 0.0, 5.0], 0..10));
    assert_eq!((high.position, high.points.clone()), ([0.0, 0.0, 7.0], 10..21));
}

#[test]
fn npy_of_several_types() {
    for kind in ["<f4", ">f4", "<f8"] {
        assert_eq!(model(&foreign::npy(kind), "a").cloud.positions(), points(), "{kind}");
    }
    let turned = String::from_utf8_lossy(&foreign::npy("<f4")).replace("False", "True ");
    let refused = read_bytes(turned.as_bytes(), Some(Format::Npy), "a.npy").unwrap_err().to_string();
    assert!(refused.starts_with("a.npy: "), "{refused}");
}

#[test]
fn meshes_of_engines() {
    let exact = model(&foreign::off(), "a");
    assert_same(&exact, true, true);
    for is_binary in [false, true] {
        let found = model(&foreign::gltf(is_binary), "a");
        assert_eq!(found.cloud.positions(), points(), "nodes put the model where it was");
        assert_eq!(found.cloud.colours(), Some(&colours()[..]));
        assert_eq!(found.mesh.unwrap().triangles(), triangles());
        for (n, unit) in found.cloud.normals().unwrap().iter().zip(foreign::unit_normals()) {
            assert!((0..3).all(|k| (n[k] - unit[k]).abs() < 1e-6), "{n:?}");
        }
        // The corners of STL are in the order of the triangles.
        let mesh = model(&foreign::stl(is_binary), "a").mesh.unwrap();
        assert_eq!(mesh.vertices().len(), 20, "corners at one place are one vertex");
        for (found, exact) in mesh.triangles().iter().zip(triangles()) {
            for (corner, exact) in found.iter().zip(exact) {
                let place = points()[exact as usize].map(f64::from);
                assert_eq!(mesh.vertices()[*corner as usize], place);
            }
        }
    }
}
