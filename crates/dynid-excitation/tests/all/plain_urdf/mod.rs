//! UR10 of the reference data.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid_model::*;
use dynid_testing::shared;

/// UR10 from its URDF, or nothing (and a notice) without the reference data.
pub(crate) fn ur10() -> Option<Mechanism> {
    let text = std::fs::read_to_string(shared("data/oracles/ur10.urdf")?).unwrap();
    Some(plain_urdf(&text).build().unwrap())
}

/// Links and joints of a URDF without comments, namespaces or nesting: this crate does not know the file reader.
fn plain_urdf(text: &str) -> Description {
    fn attribute<'a>(tag: &'a str, name: &str) -> &'a str {
        let (_, rest) = tag.split_once(&format!(" {name}=\"")).unwrap();
        rest.split('"').next().unwrap()
    }
    fn tag<'a>(element: &'a str, name: &str) -> Option<&'a str> {
        element.split('<').find(|t| t.starts_with(&format!("{name} ")))
    }
    fn three(tag: &str, name: &str) -> [f64; 3] {
        let numbers: Vec<f64> = attribute(tag, name).split_whitespace().map(|x| x.parse().unwrap()).collect();
        numbers.try_into().unwrap()
    }
    fn elements<'a>(text: &'a str, name: &str) -> Vec<&'a str> {
        let open = format!("<{name} ");
        let parts = text.split(open.as_str()).skip(1);
        // An element without content ends its own tag.
        parts
            .map(|part| {
                let own = part.split('>').next().unwrap();
                if own.ends_with('/') { own } else { part.split(&format!("</{name}>")).next().unwrap() }
            })
            .collect()
    }
    fn placement(element: &str) -> Placement {
        let origin = tag(element, "origin").unwrap();
        Placement::from_xyz_rpy(three(origin, "xyz"), three(origin, "rpy"))
    }
    let mut d = Description::new("ur10");
    for link in elements(text, "link") {
        let name = attribute(&format!(" {link}"), "name").to_owned();
        let inertia = link.contains("<inertial").then(|| {
            let number = |of: &str, name: &str| attribute(tag(link, of).unwrap(), name).parse().unwrap();
            let [xx, xy, xz, yy, yz, zz] =
                ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"].map(|k| number("inertia", k));
            let tensor = Mat3::from_rows([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]);
            Inertia::from_com(number("mass", "value"), Vec3::zero(), &tensor).in_frame(&placement(link))
        });
        d.links.push(LinkDescription { name, inertia });
    }
    for joint in elements(text, "joint") {
        let own = format!(" {}", joint.split('>').next().unwrap());
        let fixed = attribute(&own, "type") == "fixed";
        d.joints.push(JointDescription {
            name: attribute(&own, "name").into(),
            parent: attribute(tag(joint, "parent").unwrap(), "link").into(),
            child: attribute(tag(joint, "child").unwrap(), "link").into(),
            kind: if fixed { JointKind::Fixed } else { JointKind::Revolute },
            placement: placement(joint),
            axis: tag(joint, "axis").map_or([0.0, 0.0, 1.0], |t| three(t, "xyz")),
            limits: tag(joint, "limit").map_or(Limits::default(), |t| {
                let number = |name: &str| attribute(t, name).parse::<f64>().unwrap();
                Limits {
                    position: Some((number("lower"), number("upper"))),
                    velocity: Some(number("velocity")),
                    effort: Some(number("effort")),
                }
            }),
            mimic: None,
        });
    }
    d
}
