#include "daemon/analysis/report/figures.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"

namespace weft::daemon {
namespace {

constexpr std::string_view phases_key =
    "Phases: <b>S</b> resting under the sensor\u2019s own weight, <b>P</b> force controlled "
    "without "
    "motion, <b>M</b> motion at constant force, <b>E</b> resting again. Blank: between phases, "
    "while the force settles or the probe comes to rest; not part of the data set.";

std::string format_trial(const TrialRecord& record) {
  return escape(record.spec.label) + ", " + escape(record.spec.exploration) + ", repetition " +
         std::to_string(record.spec.repetition);
}

std::string force_caption(const TrialRecord& record) {
  std::string out = "Force on the plate, " + format_trial(record) +
                    ": the trial whose force error is the median of its exploration";
  if (record.quality.force_rms_error_n)
    out += " (" + fixed(*record.quality.force_rms_error_n * 1e3, 1) + " mN RMS while held)";
  return out + ". " + std::string(phases_key);
}

std::string pad_pictures(const TrialTrace& trace) {
  const svg::Range range = pad_range(trace);
  std::string out = "<div class=\"pads\">\n";
  for (std::size_t pad = 0; pad < trace.pads.size(); ++pad) out += pad_figure(trace, pad, range);
  return out + "</div>\n";
}

}  // namespace

std::string trace_section(const ReportInput& input) {
  const Dataset& dataset = input.dataset;
  std::string exploration;
  for (const TrialRecord& record : dataset.records)
    if (exploration.empty()) exploration = record.spec.exploration;
  const auto chosen = typical_trial(dataset, exploration);
  if (!chosen) return {};
  const TrialTrace trace = extract_trace(dataset, *chosen);
  const std::string badge = badge_html(input);
  std::string out = "<section>\n<h2>One trial</h2>\n";
  if (trace.record->wrench.samples() > 0) {
    const auto target = find_target(force_targets(dataset.info), trace.record->spec.exploration);
    out += figure("<div class=\"scroll\">" + force_figure(trace, target) + "</div>\n",
                  force_caption(*trace.record), badge);
  }
  out += figure(pad_pictures(trace),
                "What the " + std::to_string(trace.pads.size()) +
                    " pads of the tactile sensor felt meanwhile: counts above each pad\u2019s mean "
                    "in phase S over time [s], all with the same axes (compare the paper\u2019s "
                    "Figure 5, one pad on real cloth).",
                badge);
  return out + "</section>\n";
}

}  // namespace weft::daemon
