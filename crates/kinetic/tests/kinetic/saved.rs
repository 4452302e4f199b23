//! Saving and opening: a tree that continues as if nothing had happened, and files that are wrong.

use nearmiss_kinetic::KineticTree;
use nearmiss_testdata::arbitrary::rng;
use rand::RngExt;
use xxhash_rust::xxh3::xxh3_64;

use crate::model::{MOTIONS, Model, Motion, plan};

fn bytes(tree: &KineticTree) -> Vec<u8> {
    let mut bytes = Vec::new();
    tree.write_to(&mut bytes).unwrap();
    bytes
}

/// A tree in the middle of its life: points, primitives, nodes and leaves were freed.
fn lived(motion: Motion, arity: usize, seed: u64) -> Model {
    let rng = &mut rng(seed);
    let mut model = Model::random(motion, 60, arity, rng);
    model.tree.advance(model.tree.clock() + 0.4).unwrap();
    for i in 0..30 {
        model.remove(i);
    }
    for i in 0..10 {
        model.insert(&[i]);
    }
    model.tree.add_point(plan(motion, 0.0, rng)).unwrap();
    model.tree.remove_point(60).unwrap();
    model.tree.advance(model.tree.clock() + 0.1).unwrap();
    model
}

#[test]
fn an_opened_tree_continues_identically() {
    for (motion, arity) in MOTIONS.into_iter().zip([1, 3].into_iter().cycle()) {
        let mut model = lived(motion, arity, 1);
        let mut opened = KineticTree::from_bytes(bytes(&model.tree)).unwrap();
        assert_eq!(bytes(&opened), bytes(&model.tree), "{motion:?}: saved again");
        let rng = &mut rng(2);
        for step in 0..20 {
            let now = model.tree.clock();
            let other = plan(motion, now, rng);
            for tree in [&mut model.tree, &mut opened] {
                tree.advance(now + 0.05).unwrap();
                tree.set_plan(step, other.clone()).unwrap();
                let added = tree.insert(&[step]).unwrap();
                if step % 3 == 0 {
                    tree.remove(added).unwrap();
                }
            }
            assert_eq!(opened.counts(), model.tree.counts(), "{motion:?}: step {step}");
            assert_eq!(bytes(&opened), bytes(&model.tree), "{motion:?}: step {step}");
        }
    }
}

/// Corrects the checksums of a container, as a forger would.
fn sealed(mut file: Vec<u8>) -> Vec<u8> {
    let number = |file: &[u8], at: usize| {
        usize::try_from(u64::from_le_bytes(file[at..at + 8].try_into().unwrap())).unwrap()
    };
    let sections = usize::from(file[20]);
    for row in (0..sections).map(|i| 64 + 40 * i) {
        let [start, length] = [number(&file, row + 8), number(&file, row + 16)];
        let sum = xxh3_64(&file[start..start + length]);
        file[row + 32..row + 40].copy_from_slice(&sum.to_le_bytes());
    }
    let sum = xxh3_64(&file[64..64 + 40 * sections]);
    file[32..40].copy_from_slice(&sum.to_le_bytes());
    let sum = xxh3_64(&file[..56]);
    file[56..64].copy_from_slice(&sum.to_le_bytes());
    file
}

#[test]
fn damage_is_noticed() {
    let original = bytes(&lived(Motion::Legs, 3, 3).tree);
    assert_eq!(sealed(original.clone()), original, "checksums as the container has them");
    for at in (0..original.len()).step_by(37) {
        let mut file = original.clone();
        file[at] ^= 4;
        assert!(KineticTree::from_bytes(file).is_err(), "byte {at}");
        assert!(KineticTree::from_bytes(original[..at].to_vec()).is_err(), "cut at {at}");
    }
}

/// Forged numbers with right checksums: an error, or a tree that works without a panic. Its boxes
/// may be wrong.
#[test]
fn forged_files_do_not_panic() {
    let rng = &mut rng(4);
    let [mut refused, mut accepted] = [0, 0];
    for (motion, arity) in [(Motion::Legs, 1), (Motion::Legs, 3), (Motion::Lattice, 3), (Motion::Jumps, 2)] {
        let original = bytes(&lived(motion, arity, 5).tree);
        for _ in 0..1500 {
            let mut file = original.clone();
            let start = 64 + 40 * usize::from(file[20]);
            for _ in 0..rng.random_range(1..3) {
                let at = rng.random_range(start / 4..file.len() / 4) * 4;
                let value: u32 = match rng.random_range(0..5) {
                    0 => rng.random(),
                    1 => u32::MAX,
                    2 => 0x7FF0_0000,
                    3 => rng.random_range(0..100),
                    _ => 0,
                };
                file[at..at + 4].copy_from_slice(&value.to_le_bytes());
            }
            let Ok(mut tree) = KineticTree::from_bytes(sealed(file)) else {
                refused += 1;
                continue;
            };
            accepted += 1;
            let clock = tree.clock();
            let _ = tree.advance(clock + 1.0);
            let _ = tree.insert(&[3]);
            for primitive in 0..70 {
                let _ = tree.remove(primitive);
                let _ = tree.set_plan(primitive, plan(motion, clock, rng));
            }
            let _ = tree.advance(clock + 2.0);
            let _ = tree.remove_point(1);
            tree.in_box(&tree.bounds(), |_| ());
        }
    }
    assert!(refused > 1000 && accepted > 100, "{refused} refused, {accepted} accepted");
}
