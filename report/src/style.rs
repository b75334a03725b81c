//! What roles look like: tones, palette, the style sheet.

/// What a colour says. The same tone is the same colour in the lead sentence, in tables and in plots.
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
    /// Cannot be told.
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

/// How many colours the palette has; beyond them it begins anew.
pub const PALETTE: usize = 7;

/// Colours. The palette is Okabe and Ito's (2008); in the dark scheme its dark members are lightened, and as text on white the tones are
/// darkened, both for contrast.
pub const COLOURS: &str = "\
:root{color-scheme:light dark;--paper:#fff;--ink:#1b1f24;--muted:#5c6670;--faint:#dde1e6;--fainter:#eef0f3;--soft:#f6f7f9;\
--c0:#0072b2;--c1:#d55e00;--c2:#009e73;--c3:#cc79a7;--c4:#e69f00;--c5:#56b4e9;--c6:#1b1f24;\
--good:#009e73;--warning:#e69f00;--bad:#d55e00;--limited:#cc79a7;--unsure:#8a939c;--neutral:#1b1f24;\
--good-text:#00694d;--warning-text:#8a5a00;--bad-text:#b03a00;--limited-text:#97416f;--unsure-text:#5c6670}\n\
@media (prefers-color-scheme:dark){:root{--paper:#14181d;--ink:#e4e7ea;--muted:#a0a9b2;--faint:#343b43;--fainter:#242a31;--soft:#1b2027;\
--c0:#4aa8e8;--c1:#f07e2e;--c2:#22c196;--c3:#dd94bb;--c4:#f0b429;--c5:#8fd0f5;--c6:#e4e7ea;\
--good:#22c196;--warning:#f0b429;--bad:#f07e2e;--limited:#dd94bb;--unsure:#8a939c;--neutral:#e4e7ea;\
--good-text:#4fd6b0;--warning-text:#f3c454;--bad-text:#ff9d5c;--limited-text:#eab3d0;--unsure-text:#a0a9b2}}\n\
@media print{:root{color-scheme:light;--paper:#fff;--ink:#000;--muted:#444;--faint:#ccc;--fainter:#e6e6e6;--soft:#f6f6f6;\
--c0:#0072b2;--c1:#d55e00;--c2:#009e73;--c3:#cc79a7;--c4:#e69f00;--c5:#56b4e9;--c6:#000;\
--good:#009e73;--warning:#e69f00;--bad:#d55e00;--limited:#cc79a7;--unsure:#8a939c;--neutral:#000;\
--good-text:#00694d;--warning-text:#8a5a00;--bad-text:#b03a00;--limited-text:#97416f;--unsure-text:#444}}\n";

