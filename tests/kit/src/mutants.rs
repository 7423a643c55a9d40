//! Damaged files: a good file with a few things wrong in it.
//!
//! `MONORIG_MUTANTS=10000` makes so many of each kind, `MONORIG_MUTANT_SEED=7` makes others.

use crate::random::Random;

/// Mutants of each kind: those of the variable MONORIG_MUTANTS, else `few`.
pub fn count(few: u64) -> u64 {
    number_of("MONORIG_MUTANTS", few)
}

/// Seed of the first mutant: mutants of other seeds differ.
pub fn first_seed() -> u64 {
    number_of("MONORIG_MUTANT_SEED", 1) << 32
}

/// The number in a variable; a text that is none is a mistake of whoever set it.
fn number_of(variable: &str, without: u64) -> u64 {
    let given = std::env::var(variable).ok();
    given.map_or(without, |text| match text.parse() {
        Ok(number) => number,
        Err(_) => panic!("{variable}={text} is not a whole number"),
    })
}

/// Pieces that break readers: marks of grammars, numbers at the ends of ranges, bytes that are no text.
const PIECES: &[&[u8]] = &[
    b"[",
    b"]",
    b"{",
    b"}",
    b": ",
    b"- ",
    b"\n",
    b"\t",
    b"'",
    b"\"",
    b"#",
    b"&a ",
    b"*a",
    b"!t ",
    b"|",
    b"---\n",
    b"? ",
    b"<",
    b">",
    b"/>",
    b"<!--",
    b"&lt;",
    b"<!DOCTYPE a>",
    b"=",
    b",",
    b"\0",
    b"\xff",
    b"\x1b[2J",
    b"\xe2\x80\xae",
    b"NaN",
    b".inf",
    b"-.inf",
    b"null",
    b"~",
    b"true",
    b"1e308",
    b"-1e308",
    b"1e-308",
    b"0",
    b"-0",
    b"-1",
    b"1e12",
    b"1e9",
    b"99999999999999999999999",
    b"4294967296",
    b"0x10",
    b"1..100000",
    b"[[[[[[[[",
    b"{a: {a: {a: ",
    b"../",
    b"/dev/zero",
    b".",
];

/// Numbers to put in place of numbers.
const NUMBERS: &[&str] = &[
    "0", "-0", "1", "-1", "1e-9", "1e9", "1e12", "-1e12", "1e13", "1e-300", "1e308", ".nan",
    ".inf", "65536", "100000", "0.1", "3.5", "1000000", "-7", "1e4",
];

/// Lengths that no file has: a billion, and more than there is memory.
const LENGTHS: [u64; 2] = [1_000_000_000, u64::MAX >> 8];

/// Makes a file with one to four things wrong behind its first `from` bytes.
pub fn mutant(good: &[u8], from: usize, seed: u64) -> Vec<u8> {
    let (head, tail) = good.split_at(from.min(good.len()));
    let mut random = Random::new(seed);
    let mut bytes = tail.to_vec();
    for _ in 0..1 + random.below(4) {
        damage(&mut bytes, &mut random);
    }
    [head, &bytes].concat()
}

fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    let at = random.below(bytes.len() + 1);
    let end = (at + 1 + random.below(40)).min(bytes.len());
    match random.below(10) {
        0 => flip(bytes, random),
        1 => drop(bytes.splice(at..end, [])),
        2 => {
            let piece = *random.of(PIECES);
            drop(bytes.splice(at..at, piece.iter().copied()));
        }
        3 => {
            let piece = *random.of(PIECES);
            drop(bytes.splice(at..end, piece.iter().copied()));
        }
        4 => {
            let again: Vec<u8> = bytes[at..end].repeat(1 + random.below(30));
            drop(bytes.splice(at..at, again));
        }
        5 | 6 => number(bytes, random),
        7 => lines(bytes, random),
        8 => overwrite(bytes, at, &random.of(&LENGTHS).to_le_bytes()),
        _ if random.below(4) == 0 => bytes.truncate(at),
        _ => {
            let word = random.bits().to_le_bytes();
            overwrite(bytes, at, &word[..1 << random.below(4)]);
        }
    }
}

fn overwrite(bytes: &mut [u8], at: usize, new: &[u8]) {
    for (byte, new) in bytes.iter_mut().skip(at).zip(new) {
        *byte = *new;
    }
}

fn flip(bytes: &mut [u8], random: &mut Random) {
    let at = random.below(bytes.len());
    let bit = random.below(8);
    if let Some(byte) = bytes.get_mut(at) {
        *byte ^= 1 << bit;
    }
}

/// Another number in place of one.
fn number(bytes: &mut Vec<u8>, random: &mut Random) {
    let is_number = |b: &u8| b.is_ascii_digit() || b".eE+-".contains(b);
    let from = random.below(bytes.len() + 1);
    let Some(start) = bytes.iter().skip(from).position(u8::is_ascii_digit) else {
        return;
    };
    let start = from + start;
    let length = bytes[start..].iter().take_while(|b| is_number(b)).count();
    let new = random.of(NUMBERS).bytes();
    drop(bytes.splice(start..start + length, new));
}

/// A line somewhere else, or twice.
fn lines(bytes: &mut Vec<u8>, random: &mut Random) {
    let mut lines: Vec<&[u8]> = bytes.split_inclusive(|b| *b == b'\n').collect();
    if lines.is_empty() {
        return;
    }
    let (from, to) = (random.below(lines.len()), random.below(lines.len()));
    match random.below(3) {
        0 => lines.insert(to, lines[from]),
        1 => lines.swap(from, to),
        _ => drop(lines.remove(from)),
    }
    *bytes = lines.concat();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mutant_differs_keeps_its_head_and_is_the_same_again() {
        let good = b"version: 1\nmass_kg: 2500\nname: sample\n".repeat(4);
        let differ = (0..200).filter(|&seed| {
            let bytes = mutant(&good, 11, seed);
            assert_eq!(bytes[..11], good[..11], "seed {seed}");
            assert_eq!(bytes, mutant(&good, 11, seed));
            bytes != good
        });
        assert!(differ.count() > 190);
        assert!(mutant(b"", 0, 3).len() < 10_000);
    }
}
