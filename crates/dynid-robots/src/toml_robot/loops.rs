//! What closes the loops of a robot file.

use dynid_files::excerpt::excerpt;
use dynid_model::closed::{ClosureDescription, Condition, CutKind, LinkFrame};
use dynid_model::{Description, JointKind, Placement};
use toml::Spanned;

use super::Source;
use super::number::{Angle, Number};
use super::schema::{LoopKind, LoopToml};
use crate::robot_error::RobotFileError;

pub(super) fn build(
    source: &Source<'_>,
    loops: &[Spanned<LoopToml>],
    description: &Description,
) -> Result<Vec<ClosureDescription>, RobotFileError> {
    source.unique("loop", loops.iter().map(|l| (l.span().start, l.get_ref().name.as_str())))?;
    let closure = |stated: &Spanned<LoopToml>| {
        let (offset, stated) = (stated.span().start, stated.get_ref());
        let owner = format!("loop `{}`", excerpt(&stated.name));
        let keys = Keys { source, offset, owner: &owner, stated, description };
        let condition = match stated.kind {
            LoopKind::Coordinate => keys.coordinates(),
            LoopKind::Spherical => keys.joint(CutKind::Spherical),
            LoopKind::PlanarRevolute => keys.joint(CutKind::PlanarRevolute),
            LoopKind::Revolute => keys.joint(CutKind::Revolute),
            LoopKind::Universal => keys.joint(CutKind::Universal),
            LoopKind::Cylindrical => keys.joint(CutKind::Cylindrical),
            LoopKind::Prismatic => keys.joint(CutKind::Prismatic),
            LoopKind::PlanarPrismatic => keys.joint(CutKind::PlanarPrismatic),
            LoopKind::Fixed => keys.joint(CutKind::Fixed),
            LoopKind::Distance => keys.length().and_then(|length| keys.joint(CutKind::Distance { length })),
        }?;
        Ok(ClosureDescription { name: stated.name.clone(), condition })
    };
    loops.iter().map(closure).collect()
}

/// One entry of the loop table.
struct Keys<'a> {
    source: &'a Source<'a>,
    offset: usize,
    owner: &'a str,
    stated: &'a LoopToml,
    description: &'a Description,
}

impl Keys<'_> {
    fn missing(&self, expected: &str) -> RobotFileError {
        let at = self.source.place(self.offset);
        RobotFileError::Missing { at, owner: self.owner.to_owned(), expected: expected.to_owned() }
    }

    /// That none of some keys stands here; `expected` says where they belong.
    fn none_of(&self, keys: &[(&str, Option<usize>)], expected: &str) -> Result<(), RobotFileError> {
        match keys.iter().find_map(|(key, offset)| offset.map(|o| (key, o))) {
            Some((key, offset)) => Err(self.source.value(offset, self.owner, key, expected, key)),
            None => Ok(()),
        }
    }

    fn length(&self) -> Result<f64, RobotFileError> {
        let stated = self.stated.length.as_ref().ok_or_else(|| self.missing("`length` in m"))?;
        let Number(length) = *stated.get_ref();
        if length > 0.0 {
            return Ok(length);
        }
        let found = length.to_string();
        Err(self.source.value(stated.span().start, self.owner, "length", "a positive number", &found))
    }

    fn joint(&self, kind: CutKind) -> Result<Condition, RobotFileError> {
        let s = self.stated;
        if !matches!(kind, CutKind::Distance { .. }) {
            self.none_of(&[("length", start(&s.length))], "this key only with the kind `distance`")?;
        }
        let coordinates = [("terms", start(&s.terms)), ("constant", start(&s.constant))];
        self.none_of(&coordinates, "this key only with the kind `coordinate`")?;
        let a = self.frame("a", &s.a, &s.a_xyz, &s.a_rpy)?;
        let b = self.frame("b", &s.b, &s.b_xyz, &s.b_rpy)?;
        if a.link == b.link {
            let expected = "another link than that of `a`";
            return Err(self.source.value(
                start(&s.b).unwrap_or(self.offset),
                self.owner,
                "b",
                expected,
                &b.link,
            ));
        }
        Ok(Condition::Joint { kind, a, b })
    }

    fn frame(
        &self,
        key: &str,
        link: &Option<Spanned<String>>,
        xyz: &Option<Spanned<[Number; 3]>>,
        rpy: &Option<Spanned<[Angle; 3]>>,
    ) -> Result<LinkFrame, RobotFileError> {
        let link = link.as_ref().ok_or_else(|| self.missing(&format!("`{key}`, the name of a link")))?;
        let known: Vec<&str> = self.description.links.iter().map(|l| l.name.as_str()).collect();
        let context = format!("{}: {key}", self.owner);
        self.source.known(link.span().start, &context, "link", link.get_ref(), &known)?;
        let xyz = xyz.as_ref().map_or([0.0; 3], |v| v.get_ref().map(|x| x.0));
        let rpy = rpy.as_ref().map_or([0.0; 3], |v| v.get_ref().map(|x| x.0));
        Ok(LinkFrame { link: link.get_ref().clone(), placement: Placement::from_xyz_rpy(xyz, rpy) })
    }

    fn coordinates(&self) -> Result<Condition, RobotFileError> {
        let s = self.stated;
        let frames = [
            ("a", start(&s.a)),
            ("b", start(&s.b)),
            ("a_xyz", start(&s.a_xyz)),
            ("a_rpy", start(&s.a_rpy)),
            ("b_xyz", start(&s.b_xyz)),
            ("b_rpy", start(&s.b_rpy)),
        ];
        self.none_of(&frames, "this key only with a kind that joins two links")?;
        self.none_of(&[("length", start(&s.length))], "this key only with the kind `distance`")?;
        let terms = s.terms.as_ref().ok_or_else(|| self.missing("`terms`, factors of joints"))?;
        let (offset, terms) = (terms.span().start, terms.get_ref());
        if terms.is_empty() {
            return Err(self.source.value(offset, self.owner, "terms", "at least one joint", "none"));
        }
        let mut ordered: Vec<_> = terms.iter().collect();
        ordered.sort_by_key(|(name, _)| name.span().start);
        let term = |(name, factor): (&Spanned<String>, &Number)| {
            self.one_coordinate(name)?;
            let field = format!("terms.{}", name.get_ref());
            match factor.0 {
                0.0 => {
                    let expected = "a factor other than 0";
                    Err(self.source.value(name.span().start, self.owner, &field, expected, "0"))
                }
                factor => Ok((name.get_ref().clone(), factor)),
            }
        };
        let terms = ordered.into_iter().map(term).collect::<Result<_, _>>()?;
        Ok(Condition::Coordinates { terms, constant: s.constant.as_ref().map_or(0.0, |c| c.get_ref().0) })
    }

    fn one_coordinate(&self, name: &Spanned<String>) -> Result<(), RobotFileError> {
        let (offset, name) = (name.span().start, name.get_ref());
        let known: Vec<&str> = self.description.joints.iter().map(|j| j.name.as_str()).collect();
        self.source.known(offset, &format!("{}: terms", self.owner), "joint", name, &known)?;
        let kind = self.description.joints.iter().find(|j| j.name == *name).map(|j| j.kind);
        let found = match kind {
            Some(JointKind::Floating) => "a floating joint",
            Some(JointKind::Fixed) => "a fixed joint",
            _ => return Ok(()),
        };
        let field = format!("terms.{name}");
        Err(self.source.value(offset, self.owner, &field, "a joint with one coordinate", found))
    }
}

fn start<T>(value: &Option<Spanned<T>>) -> Option<usize> {
    value.as_ref().map(|v| v.span().start)
}
