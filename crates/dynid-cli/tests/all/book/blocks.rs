//! Markdown pages: fenced blocks, links, headings.

use std::ops::Range;
use std::path::Path;

use pulldown_cmark::{CodeBlockKind, Event, Options, Parser, Tag, TagEnd};

/// A fenced block.
pub(super) struct Block {
    /// Line of the fence, from 1.
    pub(super) line: usize,
    /// Words behind the fence.
    pub(super) info: Vec<String>,
    /// Text between the fences.
    pub(super) text: String,
}

impl Block {
    /// Whether a word stands behind the fence.
    pub(super) fn has(&self, word: &str) -> bool {
        self.info.iter().any(|w| w == word)
    }

    /// The value of `key=value` behind the fence.
    pub(super) fn value(&self, key: &str) -> Option<&str> {
        self.info.iter().find_map(|w| w.strip_prefix(key)?.strip_prefix('='))
    }
}

/// A page, as far as tests look at it.
#[derive(Default)]
pub(super) struct Page {
    pub(super) blocks: Vec<Block>,
    /// Line and destination.
    pub(super) links: Vec<(usize, String)>,
    /// Names that a link may lead to, as mdBook and GitHub form them.
    pub(super) anchors: Vec<String>,
    /// Page whose folder this page goes on with.
    pub(super) goes_on_from: Option<String>,
}

impl Page {
    /// Reads a page; a file that it includes is part of it.
    pub(super) fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap();
        match text.split_once("{{#include ").and_then(|(_, rest)| rest.split_once("}}")) {
            Some((file, _)) => Self::read(&path.parent().unwrap().join(file)),
            None => Self::parse(&text),
        }
    }

    pub(super) fn parse(text: &str) -> Self {
        let mut page = Self { goes_on_from: goes_on_from(text), ..Self::default() };
        let line_of = |range: &Range<usize>| 1 + text[..range.start].matches('\n').count();
        let (mut fence, mut heading) = (None::<Block>, None::<String>);
        for (event, range) in Parser::new_ext(text, Options::ENABLE_TABLES).into_offset_iter() {
            match event {
                Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(info))) => {
                    let info = info.split([' ', ',']).map(str::to_owned).collect();
                    fence = Some(Block { line: line_of(&range), info, text: String::new() });
                }
                Event::End(TagEnd::CodeBlock) => page.blocks.extend(fence.take()),
                Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
                Event::End(TagEnd::Heading(_)) => page.add_anchor(&heading.take().unwrap_or_default()),
                Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                    page.links.push((line_of(&range), dest_url.to_string()));
                }
                Event::Text(t) | Event::Code(t) => {
                    if let Some(block) = &mut fence {
                        block.text.push_str(&t);
                    } else if let Some(heading) = &mut heading {
                        heading.push_str(&t);
                    }
                }
                _ => {}
            }
        }
        page
    }

    fn add_anchor(&mut self, heading: &str) {
        let kept = heading.trim().chars().filter_map(|c| match c {
            c if c.is_alphanumeric() || c == '_' || c == '-' => Some(c.to_lowercase().to_string()),
            c if c.is_whitespace() => Some("-".to_owned()),
            _ => None,
        });
        let name: String = kept.collect();
        let before = self.anchors.iter().filter(|a| **a == name).count();
        self.anchors.push(if before == 0 { name } else { format!("{name}-{before}") });
    }
}

fn goes_on_from(text: &str) -> Option<String> {
    let (_, rest) = text.split_once("<!-- goes on from ")?;
    Some(rest.split_once(" -->")?.0.to_owned())
}
