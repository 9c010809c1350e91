//! Doc comments inside the attribute: a comment before an argument documents what is generated for it.

use crate::source_map::SourceMap;
use proc_macro2::TokenStream;
use quote::quote;
use tfe_symbolic::syntax::parse;

/// The doc comments of the arguments, each line with the argument that it precedes or is inside.
#[derive(Default)]
pub(crate) struct Docs(Vec<Doc>);

#[derive(Clone)]
struct Doc {
    /// `output`, `let`
    word: String,
    /// The name that the argument declares, if it declares one; otherwise its text.
    name: String,
    /// The tokens to the right of `doc =`.
    text: TokenStream,
}

/// The arguments whose first word in parentheses, or after `let`, is a name.
const NAMED: &[&str] = &[
    "let",
    "force",
    "constraint",
    "output",
    "event",
    "solver",
    "model",
];

/// The arguments for which an item with documentation of its own is generated.
const DOCUMENTED: &[&str] = &["output", "solver", "model"];

impl Docs {
    pub(crate) fn of(map: &SourceMap) -> Self {
        let mut docs = Self::default();
        for range in parse::split_arguments(&map.text) {
            let (word, name) = head(&map.text[range.clone()]);
            // An output by another word.
            let word = if word == "event" {
                "output".to_owned()
            } else {
                word
            };
            for (at, text) in &map.docs {
                if range.contains(at) {
                    docs.0.push(Doc {
                        word: word.clone(),
                        name: name.clone(),
                        text: text.clone(),
                    });
                }
            }
        }
        docs
    }

    /// The comments of outputs: models made from this one inherit outputs.
    pub(crate) fn of_outputs(&self) -> Self {
        let outputs = self.0.iter().filter(|doc| doc.word == "output");
        Self(outputs.cloned().collect())
    }

    /// The doc attributes for the item that an argument generates, followed by an empty line; nothing if there is no
    /// comment.
    pub(crate) fn attributes(&self, word: &str, name: &str) -> TokenStream {
        let own = self.0.iter();
        let own: Vec<_> = own
            .filter(|doc| doc.word == word && doc.name == name)
            .map(|doc| &doc.text)
            .collect();
        if own.is_empty() {
            return TokenStream::new();
        }
        quote!(#(#[doc = #own])* #[doc = ""])
    }

    /// A list of the other comments for the documentation of the struct.
    pub(crate) fn others(&self) -> Vec<TokenStream> {
        let mut lines = Vec::new();
        let mut before = None;
        for doc in &self.0 {
            if DOCUMENTED.contains(&doc.word.as_str()) {
                continue;
            }
            let argument = (&doc.word, &doc.name);
            if before.is_none() {
                lines.push(quote!(""));
            }
            if before != Some(argument) {
                let line = match doc.word.as_str() {
                    "let" => format!(" * `let {}`:", doc.name),
                    word if doc.name.is_empty() => format!(" * `{word}`:"),
                    word => format!(" * `{word}({})`:", doc.name),
                };
                lines.push(quote!(#line));
            }
            before = Some(argument);
            lines.push(doc.text.clone());
        }
        lines
    }
}

/// `("output", "tip")` of `output (tip ) = …`
fn head(argument: &str) -> (String, String) {
    let is_word = |letter: char| letter.is_alphanumeric() || letter == '_';
    let argument = argument.trim_start();
    let end = argument.find(|letter| !is_word(letter));
    let (word, rest) = argument.split_at(end.unwrap_or(argument.len()));
    let rest = rest.trim_start();
    let declares = NAMED.contains(&word);
    let name = rest.trim_start_matches('(').trim_start();
    let end = name.find(|letter| !is_word(letter));
    let name = &name[..end.unwrap_or(name.len())];
    let name = if declares { name } else { "" };
    (word.to_owned(), name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_belong_to_the_argument_behind_them() {
        let source = "/// Where.\n coordinates(/// To the right.\n x), \
            /// The height,\n /// in (metres.\n output(height) = x, \
            /// Length 1.\n constraint(rod) = x^2 - 1, \
            /// Fast.\n solver(Fast, Mixed::<3>), \
            /// Twice.\n let a = 2*x";
        let map = SourceMap::new(source.parse().expect("tokens"));
        assert!(!map.text.contains("height,"), "{}", map.text);
        let docs = Docs::of(&map);
        let text = |tokens: TokenStream| tokens.to_string().replace(' ', "");
        let height = text(docs.attributes("output", "height"));
        assert_eq!(
            height,
            text(quote!(#[doc = " The height,"] #[doc = " in (metres."] #[doc = ""]))
        );
        assert!(docs.attributes("output", "rod").is_empty());
        assert!(!docs.attributes("solver", "Fast").is_empty());
        let others: Vec<String> = docs.others().iter().map(ToString::to_string).collect();
        let expected = [
            "\"\"",
            "\" * `coordinates`:\"",
            "\" Where.\"",
            "\" To the right.\"",
            "\" * `constraint(rod)`:\"",
            "\" Length 1.\"",
            "\" * `let a`:\"",
            "\" Twice.\"",
        ];
        assert_eq!(others, expected);
    }
}
