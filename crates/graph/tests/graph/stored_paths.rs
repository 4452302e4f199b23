//! Close pairs and levels in a container, and forged containers.
use crate::clouds::Cloud;
use nearmiss_graph::{
    Adjacency, ClosePairs, GeodesicKernel, GeodesicScratch, KernelScratch, LevelScratch, Levels, Network,
    Paths,
};
use nearmiss_store::{Check, File, Flaw, LoadError, Writer};
use nearmiss_surface::{SurfaceOptions, SurfacePlan};
use nearmiss_testdata::shapes::torus;

struct Stored {
    cloud: Cloud,
    support_radii: Vec<f32>,
    pairs: ClosePairs,
    levels: Levels,
    bytes: Vec<u8>,
}

fn stored() -> Stored {
    let cloud = Cloud::of_form(torus(1.0, 0.4), 0.15, 0.1, 3);
    let network = Network::new(&cloud.graph, &cloud.lengths);
    let support_radii: Vec<f32> = cloud.radii.iter().map(|r| 3.0 * r).collect();
    let pairs = ClosePairs::build(network, &support_radii, Paths::Stored);
    let levels = Levels::build(network, &cloud.radii);
    let mut writer = Writer::new(*b"TEST", 1);
    pairs.add_to(&mut writer, 0).unwrap();
    levels.add_to(&mut writer).unwrap();
    let mut bytes = Vec::new();
    writer.write_to(&mut bytes).unwrap();
    Stored { cloud, support_radii, pairs, levels, bytes }
}

#[test]
fn what_is_stored_comes_back() {
    let Stored { cloud, support_radii, pairs, levels, bytes } = stored();
    let file = File::from_bytes(bytes, Check::Full).unwrap();
    let again =
        ClosePairs::load(&file, 0, (support_radii.len(), |i: usize| support_radii[i]), Check::Full).unwrap();
    assert_eq!((&again, again.paths()), (&pairs, Paths::Stored));
    assert_eq!(Levels::load(&file, cloud.points.len(), Check::Full).unwrap(), levels);
    assert!(!levels.cells().is_empty());
    let wrong = ClosePairs::load(
        &file,
        0,
        (support_radii.len() - 1, |i: usize| support_radii[i + 1]),
        Check::Structure,
    )
    .unwrap_err();
    assert!(matches!(wrong, LoadError::Flaw(Flaw::Length { .. })), "{wrong}");
    let wrong = Levels::load(&file, cloud.points.len() + 1, Check::Structure).unwrap_err();
    assert!(matches!(wrong, LoadError::Flaw(Flaw::Length { .. })), "{wrong}");
    assert!(matches!(
        ClosePairs::load(&file, 1, (support_radii.len(), |i: usize| support_radii[i]), Check::Structure),
        Err(LoadError::Open(_))
    ));
}

/// Points on a line, half of which come much later in the order. On both sides of the seam, pairs
/// of nearly equal distances are stored in the list and separately.
#[test]
fn lists_of_near_and_far_points_stay_in_order() {
    const COUNT: usize = 70_000;
    let id = |k: u32| if k < 300 { k } else { 65_000 + k };
    let edges: Vec<[u32; 2]> = (0..600).map(|k| [id(k), id(k + 1)]).collect();
    let graph = Adjacency::from_edges(COUNT, &edges);
    let length = |i: u32, j: u32| 0.1 + 1e-6 * f32::from(u16::try_from(i % 61 + j % 61).unwrap());
    let lengths: Vec<f32> = (0..COUNT)
        .flat_map(|i| graph.of(i).iter().map(move |&j| length(u32::try_from(i).unwrap(), j)))
        .collect();
    let network = Network::new(&graph, &lengths);
    let support_radii = vec![3.0; COUNT];
    let pairs = ClosePairs::build(network, &support_radii, Paths::Rebuilt);
    for i in [id(299), id(300)] {
        let list: Vec<f32> = pairs.of(i as usize).map(|close| close.distance).collect();
        assert!(list.len() > 50 && list.windows(2).all(|two| two[0] <= two[1]), "{list:?}");
    }
    let mut writer = Writer::new(*b"TEST", 1);
    pairs.add_to(&mut writer, 0).unwrap();
    let mut bytes = Vec::new();
    writer.write_to(&mut bytes).unwrap();
    let file = File::from_bytes(bytes, Check::Full).unwrap();
    assert_eq!(
        ClosePairs::load(&file, 0, (support_radii.len(), |i: usize| support_radii[i]), Check::Full).unwrap(),
        pairs
    );
}

