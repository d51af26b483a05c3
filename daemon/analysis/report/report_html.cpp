#include "daemon/analysis/report/figures.hpp"
#include "daemon/analysis/report/report.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"
#include "daemon/pages/plot/scatter.hpp"

namespace weft::daemon {

bool is_complete(const CampaignSummary& run) {
  return run.trials_complete == run.trials_planned && !run.error;
}

std::string format_incomplete(const CampaignSummary& run) {
  if (is_complete(run)) return {};
  if (run.trials_complete == run.trials_planned) return "ENDED BY AN ERROR";
  return "INCOMPLETE, " + thousands(run.trials_complete) + " of " + thousands(run.trials_planned) +
         " trials";
}

Status check(const ReportInput& input) {
  if (input.run.bench != input.dataset.info.kind)
    return fail({.code = Errc::invalid_argument,
                 .where = "report",
                 .what = "run and data set disagree on the kind of bench",
                 .expected = std::string(to_string(input.run.bench)),
                 .got = std::string(to_string(input.dataset.info.kind)),
                 .hint = "Report a campaign together with its own data set"});
  return check(input.dataset);
}

namespace {

std::string outlook_section(const ReportInput& input) {
  return input.design.html;
}

std::string tradeoff_section(const ReportInput& input) {
  return input.tradeoff_html;
}

/// Of the pictures in parts that were made beforehand.
std::string more_style(const ReportInput& input) {
  if (input.design.html.empty() && input.tradeoff_html.empty()) return {};
  return std::string(marks_style()) + std::string(scatter_style());
}

}  // namespace

std::string report_html(const ReportInput& input) {
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>" +
      escape(input.run.name) + " (" + escape(to_string(input.dataset.info.kind)) +
      ") \u2013 Weft campaign report</title>\n<style>" + std::string(style_sheet()) +
      more_style(input) + paper_style(input) + "</style>\n</head>\n<body>\n<main>\n";
  for (const auto section : {heading_section, trace_section, accuracy_section, outlook_section,
                             core_section, timing_section, tradeoff_section, force_section,
                             certificate_section, wall_time_section, provenance_section})
    out += section(input);
  return out + "</main>\n</body>\n</html>\n";
}

Status write_report_html(const ReportInput& input, const std::filesystem::path& path) {
  if (Status ok = check(input); !ok) return ok;
  return write_text_file(path, report_html(input));
}

}  // namespace weft::daemon
