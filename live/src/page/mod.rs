//! The page: one HTML file without any outside asset. Its plots are drawn by uPlot (MIT, `uPlot.LICENSE`).

/// The page, for a server that lets scripts with this nonce run.
pub(crate) fn html(nonce: &str) -> String {
    include_str!("live.html")
        .replace("/*UPLOT_CSS*/", include_str!("uPlot.min.css"))
        .replace("/*STYLE*/", include_str!("live.css"))
        .replace("/*UPLOT*/", include_str!("uPlot.iife.min.js"))
        .replace("/*SCRIPT*/", concat!(include_str!("plots.js"), include_str!("scene.js"), include_str!("live.js")))
        .replace("NONCE", nonce)
}
