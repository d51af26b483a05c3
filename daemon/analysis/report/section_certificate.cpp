#include "daemon/analysis/report/figures.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"

namespace weft::daemon {
namespace {

constexpr std::size_t most_problems = 20;  // on the page; weft verify tells them all

std::string entry(std::string_view name, const std::string& value) {
  return "<dt>" + std::string(name) + "</dt><dd>" + escape(value) + "</dd>\n";
}

std::string verdict(const VerifyReport& report) {
  if (!report.holds())
    return "not as recorded: " + std::to_string(report.found_problems.size()) +
           (report.found_problems.size() == 1 ? " finding" : " findings");
  return report.certified ? "holds: every byte is as certified"
                          : "the files\u2019 own digests agree; there is no certificate";
}

std::string found_problems(const VerifyReport& report) {
  std::string out;
  for (std::size_t i = 0; i < report.found_problems.size() && i < most_problems; ++i)
    out += entry(escape(report.found_problems[i].where), report.found_problems[i].what);
  return out;
}

}  // namespace

std::string certificate_section(const ReportInput& input) {
  if (input.verified == nullptr) return {};
  const VerifyReport& report = *input.verified;
  const std::string body =
      "<dl>\n" + entry("verdict", verdict(report)) +
      entry("trials", thousands(report.complete) + " of " + thousands(report.planned) +
                          " complete, in " + thousands(report.attempts) + " attempts") +
      entry("samples lost in gaps on record", thousands(report.lost_samples)) +
      entry("came to its end", report.finished ? "yes" : "no") +
      entry("data set SHA-256", report.dataset_sha256) +
      entry("recorded by", "weft " + report.software_version) + found_problems(report) + "</dl>\n";
  return "<section>\n<h2>Whether it is what was recorded</h2>\n" +
         figure(body,
                "What <code>weft verify</code> found when this report was made: digests of all "
                "trials, of the campaign file and of the data set against the certificate.",
                badge_html(input)) +
         "</section>\n";
}

}  // namespace weft::daemon
