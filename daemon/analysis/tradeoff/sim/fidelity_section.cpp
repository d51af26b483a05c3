#include "daemon/analysis/tradeoff/sim/sim_page.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "daemon/analysis/tradeoff/tradeoff_point.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"
#include "daemon/pages/plot/scatter.hpp"

namespace weft::daemon {
namespace {

constexpr std::string_view campaign_scene = "fabrics17";

std::vector<sim::FidelityRow> campaign_rows(const sim::FidelityTable& table) {
  std::vector<sim::FidelityRow> out;
  for (const sim::FidelityRow& row : table.rows)
    if (row.scene == campaign_scene && row.error_max_n > 0 && row.times_real_time > 0)
      out.push_back(row);
  return out;
}

/// "L2 midpoint" of "L2 midpoint 0.384 ms".
std::string family_of(const sim::FidelitySetting& setting) {
  const std::string name = to_string(setting);
  return setting.step_s > 0 ? name.substr(0, name.rfind(' ', name.rfind(' ') - 1)) : name;
}

Scatter picture(const std::vector<sim::FidelityRow>& rows, const std::vector<std::size_t>& front) {
  Scatter out{"Error of the simulated force against processor time, SIMULATED, 17 fabrics",
              "largest error of the force [N]",
              "SIMULATED",
              {},
              {},
              true};
  ScatterPanel panel{"plant fidelity, 17 fabrics", "processor seconds per simulated second", {}};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string family = family_of(rows[i].setting);
    auto known = std::ranges::find(out.families, family);
    if (known == out.families.end()) known = out.families.insert(out.families.end(), family);
    ScatterPoint point;
    point.time_s = 1 / rows[i].times_real_time;
    point.share = rows[i].error_max_n;
    point.family = static_cast<std::size_t>(known - out.families.begin());
    point.front = std::ranges::find(front, i) != front.end();
    if (point.front) point.label = to_string(rows[i].setting);
    panel.points.push_back(std::move(point));
  }
  out.panels.push_back(std::move(panel));
  return out;
}

std::string front_table(const std::vector<sim::FidelityRow>& rows,
                        const std::vector<std::size_t>& front, std::string_view setting) {
  HtmlTable table({"setting", "largest error [mN]", "RMS [mN]", "times real time"});
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string name = to_string(rows[i].setting);
    const bool used = name == setting;
    if (!used && std::ranges::find(front, i) == front.end()) continue;
    table.row({used ? "<b>" + escape(name) + ", this campaign\u2019s</b>" : escape(name),
               general(rows[i].error_max_n * 1e3), general(rows[i].error_rms_n * 1e3),
               thousands(static_cast<std::size_t>(std::lround(rows[i].times_real_time)))});
  }
  return table.finish();
}

}  // namespace

Result<std::string> fidelity_section_html(const sim::FidelityTable& table,
                                          std::string_view setting) {
  const std::vector<sim::FidelityRow> rows = campaign_rows(table);
  if (rows.empty()) return std::string();
  std::vector<TradeoffChoice> bargains;
  for (const sim::FidelityRow& row : rows)
    bargains.push_back({-row.error_max_n, 1 / row.times_real_time});
  const auto front = pareto_front(bargains);
  if (!front) return pass(front.error());
  return "<section>\n<h2>What the plant\u2019s fidelity costs</h2>\n" +
         figure("<div class=\"scroll\">" + scatter_figure(picture(rows, *front)) + "</div>\n" +
                    front_table(rows, *front, setting),
                "Contact alone, against a finer run or the next level up, on a campaign of 17 "
                "fabrics; the front is of least error for the time. Measured by " +
                    escape(table.made_by) + " on " + escape(table.machine) +
                    ", not by this campaign, whose own error stands above.",
                bench_badge(BenchKind::simulated)) +
         "</section>\n";
}

}  // namespace weft::daemon
