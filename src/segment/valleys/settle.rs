//! Settling: triangles go to grains by the majority of their vertices, and what is certain may be published.

use super::fates::Fates;
use super::neighbours::Neighbours;
use super::{NONE, UNKNOWN};
use crate::segment::Sizes;
use crate::segment::settle::{Evidence, Segment, Settled};
use crate::tile::TileMesh;
use rayon::prelude::*;

/// Gives every triangle to the grain that two of its vertices belong to, drops grains below the smallest, and sorts out
/// what the core may publish: see [`Settled`], whose rule of the lowest triangle holds here as well.
pub fn settle(
    mesh: &TileMesh,
    neighbours: &Neighbours,
    grown: &[u32],
    (fates, evidence): (&Fates, &[Evidence]),
    sizes: &Sizes,
) -> Settled {
    let of_vertex = |v: u32| match grown[v as usize] {
        label if label >= UNKNOWN => label,
        label => fates.group[label as usize],
    };
    let grain: Vec<u32> = mesh
        .triangles
        .par_iter()
        .with_min_len(1 << 12)
        .map(|corners| majority(corners.map(of_vertex), fates))
        .collect();
    let groups = fates.group.len();
    let (mut lowest, mut count, mut size) = (vec![NONE; groups], vec![0usize; groups], vec![0u64; groups]);
    for (t, &group) in (0u32..).zip(&grain).filter(|(_, group)| **group < UNKNOWN) {
        let group = group as usize;
        lowest[group] = lowest[group].min(t);
        count[group] += 1;
        if size[group] < sizes.smallest {
            size[group] += sizes.of(mesh, t);
        }
    }
    let owned = |group: usize| lowest[group] != NONE && mesh.in_core[lowest[group] as usize];
    let mut segments: Vec<Option<Segment>> = (0..groups)
        .map(|group| {
            let publish = fates.known[group] && owned(group) && size[group] >= sizes.smallest;
            publish.then(|| Segment {
                triangles: Vec::with_capacity(count[group]),
                at_mesh_edge: false,
                evidence: Some(evidence[group]),
            })
        })
        .collect();
    let mut unsettled = Vec::new();
    for (t, &group) in (0u32..).zip(&grain).filter(|(_, group)| **group != NONE) {
        let in_core = mesh.in_core[t as usize];
        if group == UNKNOWN {
            unsettled.extend(in_core.then_some(t));
        } else if let Some(segment) = &mut segments[group as usize] {
            segment.triangles.push(t);
            segment.at_mesh_edge |= mesh.triangles[t as usize].iter().any(|&v| neighbours.at_mesh_edge(v as usize));
        } else if in_core && !fates.known[group as usize] && owned(group as usize) {
            unsettled.push(t);
        }
    }
    let mut grains: Vec<Segment> = segments.into_iter().flatten().collect();
    grains.sort_unstable_by_key(|segment| segment.triangles[0]);
    Settled { grains, oversize: Vec::new(), unsettled }
}

/// What at least two of three vertices say; [`NONE`] where no two agree, and [`UNKNOWN`] where two might.
fn majority([a, b, c]: [u32; 3], fates: &Fates) -> u32 {
    let agreed = if a == b || a == c {
        a
    } else if b == c {
        b
    } else {
        NONE
    };
    let open = |label: &u32| *label < UNKNOWN && !fates.known[*label as usize];
    match agreed {
        NONE if a == b || a == c || b == c => NONE,
        NONE if [a, b, c].contains(&UNKNOWN) => UNKNOWN,
        // Two that are not joined yet may turn out to be one.
        NONE if [a, b, c].iter().filter(|label| open(label)).count() > 1 => UNKNOWN,
        agreed => agreed,
    }
}
