//! What roles look like: tones, palette, the style sheet.

/// The meaning of a colour. The same tone is the same colour in the lead sentence, in tables and in plots.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, PartialOrd, Ord)]
pub enum Tone {
    /// Nothing: the colour of the text.
    #[default]
    Neutral,
    /// As wished, for instance stable.
    Good,
    /// Between good and bad, for instance a limit cycle.
    Warning,
    /// The finding is negative, for instance unstable.
    Bad,
    /// Something else decided, for instance a limiter.
    Limited,
    /// Cannot be decided.
    Unsure,
}

impl Tone {
    /// The class in the style sheet.
    pub(crate) fn class(self) -> &'static str {
        match self {
            Tone::Neutral => "neutral",
            Tone::Good => "good",
            Tone::Warning => "warning",
            Tone::Bad => "bad",
            Tone::Limited => "limited",
            Tone::Unsure => "unsure",
        }
    }
}

/// How many colours the palette has; after them the first one follows again.
pub const PALETTE: usize = 7;

/// Colours. The palette is Okabe and Ito's (2008); in the dark scheme its dark members are lightened, and as text on white the tones are
/// darkened, both for contrast.
pub const COLOURS: &str = "\
:root{color-scheme:light dark;--paper:#fff;--ink:#1b1f24;--muted:#5c6670;--faint:#dde1e6;--fainter:#eef0f3;--soft:#f6f7f9;\
--c0:#0072b2;--c1:#d55e00;--c2:#009e73;--c3:#cc79a7;--c4:#e69f00;--c5:#56b4e9;--c6:#1b1f24;\
--good:#009e73;--warning:#e69f00;--bad:#d55e00;--limited:#cc79a7;--unsure:#8a939c;--neutral:#1b1f24;--neutral-text:#1b1f24;\
--good-text:#00694d;--warning-text:#8a5a00;--bad-text:#b03a00;--limited-text:#97416f;--unsure-text:#5c6670}\n\
@media (prefers-color-scheme:dark){:root{--paper:#14181d;--ink:#e4e7ea;--muted:#a0a9b2;--faint:#343b43;--fainter:#242a31;--soft:#1b2027;\
--c0:#4aa8e8;--c1:#f07e2e;--c2:#22c196;--c3:#dd94bb;--c4:#f0b429;--c5:#8fd0f5;--c6:#e4e7ea;\
--good:#22c196;--warning:#f0b429;--bad:#f07e2e;--limited:#dd94bb;--unsure:#8a939c;--neutral:#e4e7ea;--neutral-text:#e4e7ea;\
--good-text:#4fd6b0;--warning-text:#f3c454;--bad-text:#ff9d5c;--limited-text:#eab3d0;--unsure-text:#a0a9b2}}\n\
@media print{:root{color-scheme:light;--paper:#fff;--ink:#000;--muted:#444;--faint:#ccc;--fainter:#e6e6e6;--soft:#f6f6f6;\
--c0:#0072b2;--c1:#d55e00;--c2:#009e73;--c3:#cc79a7;--c4:#e69f00;--c5:#56b4e9;--c6:#000;\
--good:#009e73;--warning:#e69f00;--bad:#d55e00;--limited:#cc79a7;--unsure:#8a939c;--neutral:#000;--neutral-text:#000;\
--good-text:#00694d;--warning-text:#8a5a00;--bad-text:#b03a00;--limited-text:#97416f;--unsure-text:#444}}\n";

/// The figures: what stands around the drawings, and what the script in the page adds (legend, hovered values, the zoomed box).
/// In print the drawings are scaled to the paper.
pub const FIGURE_STYLE: &str = "\
.cells{display:flex;flex-wrap:wrap;gap:20px 24px}.cells>.stack{flex:1 1 380px;min-width:0}.square{max-width:640px;margin:0 auto}\
.title{font-weight:600;font-size:.95rem;margin:0 0 2px;max-width:none}.remark{color:var(--muted);font-size:.85rem;font-style:italic;margin:2px 0}\n\
.chart{position:relative;width:100%;overflow:hidden}.chart svg{display:block}\
.legend{font-size:.82rem;line-height:1.5;margin-bottom:2px}.legend>div{display:flex;flex-wrap:wrap;gap:0 14px;align-items:center}\
.legend>div>span:first-child:not(.span){color:var(--muted)}\
.legend svg{vertical-align:-1px;margin-right:5px}.legend button{font:inherit;color:inherit;background:none;border:0;padding:1px 0;cursor:pointer;text-align:left}\
.legend button[aria-pressed=false]{opacity:.4;text-decoration:line-through}.legend button:hover{text-decoration:underline}\n\
.row{display:flex;gap:6px;align-items:center;line-height:1.45}.row b{margin-left:auto;padding-left:12px;font-variant-numeric:tabular-nums}.row svg{flex:none}.of{color:var(--muted)}\
.tip{position:absolute;display:none;z-index:9;pointer-events:none;background:var(--paper);border:1px solid var(--faint);border-radius:4px;padding:4px 8px;font-size:12px;line-height:1.45;max-width:20rem}\
.ring{position:absolute;display:none;width:11px;height:11px;margin:-6px 0 0 -6px;border:2px solid var(--ink);border-radius:50%;pointer-events:none}\
.box{position:absolute;display:none;background:var(--c0);opacity:.15;pointer-events:none}\
.back{position:absolute;top:2px;right:18px;font:inherit;font-size:.8rem;color:var(--ink);background:var(--soft);border:1px solid var(--faint);border-radius:4px;cursor:pointer}\n\
.neutral{--c:var(--neutral);--ct:var(--ink)}.good{--c:var(--good);--ct:var(--good-text)}.warning{--c:var(--warning);--ct:var(--warning-text)}\
.bad{--c:var(--bad);--ct:var(--bad-text)}.limited{--c:var(--limited);--ct:var(--limited-text)}.unsure{--c:var(--unsure);--ct:var(--unsure-text)}\n\
@media print{.stack{break-inside:avoid}.cells>.stack{flex:1 1 44%}.cells{gap:12px}.chart,.chart>div,.chart svg{position:static!important;width:100%!important;height:auto!important}.box,.back,.tip,.ring,.copy{display:none!important}}\n";

