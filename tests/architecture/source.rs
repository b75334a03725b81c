//! A file of Rust as the compiler parses it: what it declares, imports and names, without what is for tests only.

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};
use syn::{Attribute, Item, UseTree};

/// What a file holds outside of its tests.
#[derive(Default)]
pub struct Source {
    /// Modules that it declares in files of their own.
    pub modules: Vec<String>,
    /// Modules that it declares for tests only.
    pub test_modules: Vec<String>,
    /// Names of its types, functions, constants and macros.
    pub items: Vec<String>,
    /// What it imports.
    pub uses: Vec<Import>,
    /// Paths of at least two names outside of `use`, such as `["cli", "Run"]`.
    pub paths: Vec<Vec<String>>,
    /// Whether its macro `register!` declares modules.
    declares: bool,
}

/// One name of a `use`.
pub struct Import {
    /// Its path, such as `["super", "graph", "Graph"]`; of a glob the last is `*`.
    pub path: Vec<String>,
    /// What it is called here.
    pub name: String,
}

impl Source {
    /// Reads a file's text.
    ///
    /// # Errors
    /// Text that is no Rust, with its line.
    pub fn read(text: &str) -> Result<Source, String> {
        let file = syn::parse_file(text).map_err(|e| format!("line {}: {e}", e.span().start().line))?;
        let mut source = Source::default();
        source.visit_file(&file);
        Ok(source)
    }

    fn import(&mut self, tree: &UseTree, before: &[String]) {
        let with = |name: &syn::Ident| before.iter().cloned().chain([name.to_string()]).collect::<Vec<_>>();
        let (path, name) = match tree {
            UseTree::Path(path) => return self.import(&path.tree, &with(&path.ident)),
            UseTree::Group(group) => return group.items.iter().for_each(|tree| self.import(tree, before)),
            // `a::{self}` is `a`.
            UseTree::Name(name) if name.ident == "self" => (before.to_vec(), before.last().cloned().unwrap_or_default()),
            UseTree::Name(name) => (with(&name.ident), name.ident.to_string()),
            UseTree::Rename(name) => (with(&name.ident), name.rename.to_string()),
            UseTree::Glob(_) => (before.iter().cloned().chain(["*".to_string()]).collect(), "*".to_string()),
        };
        self.uses.push(Import { path, name });
    }

    /// The paths among the tokens of a macro, which are no Rust yet.
    fn tokens(&mut self, tokens: TokenStream) {
        let mut path: Vec<String> = Vec::new();
        let mut colons = 0;
        for token in tokens.into_iter().map(Some).chain([None]) {
            match &token {
                Some(TokenTree::Punct(sign)) if sign.as_char() == ':' && !path.is_empty() => {
                    colons += 1;
                    continue;
                }
                Some(TokenTree::Ident(name)) if colons == 2 => {
                    path.push(name.to_string());
                    colons = 0;
                    continue;
                }
                _ => {}
            }
            let done = std::mem::take(&mut path);
            self.paths.extend((done.len() > 1).then_some(done));
            colons = 0;
            match token {
                Some(TokenTree::Ident(name)) => path.push(name.to_string()),
                Some(TokenTree::Group(group)) => self.tokens(group.stream()),
                _ => {}
            }
        }
    }

    /// Modules that a call of `register!` declares (`mod $name;`): in each entry the name before `::`, or else the only one.
    fn registered(&mut self, call: &TokenStream) {
        let entries: Vec<TokenTree> = call.clone().into_iter().collect();
        let is_comma = |token: &TokenTree| matches!(token, TokenTree::Punct(sign) if sign.as_char() == ',');
        let name = |entry: &[TokenTree]| {
            let colon = entry.iter().position(|token| matches!(token, TokenTree::Punct(sign) if sign.as_char() == ':'));
            entry[..colon.unwrap_or(entry.len())].last().map(TokenTree::to_string)
        };
        self.modules.extend(entries.split(is_comma).filter_map(name));
    }
}

impl<'a> Visit<'a> for Source {
    fn visit_item(&mut self, item: &'a Item) {
        let (attributes, name): (&[Attribute], Option<&syn::Ident>) = match item {
            Item::Const(it) => (&it.attrs, Some(&it.ident)),
            Item::Enum(it) => (&it.attrs, Some(&it.ident)),
            Item::Fn(it) => (&it.attrs, Some(&it.sig.ident)),
            Item::Impl(it) => (&it.attrs, None),
            Item::Macro(it) => (&it.attrs, it.ident.as_ref()),
            Item::Mod(it) => (&it.attrs, None),
            Item::Static(it) => (&it.attrs, Some(&it.ident)),
            Item::Struct(it) => (&it.attrs, Some(&it.ident)),
            Item::Trait(it) => (&it.attrs, Some(&it.ident)),
            Item::Type(it) => (&it.attrs, Some(&it.ident)),
            Item::Union(it) => (&it.attrs, Some(&it.ident)),
            Item::Use(it) => (&it.attrs, None),
            _ => (&[], None),
        };
        let is_test = attributes.iter().any(|a| a.path().is_ident("cfg") && a.parse_args::<syn::Path>().is_ok_and(|p| p.is_ident("test")));
        match item {
            Item::Mod(module) if module.content.is_none() && is_test => self.test_modules.push(module.ident.to_string()),
            Item::Mod(module) if module.content.is_none() => self.modules.push(module.ident.to_string()),
            _ if is_test => {}
            _ => {
                self.items.extend(name.map(syn::Ident::to_string));
                visit::visit_item(self, item);
            }
        }
    }

    fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
        self.import(&item.tree, &[]);
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        let names: Vec<String> = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        self.paths.extend((names.len() > 1 && path.leading_colon.is_none()).then_some(names));
        visit::visit_path(self, path);
    }

    fn visit_meta_list(&mut self, list: &'a syn::MetaList) {
        self.tokens(list.tokens.clone());
    }

    fn visit_macro(&mut self, call: &'a syn::Macro) {
        if call.path.is_ident("register") && self.declares {
            self.registered(&call.tokens);
        }
        self.declares |= call.path.is_ident("macro_rules") && call.tokens.to_string().contains("mod $");
        self.tokens(call.tokens.clone());
        self.visit_path(&call.path);
    }
}
