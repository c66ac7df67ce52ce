// The style sheet of the report.
#pragma once

#include <string_view>

namespace pade::evaluation {

inline constexpr std::string_view report_style = R"css(
:root { --ink: #1b2530; --soft: #5b6875; --line: #d5dbe1; --plate: #f4f6f8; --blue: #0072b2; --orange: #d55e00; }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 1240px; padding: 28px 32px 60px; color: var(--ink); background: #fff;
  font: 14px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif;
  -webkit-print-color-adjust: exact; print-color-adjust: exact; }
h1 { font-size: 26px; line-height: 1.2; margin: 0 0 4px; }
h2 { font-size: 18px; margin: 34px 0 10px; padding-bottom: 4px; border-bottom: 2px solid var(--line); }
h3 { font-size: 14px; margin: 18px 0 6px; }
p { margin: 6px 0; }
.soft { color: var(--soft); }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); gap: 10px; margin: 20px 0 8px; }
.tile { background: var(--plate); border-radius: 6px; padding: 10px 14px; }
.tile b { display: block; font-size: 22px; line-height: 1.25; }
.tile span { color: var(--soft); font-size: 12.5px; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: 4px 12px; text-align: right; border-bottom: 1px solid var(--line); white-space: nowrap; }
th { color: var(--soft); font-weight: 600; font-size: 12.5px; vertical-align: bottom; }
th:first-child, td:first-child { text-align: left; padding-left: 0; }
tr.all td { font-weight: 600; border-bottom: 0; }
table.text td { text-align: left; white-space: normal; vertical-align: top; }
.scroll { overflow-x: auto; }
.pictures { display: grid; grid-template-columns: repeat(3, 1fr); gap: 8px; break-inside: avoid; }
figure { margin: 0; }
figure img { width: 100%; display: block; border: 1px solid var(--line); }
figcaption { color: var(--soft); font-size: 12.5px; margin: 0 0 2px; }
.frame-block { break-inside: avoid; margin-bottom: 14px; }
.legends { display: grid; grid-template-columns: repeat(auto-fit, minmax(260px, 1fr)); gap: 12px 28px; background: var(--plate);
  border-radius: 6px; padding: 12px 16px; margin: 10px 0 14px; break-inside: avoid; }
.legends > div > b { display: block; font-size: 12.5px; margin-bottom: 4px; }
.wheel { display: flex; align-items: center; gap: 12px; font-size: 12.5px; }
.swatch { display: inline-block; width: 13px; height: 13px; margin-right: 6px; vertical-align: -2px; border: 1px solid #0003; }
.states span.item { display: inline-block; margin: 0 14px 2px 0; font-size: 12.5px; white-space: nowrap; }
.stack { display: flex; height: 22px; border-radius: 4px; overflow: hidden; margin: 6px 0; }
svg.bar { width: 276px; max-width: 100%; display: block; }
svg text { font: 12px system-ui, sans-serif; fill: var(--ink); }
svg.map { width: 100%; display: block; }
svg .frame { fill: none; stroke: #8893a0; }
svg .tick { stroke: #8893a0; fill: none; }
svg .halo { fill: none; stroke: #fff; stroke-width: 5; stroke-linejoin: round; }
svg .path { fill: none; stroke: var(--orange); stroke-width: 2.2; stroke-linejoin: round; }
svg .start { fill: #fff; stroke: var(--orange); stroke-width: 2.5; }
svg .end { fill: var(--orange); stroke: #fff; stroke-width: 1.5; }
svg .scale { fill: none; stroke: #000; stroke-width: 2; }
svg .corridor { fill: none; stroke: var(--orange); stroke-width: 1.6; stroke-dasharray: 5 3; }
svg .plate { fill: #ffffffd9; }
figure.map3d { margin: 0 0 16px; break-inside: avoid; }
figure.map3d > div { height: min(70vh, 620px); background: #1d2226; color: #dfe4e8; border-radius: 4px; }
figure.map3d > div > p:only-child { padding: 14px; }
.wide { display: grid; gap: 14px; }
.views { display: grid; grid-template-columns: 1fr 1fr; gap: 18px; align-items: start; }
svg.timing { width: 100%; max-width: 860px; display: block; }
.warning { border-left: 4px solid var(--orange); background: #fdf3ec; padding: 6px 12px; margin: 6px 0; }
.error { border-left: 4px solid #cc3311; background: #fbeae6; padding: 6px 12px; margin: 6px 0; }
.good { border-left: 4px solid var(--blue); background: #eef5fa; padding: 6px 12px; margin: 6px 0; }
@page { size: A4; margin: 12mm; }
@media print { figure.map3d { display: none; } body { padding: 0; max-width: none; font-size: 11px; } h2 { break-after: avoid; } .tile b { font-size: 17px; }
  .views { break-inside: avoid; } tr { break-inside: avoid; } }
@media (max-width: 760px) { .pictures { grid-template-columns: 1fr 1fr; } .views { grid-template-columns: 1fr; } body { padding: 16px; } }
)css";

}  // namespace pade::evaluation
