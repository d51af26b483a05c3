#include <algorithm>
#include <cctype>

#include "daemon/analysis/report/confounding.hpp"
#include "daemon/analysis/report/paper.hpp"
#include "daemon/analysis/report/report.hpp"
#include "daemon/analysis/report/trace.hpp"
#include "daemon/base/text/format.hpp"
#include "recipes/engine/engine.hpp"

namespace weft::daemon {
namespace {

using classifier::Reduction;

constexpr std::size_t name_width = 21;  // "M1 levels removed"
constexpr std::size_t cell_width = 19;  // "100.0 (99.9-100.0)"

std::string padded(std::string text, std::size_t width) {
  if (text.size() < width) text.append(width - text.size(), ' ');
  return text;
}

std::string line(const std::string& name, const std::string& value) {
  return "  " + padded(name, 18) + value + "\n";
}

// Replaces control characters: a name from a recipe must not control the terminal.
std::string printable(std::string_view text) {
  std::string out;
  for (const char c : text) out += std::iscntrl(static_cast<unsigned char>(c)) != 0 ? '?' : c;
  return out;
}

std::string bench_label(BenchKind kind) {
  if (kind == BenchKind::simulated) return "SIMULATED bench";
  return kind == BenchKind::real ? "real bench" : "unknown bench";
}

/// For a report made after the run, only the bench time: the other times were not recorded.
std::string time_lines(const CampaignSummary& run) {
  const std::string bench = duration(run.virtual_s) + " bench time";
  if (!(run.wall_s > 0)) return line("time", bench);
  return line("time", bench + ", " + duration(run.wall_s) + " wall time, " +
                          fixed(realtime_factor(run), 0) + " x real time") +
         line("wall time", "plant " + duration(run.time.plant_and_emulators_s) + ", control " +
                               duration(run.time.drivers_and_control_s) + ", recorder " +
                               duration(run.time.recorder_s) + "; export " +
                               duration(run.time.export_s));
}

std::string run_lines(const ReportInput& input) {
  const CampaignSummary& run = input.run;
  std::string out = line(
      "trials", thousands(run.trials_complete) + " of " + thousands(run.trials_planned) + ", " +
                    std::string(recipes::to_string(run.outcome)) + format_ended_early(run));
  if (run.attempts_rejected > 0)
    out +=
        line("rejected", thousands(run.attempts_rejected) + " attempts, kept, marked and repeated");
  if (run.error) out += line("error", printable(to_string(*run.error)));
  out += time_lines(run);
  if (run.force.samples > 0)
    out += line("force error", fixed(run.force.rms_n() * 1e3, 1) + " mN RMS, worst " +
                                   fixed(run.force.worst_n * 1e3, 0) + " mN, " +
                                   percent(in_band_share(run.force), 2) + " % in band");
  // 64 digits do not fit into the usual column
  out += simulation_text(run.simulation);
  return out + "  data set  " + (run.dataset_sha256.empty() ? "none" : run.dataset_sha256) + "\n";
}

std::string with_interval(const classifier::Scores& e) {
  return percent(e.accuracy) + " (" + percent(e.ci95.low) + "-" + percent(e.ci95.high) + ")";
}

std::string accuracy_cell(const std::vector<ReductionResult>& results, Reduction reduction) {
  const classifier::Evaluation* e = find(results, reduction);
  return padded(e == nullptr ? "-" : with_interval(*e), cell_width);
}

std::string accuracy_line(const std::string& name, const std::vector<ReductionResult>& results) {
  std::string out = name + accuracy_cell(results, Reduction::pvalue) +
                    accuracy_cell(results, Reduction::pca) + accuracy_cell(results, Reduction::all);
  out.erase(out.find_last_not_of(' ') + 1);
  return out + "\n";
}

std::string confounding_line(const std::vector<ExplorationResult>& results) {
  const auto found = std::ranges::find(results, true, &ExplorationResult::confounded);
  if (found == results.end()) return {};
  const std::string splits =
      found->level_removed.empty()
          ? ""
          : "; levels removed: each taxel minus its mean of phase M, over " +
                std::to_string(found->level_removed.front().evaluation.splits.size()) + " splits";
  return wrapped(std::string(confounded_with_mounting) + splits, "  ");
}

std::string headline_lines(const std::vector<Headline>& headlines) {
  std::string out = headlines.empty() ? "" : "\n  Accuracy\n";
  for (const Headline& headline : headlines)
    out += wrapped(printable(headline_text(headline)), "  ");
  return out;
}

std::string printed_cell(double share) {
  return padded(share < 0 ? "-" : percent(share, 0), cell_width);
}

std::string accuracy_lines(const std::vector<ExplorationResult>& results) {
  std::string out = "\n  Other protocols\n" +
                    wrapped(std::string(other_protocols(true, false).front().text), "  ") + "  " +
                    padded("accuracy [%]", name_width) + padded("p-value", cell_width) +
                    padded("PCA", cell_width) + "all features\n";
  for (const ExplorationResult& result : results) {
    const std::string name = printable(result.exploration);
    out += accuracy_line("  " + padded(name, name_width), result.reductions);
    if (!result.level_removed.empty())
      out +=
          accuracy_line("  " + padded(name + " levels removed", name_width), result.level_removed);
  }
  for (const paper::Accuracy& row : paper::accuracies_beside(results)) {
    out += "  " + padded(std::string(row.exploration) + " paper (real)", name_width) +
           printed_cell(row.pvalue) + printed_cell(row.pca) + printed_cell(row.all);
    out.erase(out.find_last_not_of(' ') + 1);
    out += "\n";
  }
  return out +
         wrapped("in parentheses: 95 % interval, " + printable(interval_methods(results)), "  ") +
         confounding_line(results);
}

/// Below the others: there is no space for a fourth column.
std::string best_line(const ExplorationResult& result) {
  if (!result.best) return {};
  const classifier::Scores& scores = result.best->scores;
  return "    " + padded("  best", name_width - 2) + padded(with_interval(scores), cell_width) +
         "over " + std::to_string(scores.splits.size()) + " splits; shuffled " +
         percent(result.best->permuted_accuracy) + "\n";
}

/// p-value, PCA and all features of each campaign, ordered by what differs.
std::string repetition_lines(const ReportInput& input) {
  std::string out;
  for (const RepetitionRow& row : repetition_rows(input)) {
    out += (out.empty() ? "\n  Accuracy [%] by what is new in a test trial\n  " : "  ") + row.text +
           "\n";
    for (const ExplorationResult& result : *row.results) {
      out += accuracy_line("    " + padded(printable(result.exploration), name_width - 2),
                           result.reductions);
      out += best_line(result);
    }
  }
  return out;
}

std::string timing_lines(const std::vector<ExplorationResult>& results) {
  std::string out;
  for (const ExplorationResult& result : results) {
    const classifier::Evaluation* e = result.find(Reduction::pvalue);
    if (e == nullptr) continue;
    out += line(printable(result.exploration) + " timing",
                "features " + duration(result.feature_s_per_sample) + ", training " +
                    duration(e->train_s) + ", test " + duration(e->test_s_per_sample));
    out += line("", "shuffled labels " + percent(result.permuted_accuracy) + " %");
  }
  return out;
}

std::string audit_lines(const ReportInput& input) {
  std::string out;
  for (const AuditHeadline& one : input.audit)
    out += wrapped("Audit, " + printable(format_headline(one, input.dataset.info.kind)), "  ");
  if (const std::string note = quick_form_note(input.audit); !note.empty())
    out += wrapped(note, "    ");
  return out.empty() ? out : "\n" + out;
}

}  // namespace

std::string summary_text(const ReportInput& input) {
  const BenchKind kind = input.dataset.info.kind;
  std::string out = "\nCampaign " + printable(input.run.name) + ", " + bench_label(kind);
  if (!input.run.level.empty()) out += " (plant " + printable(input.run.level) + ")";
  if (!is_complete(input.run)) out += ", " + format_incomplete(input.run);
  out += "\n" + run_lines(input);
  out += headline_lines(input.headlines) + audit_lines(input);
  if (input.results.empty()) return out;
  out +=
      accuracy_lines(input.results) + repetition_lines(input) + "\n" + timing_lines(input.results);
  if (kind == BenchKind::simulated && paper::accuracies_beside(input.results).empty())
    out += "\n  All values are SIMULATED.\n";
  else if (kind == BenchKind::simulated)
    out +=
        "\n  All values except the paper's are SIMULATED; the paper measured real fabrics.\n"
        "  They are shown together for orientation and are not directly comparable.\n";
  return out;
}

}  // namespace weft::daemon
