"""The plots' colours: one set for light, one for dark, print as light.

The hues are Okabe and Ito's, darkened or lightened until text and lines of each tone keep a contrast of at least 3 to 1
against their background; dashes and widths say the same as the hues.
"""

TONES = ("measured", "command", "before", "after", "alarm", "quiet")

PLOT_STYLE = """
:root{--ink:#1b2733;--paper:#fff;--grid:#dfe4ea;--faint:#5b6875;--measured:#1f2d3a;--command:#5a7896;--before:#b85300;
--after:#0064a8;--alarm:#c02a2a;--quiet:#6d7b88}
@media screen and (prefers-color-scheme:dark){:root{--ink:#e4eaf0;--paper:#12181f;--grid:#2c3742;--faint:#9aa8b5;
--measured:#dbe4ec;--command:#8aa9c6;--before:#f0913d;--after:#5bb5f0;--alarm:#ff7b72;--quiet:#8795a3}}
.plot{display:block;width:100%;height:auto;font:12px system-ui,sans-serif}
.plot text{fill:var(--faint)}
.plot .m{text-anchor:middle}.plot .e{text-anchor:end}
.plot .note{fill:var(--alarm);font-weight:600;paint-order:stroke;stroke:var(--paper);stroke-width:3px}
.plot path,.plot .frame{fill:none;vector-effect:non-scaling-stroke}
.plot .grid{stroke:var(--grid)}.plot .frame{stroke:var(--faint)}
.plot .ln{stroke-width:1.3;stroke-linejoin:round}
.plot .pt{stroke-width:5;stroke-linecap:round}.plot .pt.before{stroke-width:1.6}
"""
PLOT_STYLE += "".join(
    f".plot .{tone}{{stroke:var(--{tone})}}.plot .rb.{tone},.plot .bar.{tone}{{fill:var(--{tone});stroke:none}}\n"
    for tone in TONES
)
PLOT_STYLE += """\
.plot .ln.command{stroke-dasharray:8 3}.plot .ln.before{stroke-dasharray:5 3;stroke-width:1.5}
.plot .ln.after{stroke-width:1.5}.plot .ln.quiet{stroke-width:4.5;stroke-opacity:.45}
.plot .up,.plot .down{shape-rendering:crispEdges;stroke:none}
.plot .rb{fill-opacity:.22}.plot .span{fill:var(--alarm);fill-opacity:.1}
.plot .level{stroke:var(--alarm);stroke-width:1.2;stroke-dasharray:7 4}
.plot .instant{stroke:var(--alarm);stroke-width:1.6;stroke-dasharray:2 3}
.plot .whisker{stroke:var(--ink);stroke-width:1.4}
.plot .up,.plot .hit{fill:var(--after)}.plot .down,.plot .miss{fill:var(--before)}.plot .onfill{fill:var(--paper)}
"""
