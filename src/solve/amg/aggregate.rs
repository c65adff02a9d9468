//! Owns aggregation: which sites move as one on the next coarser level.
//!
//! On the finest level, boxes of space, each split into its connected pieces, so that struts that pass close by do not
//! stick together; scraps join the neighbour they are tied to most. On coarser levels, a site and all its neighbours.

use super::level::NONE;
use rayon::prelude::*;
use std::collections::HashMap;

/// Sites below which a piece of a box is a scrap.
const SCRAP: usize = 8;

/// Sites by aggregate.
#[derive(Debug, Clone)]
pub struct Aggregates {
    /// Per site its aggregate, or [`NONE`].
    pub of: Vec<u32>,
    pub count: usize,
    /// Sites aggregate by aggregate, and where each aggregate's begin (one more at the end).
    pub members: Vec<u32>,
    pub starts: Vec<u32>,
}

impl Aggregates {
    fn new(of: Vec<u32>, count: usize) -> Self {
        let mut starts = vec![0u32; count + 1];
        for &a in of.iter().filter(|&&a| a != NONE) {
            starts[a as usize + 1] += 1;
        }
        for a in 0..count {
            starts[a + 1] += starts[a];
        }
        let mut next = starts.clone();
        let mut members = vec![0; starts[count] as usize];
        for (site, &a) in of.iter().enumerate() {
            if a != NONE {
                members[next[a as usize] as usize] = site as u32;
                next[a as usize] += 1;
            }
        }
        Aggregates {
            of,
            count,
            members,
            starts,
        }
    }

    pub fn members(&self, aggregate: usize) -> &[u32] {
        &self.members[self.starts[aggregate] as usize..self.starts[aggregate + 1] as usize]
    }

    /// Connected pieces of boxes. `boxes[i]` is a site's box, or [`NONE`] to leave it out; `neighbours` replaces
    /// the list it is given by the sites that site `i` is coupled to.
    pub fn in_boxes(boxes: &[u32], neighbours: impl Fn(usize, &mut Vec<u32>) + Sync) -> Self {
        let mut root = join_in_boxes(boxes, &neighbours);
        let mut size = vec![0u32; boxes.len()];
        for i in 0..boxes.len() {
            let r = find(&mut root, i as u32);
            size[r as usize] += 1;
        }
        join_scraps(boxes, &mut root, &mut size, &neighbours);
        let mut number = vec![NONE; boxes.len()];
        let mut of = vec![NONE; boxes.len()];
        let mut count = 0;
        for i in 0..boxes.len() {
            if boxes[i] == NONE {
                continue;
            }
            let r = find(&mut root, i as u32) as usize;
            if number[r] == NONE {
                number[r] = count;
                count += 1;
            }
            of[i] = number[r];
        }
        Aggregates::new(of, count as usize)
    }

    /// A site and its neighbours, wherever all of them are still free; the rest join the aggregate they are coupled
    /// to most. `neighbours` replaces the list by (site, strength of the coupling), itself left out.
    pub fn greedy(sites: usize, neighbours: impl Fn(usize, &mut Vec<(u32, f32)>)) -> Self {
        let mut of = vec![NONE; sites];
        let mut count = 0u32;
        let mut list = Vec::new();
        for i in 0..sites {
            if of[i] != NONE {
                continue;
            }
            neighbours(i, &mut list);
            if list.is_empty() || list.iter().any(|&(j, _)| of[j as usize] != NONE) {
                continue;
            }
            of[i] = count;
            list.iter().for_each(|&(j, _)| of[j as usize] = count);
            count += 1;
        }
        let roots = of.clone();
        for i in 0..sites {
            if of[i] == NONE {
                neighbours(i, &mut list);
                of[i] = strongest(&list, &roots);
            }
        }
        for i in 0..sites {
            if of[i] != NONE {
                continue;
            }
            neighbours(i, &mut list);
            of[i] = count;
            for &(j, _) in &list {
                if of[j as usize] == NONE {
                    of[j as usize] = count;
                }
            }
            count += 1;
        }
        Aggregates::new(of, count as usize)
    }
}

/// Sites per task.
const CHUNK: usize = 1 << 17;

/// Joins coupled sites of the same box: chunks of sites on their own, then across chunks.
fn join_in_boxes(boxes: &[u32], neighbours: &(impl Fn(usize, &mut Vec<u32>) + Sync)) -> Vec<u32> {
    let mut root: Vec<u32> = (0..boxes.len() as u32).collect();
    let chunk = CHUNK.min(boxes.len() / 8 + 1);
    let across: Vec<Vec<(u32, u32)>> = root
        .par_chunks_mut(chunk)
        .enumerate()
        .map(|(c, part)| {
            let start = c * chunk;
            // Numbered from zero while the chunk is on its own.
            part.iter_mut().for_each(|r| *r -= start as u32);
            let (mut list, mut across) = (Vec::new(), Vec::new());
            for i in start..start + part.len() {
                if boxes[i] == NONE {
                    continue;
                }
                neighbours(i, &mut list);
                for &j in &list {
                    if j as usize >= i || boxes[j as usize] != boxes[i] {
                        continue;
                    }
                    if j as usize >= start {
                        join(part, (i - start) as u32, j - start as u32);
                    } else {
                        across.push((i as u32, j));
                    }
                }
            }
            part.iter_mut().for_each(|r| *r += start as u32);
            across
        })
        .collect();
    for (i, j) in across.into_iter().flatten() {
        join(&mut root, i, j);
    }
    root
}

fn strongest(list: &[(u32, f32)], of: &[u32]) -> u32 {
    let mut best = (NONE, 0.0);
    for &(j, strength) in list {
        if of[j as usize] != NONE && strength > best.1 {
            best = (of[j as usize], strength);
        }
    }
    best.0
}

fn find(root: &mut [u32], mut i: u32) -> u32 {
    while root[i as usize] != i {
        root[i as usize] = root[root[i as usize] as usize];
        i = root[i as usize];
    }
    i
}

fn join(root: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find(root, a), find(root, b));
    root[a.max(b) as usize] = a.min(b);
}

/// Joins every scrap to the piece it has most couplings with.
fn join_scraps(
    boxes: &[u32],
    root: &mut [u32],
    size: &mut [u32],
    neighbours: &impl Fn(usize, &mut Vec<u32>),
) {
    let mut members: HashMap<u32, Vec<u32>> = HashMap::new();
    let mut order = Vec::new();
    for i in 0..boxes.len() as u32 {
        let r = find(root, i);
        if boxes[i as usize] != NONE && (size[r as usize] as usize) < SCRAP {
            let list = members.entry(r).or_insert_with(|| {
                order.push(r);
                Vec::new()
            });
            list.push(i);
        }
    }
    let mut list = Vec::new();
    for r in order {
        let own = find(root, r);
        if size[own as usize] as usize >= SCRAP {
            continue; // another scrap has joined it
        }
        let mut ties: Vec<(u32, u32)> = Vec::new();
        for &i in &members[&r] {
            neighbours(i as usize, &mut list);
            for &j in list.iter().filter(|&&j| boxes[j as usize] != NONE) {
                let other = find(root, j);
                match ties.iter_mut().find(|t| t.0 == other) {
                    _ if other == own => {}
                    Some(t) => t.1 += 1,
                    None => ties.push((other, 1)),
                }
            }
        }
        let most = ties.iter().max_by_key(|t| (t.1, std::cmp::Reverse(t.0)));
        if let Some(&(other, _)) = most {
            let both = size[own as usize] + size[other as usize];
            join(root, own, other);
            size[find(root, own) as usize] = both;
        }
    }
}