/// The plots. `paint-order` gives labels a rim of paper, so that they are read even on top of data.
pub const PLOT_STYLE: &str = "\
.plot{display:block;font-family:system-ui,-apple-system,'Segoe UI',Roboto,'Helvetica Neue',Arial,'Liberation Sans',sans-serif;font-size:12px;\
fill:var(--ink);font-variant-numeric:tabular-nums}\n\
.plot .t{font-size:14px;font-weight:600}.plot .a,.plot .w{fill:var(--muted)}.plot .w{font-style:italic;font-size:11px}.plot .k{fill:var(--muted)}\n\
.plot .m{stroke:var(--faint);stroke-width:1;shape-rendering:crispEdges}.plot .n{stroke:var(--fainter);stroke-width:1;shape-rendering:crispEdges}\n\
.plot .z{stroke:var(--muted);stroke-width:1;opacity:.7;shape-rendering:crispEdges}\
.plot .f{fill:none;stroke:var(--muted);stroke-width:1;shape-rendering:crispEdges}\n\
.plot .l{fill:none;stroke-linejoin:round;stroke-linecap:round;stroke:var(--c)}.plot .p{stroke:none;fill:var(--c)}\
.plot .b{stroke:none;fill:var(--c);fill-opacity:.22}.plot .be{fill:none;stroke:var(--c);stroke-width:.7;stroke-opacity:.6}.plot .d{opacity:.22}.plot .d *{fill:var(--c)}\
.plot .q{fill:var(--c);fill-opacity:.75}\n\
.plot .r{fill:var(--c);fill-opacity:.16}.plot .h{stroke:var(--c);stroke-opacity:.32;stroke-width:1;fill:none}\
.plot .v{stroke:var(--c);stroke-width:1.4;stroke-dasharray:6 3;fill:none}.plot .o{fill:none;stroke:var(--c);stroke-width:1.6}\
.plot .u{stroke:var(--muted);stroke-width:.8;fill:none}\n\
.plot .i{paint-order:stroke;stroke:var(--paper);stroke-width:3px;stroke-linejoin:round;stroke-opacity:.85}\n\
.plot .x{stroke:var(--muted);stroke-width:1;stroke-dasharray:2 2;pointer-events:none}\n\
.c0{--c:var(--c0)}.c1{--c:var(--c1)}.c2{--c:var(--c2)}.c3{--c:var(--c3)}.c4{--c:var(--c4)}.c5{--c:var(--c5)}.c6{--c:var(--c6)}\
.ink{--c:var(--ink)}.muted{--c:var(--muted)}\n\
.neutral{--c:var(--neutral);--ct:var(--ink)}.good{--c:var(--good);--ct:var(--good-text)}.warning{--c:var(--warning);--ct:var(--warning-text)}\
.bad{--c:var(--bad);--ct:var(--bad-text)}.limited{--c:var(--limited);--ct:var(--limited-text)}.unsure{--c:var(--unsure);--ct:var(--unsure-text)}\n\
.plot text.tone{fill:var(--ct)}\n";

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
thead th{border-bottom:1px solid var(--muted);vertical-align:bottom;font-weight:600}tbody th{font-weight:400}\
.some{min-width:8rem}.long{min-width:17rem}.num{text-align:right;white-space:nowrap}.mid{text-align:center}td.tone{color:var(--ct);font-weight:600;white-space:nowrap}\n\
figure{margin:20px 0;position:relative}figcaption{color:var(--muted);font-size:.92rem;max-width:85ch;margin-top:4px}\
.plots{display:flex;flex-wrap:wrap;gap:16px 24px;justify-content:center}.plots>div{flex:1 1 340px;min-width:0}\
.plot{width:100%;height:auto;margin:0 auto}.small{display:none}.readout{position:absolute;top:0;right:0;padding:0 6px;font-size:.8rem;color:var(--muted);background:var(--paper);pointer-events:none}\n\
details{margin:12px 0;border:1px solid var(--faint);border-radius:6px;padding:0 14px}summary{cursor:pointer;padding:8px 0;font-weight:600}\n\
@media (max-width:720px){.large{display:none}.small{display:block}body{font-size:15px}.lead{font-size:1.12rem}}\n\
@media print{body{font-size:10.5pt}main{max-width:none;padding:0}figure,.lead,.aside,tr{break-inside:avoid}h2{break-after:avoid}\
.large{display:block}.small{display:none}.scroll{overflow:visible}.readout{display:none}}\n";

/// Reads out the place under the pointer. The report is whole without it. Written without `<` and `&`, so that the page is XML too.
pub const SCRIPT: &str = "\
document.querySelectorAll('svg.plot').forEach(function(svg){\n\
var out=svg.closest('figure').querySelector('.readout'),cross=null;\n\
function value(lo,hi,log,t){return log?lo*Math.pow(hi/lo,t):lo+t*(hi-lo)}\n\
function clear(){if(cross){cross.remove();cross=null}out.textContent=''}\n\
svg.addEventListener('pointerleave',clear);\n\
svg.addEventListener('pointermove',function(e){clear();\n\
var at=new DOMPoint(e.clientX,e.clientY).matrixTransform(svg.getScreenCTM().inverse());\n\
svg.querySelectorAll('[data-axes]').forEach(function(g){\n\
var a=g.dataset.axes.split(' ').map(Number),u=(at.x-a[0])/a[2],v=1-(at.y-a[1])/a[3];\n\
if([u,v,1-u,1-v].every(function(s){return s>=0})){\n\
var n=g.dataset.names.split('|');\n\
out.textContent=n[0]+' '+value(a[4],a[5],a[6],u).toPrecision(4)+' '+n[1]+',  '+n[2]+' '+value(a[7],a[8],a[9],v).toPrecision(4)+' '+n[3];\n\
cross=document.createElementNS(svg.namespaceURI,'path');cross.setAttribute('class','x');\n\
cross.setAttribute('d','M'+at.x+' '+a[1]+'v'+a[3]+'M'+a[0]+' '+at.y+'h'+a[2]);g.appendChild(cross)}})})});\n";
