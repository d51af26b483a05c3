#include <nlohmann/json.hpp>

#include "daemon/analysis/handover/handover.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/campaign/resume.hpp"
#include "daemon/storage/certificate/verify.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

struct VerifyArgs {
  std::filesystem::path path;
};

std::string state_text(const VerifyReport& report) {
  if (report.blank) return "Nothing was ever written into the campaign file.\n";
  if (report.campaign.empty()) return thousands(report.attempts) + " " + report.of + ".\n";
  return thousands(report.complete) + " of " + thousands(report.planned) +
         " planned trials are complete, in " + thousands(report.attempts) + " attempts; " +
         thousands(report.lost_samples) + " samples lost in gaps on record" +
         (report.finished ? "" : "; the run did not come to its end") + ".\n";
}

/// Whether a complete campaign lacks the handover that its recipe requests: the record is right,
/// but incomplete.
bool lacks_handover(const VerifyReport& report, const std::filesystem::path& path) {
  std::error_code unseen;
  if (!report.holds() || !report.certified || report.campaign.empty() ||
      report.complete < report.planned || !std::filesystem::is_directory(path, unseen))
    return false;
  const auto wanted = load_handover_spec(path);
  return wanted && *wanted && !(*wanted)->by_default && !is_handover_done(path);
}

/// Empty for an export that matches the present campaign.
std::string export_text(const CheckedExport& one) {
  switch (one.state) {
    case ExportState::outdated:
      return one.name + " was made when " + std::to_string(one.done) +
             " trials were complete, and " + std::to_string(one.done_now) +
             " are: weft export makes it anew.\n";
    case ExportState::discarded:
      return one.name + " was made before the campaign was discarded: remove it.\n";
    case ExportState::missing:
      return one.name + " was removed: weft export makes it anew.\n";
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
    return text + "Not as recorded: " + std::to_string(report.found_problems.size()) +
           (report.found_problems.size() == 1 ? " finding.\n" : " findings.\n");
  return state_text(report) + "It holds: " +
         (report.certified ? "every byte is as certified.\n"
                           : "the files' own digests agree; there is no certificate.\n") +
         exports;
}

void add_options(CLI::App& command, VerifyArgs& args) {
  command
      .add_option("PATH", args.path,
                  "a campaign's folder, its campaign file (SQLite) or a data set (HDF5)")
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
        "Its recipe asks for a hand-over, and there is none yet: weftd is about to make it, or, "
        "where nothing works in the folder any more, weft run --resume makes it up.\n";
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
