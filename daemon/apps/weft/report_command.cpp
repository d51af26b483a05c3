#include <algorithm>
#include <nlohmann/json.hpp>
#include <ostream>

#include "daemon/analysis/report/report.hpp"
#include "daemon/analysis/tradeoff/sim/sim_page.hpp"
#include "daemon/apps/weft/campaign_report.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/apps/weft/trade_command.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/certificate/verify.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"
#include "daemon/storage/recorder/campaign_history.hpp"

namespace weft::daemon::cli {
namespace {

namespace fs = std::filesystem;

struct ReportArgs {
  std::filesystem::path folder;  ///< campaign.sqlite and dataset.h5, of weft run or weftd
  std::filesystem::path out;     ///< page; its JSON document goes beside it
  std::size_t repeats = 30;      ///< random splits, as of weft run
  std::vector<std::string> vary{"features", "learner", "slide"};  ///< of the classifier's trade
  bool no_tradeoff = false;
  bool no_audit = false;
  std::size_t tradeoff_splits = 5;
  std::vector<std::filesystem::path> beside = {};  ///< campaigns that differ in the repetition
  std::filesystem::path fidelity;  ///< table of weft trade sim; empty: no such section
};

constexpr std::uintmax_t most_report_bytes = std::uintmax_t{1} << 30;

/// Whether write_report() may write both: check_output(), and where the JSON document goes there
/// is none, or one of an older report. Nobody named that file: it may be a recipe.
Status check_report_places(const std::filesystem::path& html) {
  const std::filesystem::path document = fs::path(html).replace_extension(".json");
  for (const auto& file : {html, document})
    if (Status ok = check_output(file); !ok) return ok;
  std::error_code unseen;
  if (!std::filesystem::exists(document, unseen)) return {};
  const auto there = read_text_file(document, most_report_bytes);
  if (there && is_report_json(*there)) return {};
  return fail(
      {.code = Errc::invalid_argument,
       .where = document.string(),
       .what =
           "the report's JSON document goes beside its page, and would take the place of a file "
           "that is no report",
       .hint = "Choose another name for the page"});
}

/// Imprints, sweeps and slides that ended early have pages and commands of their own.
bool tradeoffs(const ReportArgs& args, const Dataset& dataset) {
  return !args.no_tradeoff && dataset.info.ended_early.empty() && !holds_imprints(dataset) &&
         dataset.info.factors.empty() && list_explorations(dataset).size() > 0;
}

Result<std::string> tradeoff_sections(const ReportArgs& args, const CampaignSummary& summary,
                                      Console& console) {
  TradeClassifierArgs how;
  how.datasets = {summary.dataset_file};
  how.vary = args.vary;
  how.splits = args.tradeoff_splits;
  std::string text;
  const auto report = measured_tradeoff(how, console, text);
  if (!report) return pass(report.error());
  auto sections = tradeoff_sections_html(*report);
  if (!sections) return sections;
  return "<section>\n<h2>Speed against accuracy</h2>\n<p>" + std::string(report->timing) +
         ".</p>\n</section>\n" + *sections;
}

Result<std::string> fidelity_section(const ReportArgs& args, const CampaignSummary& summary) {
  if (args.fidelity.empty() || summary.simulation.empty()) return std::string();
  const auto text = read_text_file(args.fidelity);
  if (!text) return pass(text.error());
  const auto table = sim::parse_fidelity(*text);
  if (!table) return pass(table.error(), args.fidelity.string());
  return fidelity_section_html(*table, summary.simulation.setting);
}

Status check_places(const ReportArgs& args) {
  for (const char* const name : {campaign_file_name, dataset_file_name}) {
    std::error_code none;
    if (!fs::exists(args.folder / name, none))
      return fail({.code = Errc::not_found,
                   .where = (args.folder / name).string(),
                   .what = "nothing to report of",
                   .expected = "the folder of a campaign that is over",
                   .hint = "weft dataset export makes a data set of a campaign file"});
    if (Status ok = refuse_same_file(args.folder / name, args.out); !ok) return ok;
  }
  if (args.out.extension() == ".html") return check_report_places(args.out);
  return fail({.code = Errc::invalid_argument,
               .where = "-o",
               .what = "the page's name does not say what it is",
               .expected = "a name that ends in .html",
               .got = args.out.string(),
               .hint = "The JSON document goes beside it"});
}

void add_options(CLI::App& command, ReportArgs& args) {
  command.add_option("FOLDER", args.folder, "of a campaign, by weft run or weftd")
      ->required()
      ->check(CLI::ExistingDirectory);
  command.add_option("-o,--output", args.out, "page to write (.html); .json beside it")->required();
  add_count(command, "--repeats", args.repeats, 1, 100000, "random splits for the accuracies");
  add_list(command, "--vary", args.vary, "what speed against accuracy varies, see weft trade")
      ->capture_default_str();
  add_count(command, "--trade-splits", args.tradeoff_splits, 1, 100000, "random splits of that");
  add_beside_option(command, args.beside);
  command.add_flag("--no-trade", args.no_tradeoff, "leave speed against accuracy out");
  command.add_flag("--no-audit", args.no_audit,
                   "leave out how much of the accuracy is not the material (weft audit)");
  command
      .add_option("--fidelity", args.fidelity,
                  "table of weft trade sim, such as sim/fidelity.json: what the plant's fidelity "
                  "costs")
      ->check(CLI::ExistingFile);
}

/// Nothing, and why, where it is damaged or of another data set: the report measures then.
std::optional<HandoverResult> usable_handover(const fs::path& folder,
                                              const std::string& dataset_sha256, Console& console) {
  auto found = read_handover(folder);
  if (found && !*found) return std::nullopt;
  if (found && (*found)->dataset_sha256 == dataset_sha256) return std::move(*found);
  console.err << "weft: the accuracy of the hand-over is not used: "
              << (found ? "it is of another data set, " + (*found)->dataset_sha256
                        : to_string(found.error()))
              << std::endl;
  return std::nullopt;
}

/// Errors: not_found, where the folder has no data set; verify()'s, the trade's.
Result<int> run_report(const ReportArgs& args, Console& console) {
  if (Status ok = check_places(args); !ok) return pass(ok.error());
  const auto verified = verify(args.folder);
  if (!verified) return pass(verified.error());
  const auto dataset = open_dataset(args.folder / dataset_file_name);
  if (!dataset) return pass(dataset.error());
  const auto summary = load_summary(args.folder, *verified, *dataset);
  if (!summary) return pass(summary.error());
  const auto handover = usable_handover(args.folder, verified->dataset_sha256, console);
  ReportOptions options;
  options.repeats = args.repeats;
  options.verified = &*verified;
  options.handover = handover ? &*handover : nullptr;
  options.beside = args.beside;
  if (tradeoffs(args, *dataset)) {
    auto sections = tradeoff_sections(args, *summary, console);
    const bool is_whole = summary->outcome == recipes::Outcome::complete;
    if (!sections && is_whole) return pass(sections.error());
    if (sections)
      options.tradeoff_html = std::move(*sections);
    else  // too few trials to split, perhaps
      console.err << "speed against accuracy is left out: " << to_string(sections.error()) << '\n';
  }
  const auto fidelity = fidelity_section(args, *summary);
  if (!fidelity) return pass(fidelity.error());
  options.tradeoff_html += *fidelity;
  const auto written = write_report(*summary, *dataset, args.out, options, !args.no_audit, console);
  if (!written) return pass(written.error());
  if (const auto& why = written->report.not_classified)
    console.err << "not classified: " << to_string(*why) << std::endl;
  nlohmann::json summary_json{{"command", "report"},
                              {"bench", to_string(summary->bench)},
                              {"report_html", written->html.string()},
                              {"report_json", written->json.string()},
                              {"verified", verify_json(*verified)}};
  print(console, written->report.summary + "Report: " + written->html.string() + "\n",
        summary_json);
  return verified->holds() ? exit_ok : exit_failure;
}

}  // namespace

void add_report_command(const CommandGroup& weft) {
  weft.add<ReportArgs>("report", "the report of a campaign that is over, to read or to print",
                       run_report);
}

}  // namespace weft::daemon::cli
