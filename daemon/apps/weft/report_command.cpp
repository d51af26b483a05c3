#include <algorithm>
#include <nlohmann/json.hpp>
#include <ostream>

#include "daemon/analysis/report/report.hpp"
#include "daemon/analysis/tradeoff/sim/sim_page.hpp"
#include "daemon/apps/weft/campaign_report.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/apps/weft/page_files.hpp"
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
  std::filesystem::path out;     ///< page; its record is beside it
  std::filesystem::path from;    ///< a record to draw again; empty: none
  bool open = false;
  std::size_t repeats = 30;                                       ///< random splits, as of weft run
  std::vector<std::string> vary{"features", "learner", "slide"};  ///< of the classifier's trade
  bool no_tradeoff = false;
  bool no_audit = false;
  std::size_t tradeoff_splits = 5;
  std::vector<std::filesystem::path> beside = {};  ///< campaigns that differ by repetition
  std::filesystem::path fidelity;  ///< table of weft trade sim; empty: no such section
};

/// Imprints, sweeps and slides that ended early have their own pages and commands.
bool tradeoffs(const ReportArgs& args, const Dataset& dataset) {
  return !args.no_tradeoff && dataset.info.ended_early.empty() && !holds_imprints(dataset) &&
         dataset.info.factors.empty() && list_explorations(dataset).size() > 0;
}

Result<Blocks> measure_tradeoff(const ReportArgs& args, const CampaignSummary& summary,
                                Console& console) {
  TradeClassifierArgs how;
  how.datasets = {summary.dataset_file};
  how.vary = args.vary;
  how.splits = args.tradeoff_splits;
  std::string text;
  const auto report = measured_tradeoff(how, console, text);
  if (!report) return pass(report.error());
  auto sections = tradeoff_sections(*report);
  if (!sections) return sections;
  return section("Speed against accuracy", daemon::paragraph(escape(report->timing) + ".")) +
         *sections;
}

Result<Blocks> load_fidelity(const ReportArgs& args, const CampaignSummary& summary) {
  if (args.fidelity.empty() || summary.simulation.empty()) return Blocks();
  const auto text = read_text_file(args.fidelity);
  if (!text) return pass(text.error());
  const auto table = sim::parse_fidelity(*text);
  if (!table) return pass(table.error(), args.fidelity.string());
  return fidelity_section(*table, summary.simulation.setting);
}

Status check_ending(const fs::path& page) {
  if (page.extension() == ".html") return {};
  return fail({.code = Errc::invalid_argument,
               .where = "-o",
               .what = "name of the page has another ending",
               .expected = "a name that ends in .html",
               .got = page.string(),
               .hint = "Choose a name that ends in .html; the JSON record is written beside it"});
}

Status check_places(const ReportArgs& args) {
  for (const char* const name : {campaign_file_name, dataset_file_name}) {
    std::error_code none;
    if (!fs::exists(args.folder / name, none))
      return fail({.code = Errc::not_found,
                   .where = (args.folder / name).string(),
                   .what = "file missing for a report",
                   .expected = "the folder of an ended campaign",
                   .hint = "Make a data set of a campaign file with weft dataset export"});
    if (Status ok = refuse_same_file(args.folder / name, args.out); !ok) return ok;
  }
  if (Status ok = check_ending(args.out); !ok) return ok;
  return check_page(std::span<const fs::path>{}, args.out);
}

void add_options(CLI::App& command, ReportArgs& args) {
  command.add_option("FOLDER", args.folder, "campaign folder of weft run or weftd")
      ->check(CLI::ExistingDirectory);
  command.add_option("-o,--output", args.out,
                     "write the page to this file (.html), and its record beside it (.json)");
  command
      .add_option("--from", args.from,
                  "draw the page again from this JSON record instead of FOLDER")
      ->check(CLI::ExistingFile);
  command.add_flag("--open", args.open, "show the page in the browser (xdg-open)");
  add_count(command, "--repeats", args.repeats, 1, 100000,
            "evaluate on this number of random splits");
  add_list(command, "--vary", args.vary,
           "vary these in speed against accuracy (comma-separated: features, learner, ...)")
      ->capture_default_str();
  add_count(command, "--trade-splits", args.tradeoff_splits, 1, 100000,
            "use this number of random splits for speed against accuracy");
  add_beside_option(command, args.beside);
  command.add_flag("--no-trade", args.no_tradeoff, "leave out speed against accuracy");
  command.add_flag("--no-audit", args.no_audit, "leave out the quick audit (see weft audit)");
  command
      .add_option("--fidelity", args.fidelity,
                  "add the cost of fidelity from a table of weft trade sim")
      ->check(CLI::ExistingFile);
}

