//! Owns the choice of aggregates: which sites move as one on the next coarser level.
//!
//! On the finest level, boxes of space, each split into its connected pieces, so that struts that pass close by do not
//! stick together; scraps join the neighbour they are tied to most. On coarser levels, a site and all its neighbours.

use super::aggregate::NONE;
use crate::parts::{apart, join, root as find};
use rayon::prelude::*;
use std::collections::HashMap;
use std::ops::Range;

/// Sites below which a piece of a box is a scrap.
const SCRAP: usize = 8;

/// Each site's aggregate, or [`NONE`], and how many there are.
pub type Groups = (Vec<u32>, usize);

/// Calls its second argument with every site of a range and the columns of its row.
pub trait Rows: Fn(Range<usize>, &mut dyn FnMut(usize, &[u32])) + Sync {}

impl<F: Fn(Range<usize>, &mut dyn FnMut(usize, &[u32])) + Sync> Rows for F {}

/// Pieces of boxes that `strong` rows connect. `boxes[i]` is a site's box, or [`NONE`] to leave it out; `all` rows say
/// where scraps without a strong neighbour belong.
pub fn in_boxes(mut boxes: Vec<u32>, strong: &impl Rows, all: &impl Rows) -> Groups {
    let mut root = join_in_boxes(&boxes, strong);
    let mut size = vec![0u32; boxes.len()];
    for i in 0..boxes.len() {
        let r = find(&mut root, i as u32);
        root[i] = r;
        size[r as usize] += 1;
    }
    join_scraps(&boxes, &mut root, &mut size, strong);
    join_scraps(&boxes, &mut root, &mut size, all);
    // A root is the smallest of its sites, so it is met first; its number takes the place of its size.
    let (mut number, mut count) = (size, 0);
    for i in 0..boxes.len() {
        if boxes[i] == NONE {
            continue;
        }
        let r = find(&mut root, i as u32) as usize;
        if r == i {
            number[i] = count;
            count += 1;
        }
        boxes[i] = number[r];
    }
    (boxes, count as usize)
}

/// A site and its strong neighbours, wherever all of them are still free; the rest join the aggregate they are coupled to
/// most. `neighbours` replaces the list by (site, strength of the coupling from 0 to 1), itself left out; couplings of at
/// least `strong` are strong ones.
pub fn greedy(
    sites: usize,
    strong: f32,
    neighbours: impl Fn(usize, &mut Vec<(u32, f32)>),
) -> Groups {
    let mut of = vec![NONE; sites];
    let mut count = 0u32;
    let mut list = Vec::new();
    for i in 0..sites {
        if of[i] != NONE {
            continue;
        }
        neighbours(i, &mut list);
        list.retain(|&(_, strength)| strength >= strong);
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
    (of, count as usize)
}

/// Sites per task.
const CHUNK: usize = 1 << 17;

/// Joins coupled sites of the same box: chunks of sites on their own, then across chunks.
fn join_in_boxes(boxes: &[u32], rows: &impl Rows) -> Vec<u32> {
    let mut root = apart(boxes.len());
    let chunk = CHUNK.min(boxes.len() / 8 + 1);
    let across: Vec<Vec<(u32, u32)>> = root
        .par_chunks_mut(chunk)
        .enumerate()
        .map(|(c, part)| {
            let start = c * chunk;
            // Numbered from zero while the chunk is on its own.
            part.iter_mut().for_each(|r| *r -= start as u32);
            let mut across = Vec::new();
            rows(start..start + part.len(), &mut |i, row| {
                if boxes[i] == NONE {
                    return;
                }
                for &j in row {
                    if j as usize >= i || boxes[j as usize] != boxes[i] {
                        continue;
                    }
                    if j as usize >= start {
                        join(part, (i - start) as u32, j - start as u32);
                    } else {
                        across.push((i as u32, j));
                    }
                }
            });
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

/// Joins every scrap to the piece it has most couplings with.
fn join_scraps(boxes: &[u32], root: &mut [u32], size: &mut [u32], rows: &impl Rows) {
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
    for r in order {
        let own = find(root, r);
        if size[own as usize] as usize >= SCRAP {
            continue; // another scrap has joined it
        }
        let mut ties: Vec<(u32, u32)> = Vec::new();
        for &i in &members[&r] {
            rows(i as usize..i as usize + 1, &mut |_, row| {
                for &j in row.iter().filter(|j| boxes[**j as usize] != NONE) {
                    let other = find(root, j);
                    match ties.iter_mut().find(|t| t.0 == other) {
                        _ if other == own => {}
                        Some(t) => t.1 += 1,
                        None => ties.push((other, 1)),
                    }
                }
            });
        }
        let most = ties.iter().max_by_key(|t| (t.1, std::cmp::Reverse(t.0)));
        if let Some(&(other, _)) = most {
            let both = size[own as usize] + size[other as usize];
            join(root, own, other);
            size[find(root, own) as usize] = both;
        }
    }
}
