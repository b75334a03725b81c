//! Text into HTML and SVG.

/// The text with what HTML and XML give a meaning replaced, fit for content and for attributes in double quotes. Characters that no
/// XML document may hold become U+FFFD, so that a stray byte in a topic's name cannot spoil the file.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\t' | '\n' | '\r' => out.push(c),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_becomes_text() {
        assert_eq!(escape("<b a=\"1\" c='2'>&amp;"), "&lt;b a=&quot;1&quot; c=&#39;2&#39;&gt;&amp;amp;");
        assert_eq!(escape("a\u{0}b\u{1b}[0m\u{ffff}\n"), "a\u{fffd}b\u{fffd}[0m\u{fffd}\n");
        assert_eq!(escape("μλ, 12 °, 力"), "μλ, 12 °, 力");
    }
}
