#include "covsplat/report/html.hpp"

namespace covsplat {

std::string_view PageStyle() {
  return R"(
:root { --page:#f4f5f7; --card:#fff; --ink:#1b1f26; --soft:#667080; --line:#e2e5ea;
  --accent:#2f7ed8; --good:#128a6b; --warn:#b85c00; --warn-bg:#fff4e5; }
@media (prefers-color-scheme: dark) {
  :root { --page:#14161a; --card:#1d2026; --ink:#e6e8ec; --soft:#98a1b0; --line:#31363f;
    --accent:#6aa9ee; --good:#3fc7a0; --warn:#f0a24a; --warn-bg:#33281a; } }
* { box-sizing:border-box; }
body { margin:0; background:var(--page); color:var(--ink);
  font:15px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"Noto Sans",sans-serif; }
main { max-width:1180px; margin:0 auto; padding:34px 24px 60px; }
header { margin-bottom:22px; }
h1 { font-size:28px; line-height:1.2; margin:0 0 4px; letter-spacing:-.015em; }
h2 { font-size:18px; margin:0 0 8px; letter-spacing:-.01em; }
.lead { color:var(--soft); margin:0; overflow-wrap:anywhere; }
.card { background:var(--card); border:1px solid var(--line); border-radius:12px;
  padding:20px 22px; margin:0 0 18px; }
.card > p { color:var(--soft); margin:0 0 14px; max-width:80ch; }
.tiles { display:flex; flex-wrap:wrap; gap:12px; margin-bottom:18px; }
.tile { background:var(--card); border:1px solid var(--line); border-radius:12px;
  padding:14px 18px; flex:1 1 245px; }
.tile .label { color:var(--soft); font-size:13px; }
.tile .value { font-size:25px; font-weight:650; line-height:1.3; letter-spacing:-.02em;
  font-variant-numeric:tabular-nums; white-space:nowrap; }
.tile .note { color:var(--soft); font-size:13px; }
.tile.warn .value, .tile.warn .note { color:var(--warn); }
.columns { display:grid; gap:16px 22px; grid-template-columns:1fr 1fr; align-items:start; }
.columns > * { min-width:0; }
@media (max-width:820px) { .columns { grid-template-columns:1fr; } }
.plot { display:block; width:100%; height:auto; font-size:12px; }
.plot text { fill:currentColor; }
.plot .title { font-size:14px; font-weight:600; }
.plot .axis text { fill:var(--soft); font-size:11.5px; font-variant-numeric:tabular-nums; }
.plot .axis path { stroke:var(--soft); stroke-opacity:.22; fill:none; }
.plot .nodata { fill:var(--soft); }
.curve { fill:none; stroke-width:1.7; stroke-linejoin:round; stroke-linecap:round; }
figure { margin:0; }
figcaption { color:var(--soft); font-size:13px; margin-top:6px; }
.picture { display:block; width:100%; height:auto; border-radius:8px; background:#26282e; }
.scan { border-top:1px solid var(--line); padding-top:14px; margin-top:14px; }
.scan h3 { font-size:15px; margin:0 0 8px; display:flex; gap:14px; flex-wrap:wrap;
  align-items:baseline; justify-content:space-between; }
.scan h3 span { font-weight:400; color:var(--soft); }
.scan h3 b { color:var(--good); }
.scan h3 b.worse { color:var(--warn); }
.strip { display:grid; grid-template-columns:78px 1fr; align-items:center; font-size:13px;
  color:var(--soft); margin-bottom:4px; }
.range { display:block; width:100%; height:76px; image-rendering:pixelated; border-radius:4px; }
.scales { display:flex; gap:34px; flex-wrap:wrap; font-size:13px; color:var(--soft); }
.scale { display:flex; gap:9px; align-items:center; }
.scale i { width:150px; height:12px; border-radius:3px; display:inline-block;
  border:1px solid var(--line); }
.scale i.none { width:22px; }
table { border-collapse:collapse; width:100%; font-size:14px; font-variant-numeric:tabular-nums; }
th, td { text-align:right; padding:6px 10px; border-bottom:1px solid var(--line); }
th:first-child, td:first-child { text-align:left; padding-left:0; }
th { color:var(--soft); font-weight:500; }
tr:last-child td { border-bottom:0; }
td.text { text-align:left; overflow-wrap:anywhere; }
td.key { color:var(--soft); white-space:nowrap; width:170px; vertical-align:top; }
.swatch { display:inline-block; width:10px; height:10px; border-radius:2px; margin-right:8px; }
.events { list-style:none; margin:0; padding:0; }
.events li { padding:6px 12px; border-radius:6px; margin-bottom:4px; display:flex; gap:14px; }
.events li.warn { background:var(--warn-bg); }
.events .at { color:var(--soft); min-width:82px; font-variant-numeric:tabular-nums; }
.good { color:var(--good); } .bad { color:var(--warn); }
details { margin-top:14px; }
details summary { cursor:pointer; font-weight:600; }
pre { overflow:auto; background:var(--page); border:1px solid var(--line); border-radius:8px;
  padding:14px 16px; font:12.5px/1.5 ui-monospace,"DejaVu Sans Mono",Menlo,monospace; }
code { font:13px ui-monospace,"DejaVu Sans Mono",Menlo,monospace; overflow-wrap:anywhere; }
footer { color:var(--soft); font-size:13px; text-align:center; margin-top:26px; }
@media print { body { background:#fff; } .card, .tile { break-inside:avoid; } }
)";
}

}  // namespace covsplat
