#include "daemon/analysis/report/figures.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"

namespace weft::daemon {
namespace {

double in_band_share(const ForceTally& tally) {
  return tally.samples == 0
             ? 0
             : static_cast<double>(tally.in_band) / static_cast<double>(tally.samples);
}

std::vector<std::string> force_cells(const std::string& name, std::size_t trials,
                                     const ForceTally& tally) {
  return {name,
          thousands(trials),
          thousands(tally.samples),
          fixed(tally.rms_n() * 1e3, 1),
          fixed(tally.worst_n * 1e3, 0),
          percent(in_band_share(tally), 2)};
}

std::string force_table(const ReportInput& input, const std::vector<FabricForce>& fabrics) {
  HtmlTable table({"fabric", "trials", "samples", "RMS error [mN]", "worst [mN]", "in band [%]"});
  for (const FabricForce& f : fabrics) table.row(force_cells(escape(f.fabric), f.trials, f.tally));
  const char* const all =
      input.verified == nullptr ? "<b>run\u2019s own tally</b>" : "<b>all fabrics</b>";
  table.row(force_cells(all, input.run.trials_complete, input.run.force));
  return table.finish();
}

std::string format_targets(const std::vector<ForceTarget>& targets) {
  std::string out;
  for (const ForceTarget& t : targets)
    out += (out.empty() ? "" : "; ") + escape(t.exploration) + " " + fixed(t.force_n, 2) +
           " N \u00B1 " + fixed(t.band_n, 2) + " N";
  return out;
}

}  // namespace

std::string force_section(const ReportInput& input) {
  const std::vector<ForceTarget> targets = force_targets(input.dataset.info);
  const std::vector<FabricForce> fabrics = force_by_fabric(input.dataset, targets);
  if (fabrics.empty()) return {};
  const std::string badge = badge_html(input);
  std::string out = "<section>\n<h2>How well the force was held</h2>\n";
  out += figure(
      "<div class=\"scroll\">" + fabric_force_figure(fabrics, targets.front().band_n) + "</div>\n",
      "Normal force against its set point while the probe moved (" + format_targets(targets) +
          "). The paper prints no such figure.",
      badge);
  out +=
      "<details><summary>As a table</summary>\n" +
      figure(force_table(input, fabrics),
             std::string("Computed again from the recorded wrench between the first and the "
                         "last taxel sample of phase M") +
                 (input.verified == nullptr ? "; the last row is what the run counted while it ran."
                                            : "."),
             badge) +
      "</details>\n";
  return out + "</section>\n";
}

std::string wall_time_section(const ReportInput& input) {
  const CampaignSummary& run = input.run;
  if (!(run.wall_s > 0)) return {};
  const std::vector<Share> shares = wall_shares(run);
  HtmlTable table({"part", "time", "share [%]"});
  for (std::size_t i = 0; i < shares.size(); ++i)
    table.row(
        {"<i class=\"swatch share-" + std::to_string(i + 1) + "\"></i>" + escape(shares[i].name),
         duration(shares[i].seconds), percent(shares[i].seconds / run.wall_s)});
  table.row({"<b>run</b>", "<b>" + duration(run.wall_s) + "</b>", "100"});
  table.row({"export to HDF5, afterwards", duration(run.time.export_s), std::string(no_value)});
  return "<section>\n<h2>Where the wall time went</h2>\n" +
         figure(share_figure(shares) + table.finish(),
                "Wall time of the run on this machine, attributed by timing one call in sixteen; " +
                    duration(run.virtual_s) + " of bench time, " +
                    thousands(static_cast<std::size_t>(run.events)) + " timer and link events.",
                badge_html(input)) +
         "</section>\n";
}

}  // namespace weft::daemon
