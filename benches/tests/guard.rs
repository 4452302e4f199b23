//! Compares answers with those on record.
use std::fs;
use std::path::Path;

use nearmiss_benches::guard::answers::{ask, faults, read, written};
use nearmiss_benches::guard::cases::shipped;

#[test]
fn answers_are_those_on_record() {
    for case in shipped().unwrap() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("record/answers/{}.csv", case.name));
        let old = read(&fs::read_to_string(path).unwrap()).unwrap();
        let new = ask(&case).unwrap();
        let faults = faults(&new, &old);
        assert!(faults.is_empty(), "{}:\n{}", case.name, faults.join("\n"));
        assert_eq!(read(&written(&new)).unwrap().len(), old.len(), "{}", case.name);
    }
}

#[test]
fn what_is_worse_is_a_fault() {
    let header = "certified,estimated,surface,thickened,gap,lower,upper,curves,closed,length,touches\n";
    let rows = |row: &str| read(&format!("{header}{row}\n")).unwrap();
    let good = "Sc,Se,Sc,Se,2e-1,9e-1,1e0,1,1,5e0,5";
    let count = |row: &str| faults(&rows(row), &rows(good)).len();
    assert_eq!(count(good), 0);
    // A changed verdict, a lost certificate, a lost gap with its lower mean. A gained certificate
    // is no fault.
    assert_eq!(count("Ic,Se,Sc,Se,2e-1,9e-1,1e0,1,1,5e0,5"), 1);
    assert_eq!(count("Se,Se,Sc,Se,2e-1,9e-1,1e0,1,1,5e0,5"), 1);
    assert_eq!(count("Sc,Se,Sc,Se,0e0,9e-1,1e0,1,1,5e0,5"), 2);
    assert_eq!(count("Sc,Sc,Sc,Se,3e-1,9.5e-1,1e0,1,1,5e0,5"), 0);
    // A certified gap that exceeds the distance.
    assert_eq!(count("Sc,Se,Sc,Se,1.01e0,9e-1,1e0,1,1,5e0,5"), 1);
    // A looser upper bound, an upper bound below the lower bound on record, a looser lower bound.
    assert_eq!(count("Sc,Se,Sc,Se,2e-1,9e-1,1.1e0,1,1,5e0,5"), 1);
    assert_eq!(count("Sc,Se,Sc,Se,2e-1,8.95e-1,8e-1,1,1,5e0,5"), 1);
    assert_eq!(count("Sc,Se,Sc,Se,2e-1,5e-1,1e0,1,1,5e0,5"), 1);
    // Changed curves and touches; missing answers.
    assert_eq!(count("Sc,Se,Sc,Se,2e-1,9e-1,1e0,1,0,5e0,5"), 1);
    assert_eq!(count("Sc,Se,Sc,Se,2e-1,9e-1,1e0,1,1,5.2e0,5"), 1);
    assert_eq!(count("Sc,Se,Sc,Se,2e-1,9e-1,1e0,1,1,5e0,4"), 1);
    assert_eq!(faults(&[], &rows(good)).len(), 3);
    assert!(read("nonsense").is_err() && read(&format!("{header}Sx,Se,Sc,Se,0,0,0,,,,\n")).is_err());
}
