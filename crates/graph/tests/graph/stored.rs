//! The graph in a container, and forged containers.
use nearmiss_graph::{GraphOptions, PointGraph};
use nearmiss_store::{Check, File, Flaw, LoadError, Writer};
use nearmiss_testdata::arbitrary::{CloudKind, cloud};

#[expect(clippy::cast_possible_truncation, reason = "points are stored in single precision")]
fn graph() -> PointGraph {
    let points: Vec<[f32; 3]> = cloud(CloudKind::Rings, 300, 1).iter().map(|p| p.map(|x| x as f32)).collect();
    PointGraph::build(&points, &GraphOptions::default()).unwrap()
}

/// Returns the container of a graph as bytes.
fn stored(graph: &PointGraph) -> Vec<u8> {
    let mut writer = Writer::new(*b"TEST", 1);
    graph.add_to(&mut writer).unwrap();
    let mut bytes = Vec::new();
    writer.write_to(&mut bytes).unwrap();
    bytes
}

#[test]
fn what_is_stored_comes_back() {
    let graph = graph();
    let file = File::from_bytes(stored(&graph), Check::Full).unwrap();
    let again = PointGraph::load(&file, graph.meta(), 300, Check::Full).unwrap();
    assert_eq!((again.counts(), again.bytes()), (graph.counts(), graph.bytes()));
    assert!(again.edges().edges().eq(graph.edges().edges()), "edges");
    assert!(again.virtual_edges().edges().eq(graph.virtual_edges().edges()), "virtual edges");
    assert!(graph.counts().virtual_edges > 0, "there are some");
    assert_eq!(
        (again.radii(), again.reaches(), again.components()),
        (graph.radii(), graph.reaches(), graph.components())
    );
    let wrong = PointGraph::load(&file, graph.meta(), 301, Check::Structure).unwrap_err();
    assert!(matches!(wrong, LoadError::Flaw(Flaw::Length { expected: 301, found: 300, .. })), "{wrong}");
}

/// Reads everything that a user of the graph could read.
fn walk(graph: &PointGraph) -> usize {
    let lists = |i| graph.edges().of(i).iter().chain(graph.virtual_edges().of(i));
    let ends = (0..graph.len()).flat_map(lists);
    let read = |&j: &u32| graph.edges().of(j as usize).len() + usize::from(graph.is_border(j as usize));
    ends.chain(graph.components()).map(read).sum()
}

#[test]
fn no_byte_changed_leads_out_of_the_arrays() {
    let graph = graph();
    let bytes = stored(&graph);
    let file = File::from_bytes(bytes.clone(), Check::Full).unwrap();
    let (mut refused, mut tried) = (0, 0);
    for section in file.sections() {
        let first = usize::try_from(section.offset).unwrap();
        let last = first + usize::try_from(section.length).unwrap();
        for place in (first..last).step_by(7) {
            for flip in [1, 0x80] {
                let mut changed = bytes.clone();
                changed[place] ^= flip;
                // Opens without comparing checksums.
                let file = File::from_bytes(changed, Check::Structure).unwrap();
                tried += 1;
                match PointGraph::load(&file, graph.meta(), 300, Check::Structure) {
                    Ok(lying) => assert!(walk(&lying) > 0, "byte {place}"),
                    Err(_) => refused += 1,
                }
                if let Ok(lying) = PointGraph::load(&file, graph.meta(), 300, Check::Full) {
                    let same = lying.edges().edges().eq(graph.edges().edges());
                    assert!(same && lying.components() == graph.components(), "byte {place}");
                }
            }
        }
    }
    assert!(refused * 2 > tried, "{refused} of {tried} refused by structure alone");
}

#[cfg(feature = "rayon")]
#[test]
#[expect(clippy::cast_possible_truncation, reason = "points are stored in single precision")]
fn the_number_of_threads_changes_no_byte() {
    let points: Vec<[f32; 3]> =
        cloud(CloudKind::Sphere, 20_000, 1).iter().map(|p| p.map(|x| x as f32)).collect();
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        stored(&pool.install(|| PointGraph::build(&points, &GraphOptions::default()).unwrap()))
    };
    let one = on(1);
    assert!(one == on(2) && one == on(5), "bytes differ");
}