/// The page around them.
pub const PAGE_STYLE: &str = "\
*{box-sizing:border-box}body{margin:0;background:var(--paper);color:var(--ink);font:16px/1.5 system-ui,-apple-system,'Segoe UI',Roboto,\
'Helvetica Neue',Arial,'Liberation Sans',sans-serif}\n\
main{max-width:1000px;margin:0 auto;padding:24px 16px 48px}h1{font-size:1.5rem;line-height:1.25;margin:0 0 12px}\
h2{font-size:1.2rem;margin:36px 0 8px;padding-top:12px;border-top:1px solid var(--faint)}p{margin:8px 0;max-width:75ch}\
a{color:var(--c0)}h1,h2,p,td,th,summary,figcaption{overflow-wrap:break-word}\n\
.lead{font-size:1.3rem;line-height:1.35;font-weight:600;max-width:none;margin:12px 0 16px;padding:12px 16px;border-left:6px solid var(--c);\
background:var(--soft);color:var(--ct)}\n\
.aside{max-width:none;padding:8px 14px;border-left:4px solid var(--c);background:var(--soft)}.aside b{color:var(--ct)}\n\
.scroll{overflow-x:auto;margin:12px 0}table{border-collapse:collapse;font-size:.92rem;font-variant-numeric:tabular-nums}\
.caption{color:var(--muted);font-size:.92rem;margin-top:-4px}\
th,td{padding:4px 14px 4px 0;text-align:left;vertical-align:top;border-bottom:1px solid var(--fainter)}\
thead th,thead th.num{white-space:normal}thead th{min-width:4.5rem;border-bottom:1px solid var(--muted);vertical-align:bottom;font-weight:600}tbody th{font-weight:400}\
.some{min-width:8rem}.long{min-width:12rem}.num{text-align:right;white-space:nowrap}.mid{text-align:center}td.tone{color:var(--ct);font-weight:600}\n\
figure{margin:20px 0;position:relative}figcaption{color:var(--muted);font-size:.92rem;max-width:85ch;margin-top:4px}\
.todo li{margin:6px 0}.todo pre{position:relative;margin:4px 0;padding:8px 60px 8px 12px;background:var(--paper);border:1px solid var(--faint);border-radius:4px;\
font-size:.88rem;white-space:pre-wrap;overflow-wrap:anywhere}.todo code span{white-space:nowrap}.copy{position:absolute;top:4px;right:4px;font:inherit;font-size:.78rem;color:var(--ink);background:var(--soft);\
border:1px solid var(--faint);border-radius:4px;cursor:pointer}\n\
details{margin:12px 0;border:1px solid var(--faint);border-radius:6px;padding:0 14px}summary{cursor:pointer;padding:8px 0;font-weight:600}\n\
@media (max-width:720px){.long{min-width:15rem}body{font-size:15px}.lead{font-size:1.12rem}}\n\
@media screen and (max-width:600px){.cards,.cards tbody,.cards tr,.cards td{display:block;min-width:0;text-align:left;white-space:normal}.cards thead{display:none}\
.cards tr{border-bottom:1px solid var(--muted);padding:6px 0}.cards td{border:0;padding:1px 0}.cards td:empty{display:none}\
.cards td[data-label]::before{content:attr(data-label) \": \";color:var(--muted);font-weight:400}.todo ul{padding-left:1.2em}}\n\
@media print{body{font-size:10.5pt}main{max-width:none;padding:0}figure,.lead,.aside,tr{break-inside:avoid}h2{break-after:avoid}\
.scroll{overflow:visible}table{font-size:8.5pt}th,td{padding-right:8px}.num{white-space:normal}}\n";
