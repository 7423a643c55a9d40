//! Checks that the links of a URDF file form one tree.

use super::file::File;
use crate::error::Error;
use std::collections::BTreeMap;
use urdf_rs::Robot;

/// A link and the joint above it (none for the root), as indices.
pub(super) type Branch = (usize, Option<usize>);

/// Links in an order with parents before children, if they form one tree.
pub(super) fn tree(file: &File<'_>, robot: &Robot) -> Result<Vec<Branch>, Error> {
    let mut index = BTreeMap::new();
    for (i, link) in robot.links.iter().enumerate() {
        if index.insert(link.name.as_str(), i).is_some() {
            return Err(file.fault(
                "link",
                &link.name,
                "two links have this name",
                "give each link its own name",
            ));
        }
    }
    let mut above: Vec<Option<usize>> = vec![None; robot.links.len()];
    let mut below: Vec<Vec<Branch>> = vec![Vec::new(); robot.links.len()];
    let mut joint_names = BTreeMap::new();
    for (j, joint) in robot.joints.iter().enumerate() {
        if joint_names.insert(joint.name.as_str(), j).is_some() {
            return Err(file.fault(
                "joint",
                &joint.name,
                "two joints have this name",
                "give each joint its own name",
            ));
        }
        let find = |name: &str| {
            index.get(name).copied().ok_or_else(|| {
                file.fault(
                    "joint",
                    &joint.name,
                    format!("the file has no link `{name}`"),
                    "parent and child must name links of this file",
                )
            })
        };
        let (parent, child) = (find(&joint.parent.link)?, find(&joint.child.link)?);
        if let Some(first) = above[child].replace(j) {
            let message = format!(
                "link `{}` is already the child of joint `{}`",
                joint.child.link, robot.joints[first].name
            );
            return Err(file.fault(
                "joint",
                &joint.name,
                message,
                "links form a tree: every link has one parent",
            ));
        }
        below[parent].push((child, Some(j)));
    }
    let roots: Vec<usize> = (0..above.len()).filter(|i| above[*i].is_none()).collect();
    let help = "links form a tree: exactly one link has no parent";
    let root = match roots.as_slice() {
        [] if robot.links.is_empty() => {
            return Err(file.fault("", "", "the file has no link", help));
        }
        [] => {
            return Err(file.fault(
                "",
                "",
                "the links form a cycle: each link is the child of a joint",
                help,
            ));
        }
        [root] => *root,
        several => {
            let names: Vec<&str> = several
                .iter()
                .map(|i| robot.links[*i].name.as_str())
                .collect();
            return Err(file.fault("", "", format!("several roots: {}", names.join(", ")), help));
        }
    };
    let mut order = vec![(root, None)];
    let mut next = 0;
    while let Some((link, _)) = order.get(next) {
        order.extend(&below[*link]);
        next += 1;
    }
    if let Some(i) = (0..above.len()).find(|i| order.iter().all(|(link, _)| link != i)) {
        return Err(file.fault(
            "link",
            &robot.links[i].name,
            "the links form a cycle that does not reach the root",
            help,
        ));
    }
    Ok(order)
}
