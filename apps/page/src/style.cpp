#include "gonio/page/style.h"

namespace gonio::page {

std::string_view style_sheet() {
  return R"css(
:root{color-scheme:light dark;--paper:#f6f6f4;--card:#fff;--ink:#1b1e24;--quiet:#666d78;
--line:#e2e3e0;--grid:#e8e9e6;--accent:#0f6e84;--accent-soft:#e3f0f3;--stage:#17191d;
--r:#cc3d33;--g:#25894c;--b:#2f66cf;--light:#c7780d;--detector:#2563c4;--both:#0f6e84;
--good:#1f8a4d;--good-soft:#e4f3ea;--warn:#a76300;--warn-soft:#fbf0dc;--bad:#bf2d26;
--bad-soft:#fbe6e4;--truth:#1b1e24;
--t0:#0f6e84;--t1:#e09f3e;--t2:#6c8ebf;--t3:#9e5a63;--t4:#7fa96b;--t5:#8d7cc3;--t6:#c98b6b;
--t7:#8a9099}
@media (prefers-color-scheme:dark){:root{--paper:#101215;--card:#181b20;--ink:#e7e9ec;
--quiet:#979ea9;--line:#2a2e35;--grid:#272b31;--accent:#5fc3d9;--accent-soft:#15313a;
--stage:#0b0c0e;
--r:#f2756a;--g:#58c583;--b:#78a4f5;--light:#eda544;--detector:#78a4f5;--both:#5fc3d9;
--good:#5cc88a;--good-soft:#16301f;--warn:#e9b25b;--warn-soft:#33270f;--bad:#f2827b;
--bad-soft:#3a1917;--truth:#e7e9ec;
--t0:#4fb3c9;--t1:#e5ad57;--t2:#7f9fce;--t3:#c07f88;--t4:#93bd80;--t5:#a497d6;--t6:#d7a184;
--t7:#9aa0a9}}
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%}
body{margin:0;background:var(--paper);color:var(--ink);
font:16px/1.55 system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue","Noto Sans",Arial,sans-serif;
font-variant-numeric:tabular-nums}
main{max-width:1240px;margin:0 auto;padding:28px 28px 56px}
h1{font-size:2.5rem;line-height:1.12;letter-spacing:-.022em;margin:.1em 0 .25em;font-weight:680;
overflow-wrap:anywhere}
h2{font-size:1.28rem;letter-spacing:-.01em;margin:0 0 .2em;font-weight:650}
p{margin:.3em 0 .8em;max-width:76ch}
.kicker{color:var(--accent);font-size:.8rem;font-weight:650;letter-spacing:.09em;
text-transform:uppercase}
.quiet,.lead{color:var(--quiet)}
.lead{font-size:1.05rem;overflow-wrap:anywhere}
section,.hero{background:var(--card);border:1px solid var(--line);border-radius:14px;
padding:24px 26px;margin:0 0 20px}
.hero{display:grid;grid-template-columns:minmax(220px,340px) 1fr;gap:34px;align-items:center}
.hero .sphere{background:var(--stage);border-radius:12px;padding:18px;text-align:center}
.hero .sphere img{width:100%;height:auto;display:block}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(132px,1fr));gap:10px;margin:18px 0 0}
.tile{border:1px solid var(--line);border-radius:10px;padding:10px 13px}
.tile b{display:block;font-size:1.22rem;line-height:1.35;letter-spacing:-.025em;font-weight:650;
white-space:nowrap}
.tile span{color:var(--quiet);font-size:.82rem;line-height:1.3;display:block}
.verdict{display:inline-flex;align-items:center;gap:9px;border-radius:999px;padding:5px 15px;
font-weight:600;font-size:.93rem;margin:.2em 0}
.verdict::before{content:"";width:9px;height:9px;border-radius:50%;background:currentColor}
.passed{color:var(--good);background:var(--good-soft)}
.remark{color:var(--warn);background:var(--warn-soft)}
.failed{color:var(--bad);background:var(--bad-soft)}
.na{color:var(--quiet);background:var(--paper)}
.spheres{display:grid;grid-template-columns:repeat(3,1fr);gap:12px;margin-top:14px}
h2.inner{margin-top:26px}
.spheres figure{background:var(--stage);border-radius:12px;margin:0;padding:14px 14px 9px;
color:#c9ced6}
.spheres img{width:100%;height:auto;display:block;max-width:340px;margin:0 auto}
.spheres figcaption{display:flex;justify-content:space-between;gap:8px;font-size:.8rem;
margin-top:9px;color:#aab1bb;flex-wrap:wrap}
.spheres figcaption b{color:#f0f2f5;font-weight:600}
.scale{display:flex;align-items:center;gap:10px;color:var(--quiet);font-size:.84rem;margin-top:12px;
flex-wrap:wrap}
.scale img{height:11px;width:190px;border-radius:3px;display:block}
table{border-collapse:collapse;width:100%;font-size:.95rem}
.scroll{overflow-x:auto;margin-top:10px}
th,td{padding:8px 12px;text-align:right;border-bottom:1px solid var(--line);white-space:nowrap}
th:first-child,td:first-child{text-align:left;white-space:normal;min-width:180px;padding-left:2px}
thead th{font-size:.84rem;font-weight:600;color:var(--quiet);vertical-align:bottom;white-space:normal;
overflow-wrap:break-word;min-width:112px}
thead th small{display:block;font-weight:400}
tbody tr:last-child td{border-bottom:0}
td.best{font-weight:700;color:var(--accent)}
td small{color:var(--quiet)}
tr.minor td{color:var(--quiet)}
tr.minor td.best{font-weight:400;color:var(--quiet)}
figure{margin:0}
figcaption{color:var(--quiet);font-size:.86rem;text-align:center;margin-top:2px}
.trio{display:grid;grid-template-columns:repeat(3,1fr);gap:22px;margin-top:10px}
.duo{display:grid;grid-template-columns:1fr 1fr;gap:14px 22px;margin-top:10px}
svg{width:100%;height:auto;display:block;font-family:inherit}
.wide{overflow-x:auto;margin-top:10px}
.wide svg{min-width:820px}
.polar{max-width:820px;margin:14px auto 0}
svg .tick{font-size:11px;fill:var(--quiet)}
svg .axis{font-size:12px;fill:var(--quiet)}
svg .plottitle{font-size:14px;font-weight:650;fill:var(--ink)}
svg .ring,svg .arc{stroke:var(--grid);stroke-width:1;fill:none}
svg .hemi{fill:none;stroke:var(--quiet);stroke-width:1.2}
svg .frame{fill:none;stroke:var(--line);stroke-width:1}
svg .stripe{fill:var(--ink);opacity:.035}
svg .band1{fill:var(--accent);opacity:.13}
svg .band2{fill:var(--accent);opacity:.08}
svg .mirror{stroke:var(--quiet);stroke-dasharray:2 4;stroke-width:1}
svg .sub{opacity:.55}
svg .pose{stroke:var(--card);stroke-width:1.5}
svg .light{fill:var(--light)}
svg .detector{fill:var(--detector)}
svg .both{fill:var(--both)}
svg .poseno{font-size:10px;font-weight:700;fill:var(--card)}
svg .refused{stroke:var(--bad);stroke-width:2}
svg .curve{fill:none;stroke-width:1.9;stroke-linejoin:round}
svg .truth{stroke-width:1.5;stroke-dasharray:5 4;opacity:.62}
svg .err{stroke-width:1;opacity:.75}
svg .fit{stroke-width:1.6;opacity:.9}
svg .off{fill:none;stroke-width:1.3}
svg .beyond{stroke:var(--bad);stroke-width:1.6}
svg .r{stroke:var(--r)}svg .g{stroke:var(--g)}svg .b{stroke:var(--b)}
svg .dot.r{fill:var(--r);stroke:none}svg .dot.g{fill:var(--g);stroke:none}
svg .dot.b{fill:var(--b);stroke:none}
svg .dot.beyond{stroke:var(--bad)}
svg .band{stroke:none;opacity:.15}
svg .band.r{fill:var(--r)}svg .band.g{fill:var(--g)}svg .band.b{fill:var(--b)}
svg .p0{stroke:var(--t0)}svg .p1{stroke:var(--t1)}svg .p2{stroke:var(--t2)}svg .p3{stroke:var(--t3)}
.key{display:flex;gap:20px;flex-wrap:wrap;color:var(--quiet);font-size:.86rem;margin-top:8px}
.key i{display:inline-block;width:22px;height:0;border-top:2.5px solid;margin-right:7px;
vertical-align:middle}
.key i.d{border-top-style:dashed}
.key i.o{width:9px;height:9px;border:0;border-radius:50%;background:currentColor}
.timebar{display:flex;height:30px;border-radius:8px;overflow:hidden;margin:12px 0 10px;gap:2px}
.timebar span{display:block;min-width:2px}
.t0{background:var(--t0)}.t1{background:var(--t1)}.t2{background:var(--t2)}.t3{background:var(--t3)}
.t4{background:var(--t4)}.t5{background:var(--t5)}.t6{background:var(--t6)}.t7{background:var(--t7)}
ul.legend{list-style:none;display:flex;flex-wrap:wrap;gap:6px 26px;padding:0;margin:0;font-size:.92rem}
ul.legend i{display:inline-block;width:11px;height:11px;border-radius:3px;margin-right:8px}
ul.checks,ul.warnings{list-style:none;padding:0;margin:10px 0 0}
ul.checks li{display:grid;grid-template-columns:136px 180px 1fr;gap:14px;padding:8px 0;
border-bottom:1px solid var(--line);align-items:baseline}
ul.checks li:last-child{border-bottom:0}
ul.checks em{font-style:normal;font-weight:600;font-size:.82rem;border-radius:999px;padding:2px 11px;
justify-self:start;white-space:nowrap}
ul.checks span,ul.warnings li{overflow-wrap:anywhere}
ul.warnings li{border-left:3px solid var(--warn);background:var(--warn-soft);border-radius:0 8px 8px 0;
padding:8px 14px;margin:0 0 8px}
dl{display:grid;grid-template-columns:minmax(130px,230px) 1fr;gap:5px 18px;margin:10px 0 0;
font-size:.93rem}
dt{color:var(--quiet)}
dd{margin:0;overflow-wrap:anywhere}
.provenance dd{font-family:ui-monospace,"SF Mono","DejaVu Sans Mono",Menlo,Consolas,monospace;
font-size:.86rem}
@media (max-width:820px){main{padding:14px 12px 40px}section,.hero{padding:18px 16px;border-radius:12px}
h1{font-size:1.85rem}.hero{grid-template-columns:1fr;gap:18px}.hero .sphere img{max-width:260px;margin:0 auto}
.trio,.duo{grid-template-columns:1fr}.spheres{gap:7px}.spheres figure{padding:7px 7px 6px;border-radius:9px}
.spheres figcaption{font-size:.72rem}ul.checks li{grid-template-columns:1fr;gap:3px}
dl{grid-template-columns:1fr;gap:0}dd{margin:0 0 8px}th,td{padding:7px 8px}}
@media print{:root{color-scheme:light;--paper:#fff;--card:#fff;--ink:#111;--quiet:#555;--line:#ccc;
--grid:#e4e4e4;--stage:#22252a;--accent:#0f6e84;--r:#cc3d33;--g:#25894c;--b:#2f66cf;--light:#c7780d;
--detector:#2563c4;--both:#0f6e84;--good:#1f8a4d;--good-soft:#fff;--warn:#a76300;--warn-soft:#fff;
--bad:#bf2d26;--bad-soft:#fff;--truth:#111}
body{font-size:11pt}main{max-width:none;padding:0}section,.hero{border:0;padding:0;margin:0 0 16pt;
border-radius:0}figure,tr,li,.tile{break-inside:avoid}h2{break-after:avoid}
.wide,.scroll{overflow:visible}.wide svg{min-width:0}
.hero .sphere,.spheres figure,.timebar span,.legend i{-webkit-print-color-adjust:exact;
print-color-adjust:exact}}
)css";
}

}  // namespace gonio::page