#[test]
fn no_byte_changed_leads_out_of_the_arrays() {
    let Stored { cloud, support_radii, bytes, .. } = stored();
    let network = Network::new(&cloud.graph, &cloud.lengths);
    let plan = SurfacePlan::new(&SurfaceOptions::default(), 1.0, 1.0).unwrap();
    let n = u32::try_from(cloud.points.len()).unwrap();
    let (mut scratch, mut search, mut path) = (KernelScratch::default(), LevelScratch::default(), Vec::new());
    let mut geodesic = GeodesicScratch::default();
    let (mut refused, mut tried) = (0, 0);
    let file = File::from_bytes(bytes.clone(), Check::Full).unwrap();
    for section in file.sections() {
        let first = usize::try_from(section.offset).unwrap();
        let last = first + usize::try_from(section.length).unwrap();
        let step = ((last - first) / 97).max(1) | 1;
        for place in (first..last).step_by(step) {
            let mut changed = bytes.clone();
            changed[place] ^= 0x81;
            // Opens without comparing checksums.
            let file = File::from_bytes(changed, Check::Structure).unwrap();
            tried += 1;
            match ClosePairs::load(
                &file,
                0,
                (support_radii.len(), |i: usize| support_radii[i]),
                Check::Structure,
            ) {
                Ok(lying) => {
                    let kernel =
                        GeodesicKernel::new(&plan, &cloud.points, &cloud.radii, &cloud.graph, &lying);
                    for i in (0..n).step_by(5) {
                        let x = cloud.points[i as usize].map(|c| f64::from(c) + 0.01);
                        assert!(kernel.evaluate(x, i, &mut scratch).f.is_finite(), "byte {place}");
                        assert_eq!(lying.of(i as usize).count(), lying.of(i as usize).len(), "byte {place}");
                        lying.path(network, [i, (i + 1) % n], &mut geodesic, &mut path);
                    }
                }
                Err(_) => refused += 1,
            }
            match Levels::load(&file, cloud.points.len(), Check::Structure) {
                Ok(lying) => {
                    for i in (0..n).step_by(101) {
                        lying.path(network, [i, (i + n / 2) % n], &mut search, &mut path);
                    }
                }
                Err(_) => refused += 1,
            }
        }
    }
    assert!(refused * 4 > tried, "{refused} of {tried} refused by structure alone");
}

#[test]
fn ways_that_go_round_are_refused() {
    let Stored { cloud, levels, bytes, .. } = stored();
    let cells = &levels.cells()[0];
    // Two points of one cell that point to each other, neither of them the centre.
    let is_centre = |i: u32| cells.centres().contains(&i);
    let n = u32::try_from(cloud.points.len()).unwrap();
    let owner = |i: u32| cells.owners()[i as usize];
    let (a, b) = (0..n)
        .flat_map(|a| (0..a).map(move |b| (a, b)))
        .find(|&(a, b)| owner(a) == owner(b) && !is_centre(a) && !is_centre(b))
        .unwrap();
    let file = File::from_bytes(bytes.clone(), Check::Full).unwrap();
    let section = file.sections().iter().find(|section| section.id.tag == *b"CWAY").unwrap();
    let mut changed = bytes;
    for (from, to) in [(a, b), (b, a)] {
        let place = usize::try_from(section.offset).unwrap() + 4 * from as usize;
        changed[place..place + 4].copy_from_slice(&to.to_le_bytes());
    }
    let file = File::from_bytes(changed, Check::Structure).unwrap();
    let wrong = Levels::load(&file, cloud.points.len(), Check::Structure).unwrap_err();
    assert!(matches!(wrong, LoadError::Flaw(Flaw::Value { what: "the cell of point", .. })), "{wrong}");
}