/// Empty, with a reason on `err`, if it is damaged or of another data set: the report then
/// measures.
std::optional<HandoverResult> usable_handover(const fs::path& folder,
                                              const std::string& dataset_sha256, Console& console) {
  auto found = read_handover(folder);
  if (found && !*found) return std::nullopt;
  if (found && (*found)->dataset_sha256 == dataset_sha256) return std::move(*found);
  console.err << "weft: accuracy of the handover not used: "
              << (found ? "it belongs to another data set, " + (*found)->dataset_sha256
                        : to_string(found.error()))
              << std::endl;
  return std::nullopt;
}

/// Errors: not_found if the folder has no data set; those of verify() and of the trade-off.
Result<int> report_of_folder(const ReportArgs& args, Console& console) {
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
  if (handover) options.handover_files = load_handover_files(args.folder);
  options.beside = args.beside;
  if (tradeoffs(args, *dataset)) {
    auto sections = measure_tradeoff(args, *summary, console);
    const bool is_whole = summary->outcome == recipes::Outcome::complete;
    if (!sections && is_whole) return pass(sections.error());
    if (sections)
      options.tradeoff = std::move(*sections);
    else  // for example too few trials to split
      console.err << "weft: speed against accuracy left out: " << to_string(sections.error())
                  << '\n';
  }
  auto fidelity = load_fidelity(args, *summary);
  if (!fidelity) return pass(fidelity.error());
  options.fidelity = std::move(*fidelity);
  const auto written = write_report(*summary, *dataset, args.out, options, !args.no_audit, console);
  if (!written) return pass(written.error());
  if (const auto& why = written->report.not_classified)
    console.err << "weft: campaign not classified: " << to_string(*why) << std::endl;
  nlohmann::json summary_json{{"command", "report"},
                              {"bench", to_string(summary->bench)},
                              {"report_html", written->html.string()},
                              {"report_json", written->json.string()},
                              {"verified", verify_json(*verified)}};
  print(console, written->report.summary + "Report: " + written->html.string() + "\n",
        summary_json);
  return verified->holds() ? exit_ok : exit_failure;
}

/// Page of a record that is drawn again: -o, else beside it.
fs::path page_of(const ReportArgs& args) {
  return args.out.empty() ? fs::path(args.from).replace_extension(".html") : args.out;
}

Result<int> report_from_record(const ReportArgs& args, Console& console) {
  const fs::path html = page_of(args);
  if (!args.folder.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = "--from",
                 .what = "option cannot be used with FOLDER",
                 .got = args.folder.string(),
                 .hint = "Give either FOLDER or --from"});
  if (Status ok = check_ending(html); !ok) return pass(ok.error());
  if (Status ok = check_output(args.from, html); !ok) return pass(ok.error());
  if (Status ok = draw_record(args.from, html); !ok) return pass(ok.error());
  print(console, "Report: " + html.string() + "\n",
        {{"command", "report"}, {"report_html", html.string()}, {"from", args.from.string()}});
  return exit_ok;
}

/// Errors: those of the report; invalid_argument without a folder or a record; those of
/// open_page().
Result<int> run_report(const ReportArgs& args, Console& console) {
  if (args.from.empty() && (args.folder.empty() || args.out.empty()))
    return fail({.code = Errc::invalid_argument,
                 .what = "input or output of the report missing",
                 .expected = "FOLDER and -o PAGE.html, or --from RECORD.json",
                 .hint = "Run `weft report --help` for both forms"});
  const auto done =
      args.from.empty() ? report_of_folder(args, console) : report_from_record(args, console);
  if (!done || !args.open) return done;
  if (Status ok = open_page(page_of(args)); !ok) return pass(ok.error());
  return done;
}

}  // namespace

void add_report_command(const CommandGroup& weft) {
  weft.add<ReportArgs>("report", run_report);
}

}  // namespace weft::daemon::cli
