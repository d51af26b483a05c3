#include "daemon/analysis/report/audit_headline.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/analysis/report/report.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/document/document.hpp"

namespace weft::daemon {
namespace {

using nlohmann::ordered_json;

ordered_json text_or_null(std::string_view text) {
  return text.empty() ? ordered_json() : ordered_json(text);
}

std::string verdict_text(const AuditHeadline& one) {
  if (one.verdict.empty()) return "not made";
  if (one.verdict == "no_sign") return "no sign of a confound";
  return one.verdict == "cannot_tell" ? "cannot be decided" : one.verdict;
}

ordered_json probe_json(const AuditHeadline& one) {
  if (!one.probe) return {};
  const StrongestProbe& probe = *one.probe;
  return {{"name", probe.name},     {"accuracy", probe.accuracy}, {"full_accuracy", probe.full},
          {"chance", probe.chance}, {"share", probe.share},       {"p", probe.p},
          {"named", probe.is_named}};
}

}  // namespace

std::string format_headline(const AuditHeadline& one, BenchKind bench) {
  std::string out = (one.exploration.empty() ? "" : one.exploration + ": ") + verdict_text(one);
  if (!one.reason.empty()) out += ": " + one.reason;
  if (!out.ends_with('.')) out += ".";
  if (one.probe)
    out += " Accuracy from " + one.probe->name + " alone " + percent(one.probe->accuracy, 1) +
           " %, from all features " + percent(one.probe->full, 1) + " %, by chance " +
           percent(one.probe->chance, 1) + " %" +
           (bench == BenchKind::real ? "" : " (" + std::string(bench_text(bench)) + ")") + ".";
  return out;
}

std::string_view overall_verdict(std::span<const AuditHeadline> all) {
  for (const std::string_view verdict : {"confounded", "cannot_tell", "no_sign"})
    if (std::ranges::find(all, verdict, &AuditHeadline::verdict) != all.end()) return verdict;
  return {};
}

std::string quick_form_note(std::span<const AuditHeadline> all) {
  const auto made = std::ranges::find_if(all, [](const auto& one) { return one.permutations > 0; });
  if (made == all.end()) return {};
  return "Quick form of weft audit: " + std::to_string(made->permutations) +
         " permutations with LDA and none with trees. It misses effects that only trees find, and "
         "omits the accuracies without level or taxel pattern. weft audit computes all.";
}

ordered_json headlines_json(std::span<const AuditHeadline> all, BenchKind bench) {
  if (all.empty()) return {};
  ordered_json explorations = ordered_json::object();
  for (const AuditHeadline& one : all)
    explorations[one.exploration] = {
        {"verdict", text_or_null(one.verdict)}, {"why", text_or_null(one.why)},
        {"reason", text_or_null(one.reason)},   {"probe", probe_json(one)},
        {"permutations", one.permutations},     {"text", format_headline(one, bench)}};
  return {{"verdict", text_or_null(overall_verdict(all))},
          {"bench", to_string(bench)},
          {"quick", true},
          {"explorations", std::move(explorations)}};
}

Blocks audit_section(const ReportInput& input) {
  if (input.audit.empty()) return {};
  Blocks body;
  for (const AuditHeadline& one : input.audit)
    body += paragraph(escape(format_headline(one, input.dataset.info.kind)));
  return section("Audit: accuracy not caused by the material",
                 figure(std::move(body), escape(quick_form_note(input.audit)), badge_html(input)));
}

}  // namespace weft::daemon
