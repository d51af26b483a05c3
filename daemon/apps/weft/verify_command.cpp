#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/analysis/handover/handover.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/campaign/resume.hpp"
#include "daemon/storage/certificate/verify.hpp"
#include "daemon/storage/recorder/recorder.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

struct VerifyArgs {
  std::filesystem::path path;
};

std::string state_text(const VerifyReport& report) {
  if (report.blank) return "The campaign file is empty: nothing was recorded.\n";
  if (report.campaign.empty()) return thousands(report.attempts) + " " + report.of + ".\n";
  return thousands(report.complete) + " of " + thousands(report.planned) +
         " planned trials are complete, in " + thousands(report.attempts) + " attempts; " +
         thousands(report.lost_samples) + " samples lost in recorded gaps" +
         (report.finished ? "" : "; the run did not finish") + ".\n";
}

/// Whether a complete campaign lacks the handover that its recipe requests: the record is right,
/// but incomplete.
bool lacks_handover(const VerifyReport& report, const std::filesystem::path& path) {
  std::error_code unseen;
  if (!report.holds() || !report.certified || report.campaign.empty() ||
      report.complete < report.planned || !std::filesystem::is_directory(path, unseen))
    return false;
  // The data set of one fabric has no handover.
  const auto journal = load_journal(path / campaign_file_name);
  if (journal && std::ranges::count(*journal, part_kind, &JournalEntry::kind) > 0) return false;
  const auto wanted = load_handover_spec(path);
  return wanted && *wanted && !(*wanted)->by_default && !is_handover_done(path);
}

/// Empty for an export that matches the present campaign.
std::string export_text(const CheckedExport& one) {
  switch (one.state) {
    case ExportState::outdated:
      return one.name + " is outdated: it has " + std::to_string(one.done) +
             " trials, the campaign has " + std::to_string(one.done_now) +
             ". Repeat weft export.\n";
    case ExportState::discarded:
      return one.name + " is older than the discard of the campaign. Remove it.\n";
    case ExportState::missing:
      return one.name + " was removed. Repeat weft export to make it again.\n";
    case ExportState::current:
    case ExportState::altered:  // a finding
      break;
  }
  return {};
}

std::string verify_text(const VerifyReport& report) {
  std::string text, exports;
  for (const CheckedExport& one : report.exports) exports += export_text(one);
  for (const VerifyProblem& problem : report.found_problems)
    text += problem.where + ": " + problem.what +
            (problem.hint.empty() ? "\n" : ". " + problem.hint + ".\n");
  if (!report.holds())
    return text + "Verification failed: " + std::to_string(report.found_problems.size()) +
           (report.found_problems.size() == 1 ? " finding.\n" : " findings.\n");
  return state_text(report) +
         (report.certified ? "Verified: every byte matches the certificate.\n"
                           : "Verified by the digests in the files; there is no certificate.\n") +
         exports;
}

void add_options(CLI::App& command, VerifyArgs& args) {
  command
      .add_option("PATH", args.path, "campaign folder, campaign file (SQLite) or data set (HDF5)")
      ->required();
}

/// Returns exit_failure if anything differs from the record.
Result<int> run_verify(const VerifyArgs& args, Console& console) {
  const auto report = verify(args.path);
  if (!report) return pass(report.error());
  const bool lacks = lacks_handover(*report, args.path);
  std::string text = verify_text(*report);
  if (lacks)
    text +=
        "The recipe requests a handover, and there is none yet. Wait for weftd, or make it with "
        "weft run --resume.\n";
  json reply = verify_json(*report);
  reply["command"] = "verify";
  reply["campaign_file"] = report->campaign.string();
  reply["dataset_file"] = report->dataset.string();
  reply["hand_over_missing"] = lacks;
  print(console, text, reply);
  return report->holds() ? exit_ok : exit_failure;
}

}  // namespace

void add_verify_command(const CommandGroup& weft) {
  weft.add<VerifyArgs>("verify", run_verify);
}

}  // namespace weft::daemon::cli
