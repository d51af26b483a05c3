#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <tuple>

#include "daemon/apps/weft/audit_text.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/evaluate_outcome.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/apps/weft/quick_audit.hpp"
#include "daemon/storage/dataset/group_columns.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"
#include "daemon/storage/recordings/recording_set.hpp"

namespace weft::daemon::cli {
namespace {

constexpr std::size_t audit_parts = 5;
constexpr double recording_window_s = 2.0;  // as in the 2023 paper

struct AuditArgs {
  std::filesystem::path dataset;
  TrialChoice trials;
  SplitChoice split;
  std::string groups_are;  ///< "mounting", "piece" or empty: meaning of the groups of an import
  classifier::AuditOptions options;
  std::size_t repeats = 5;
};

void add_options(CLI::App& command, AuditArgs& args) {
  command.add_option("DATASET", args.dataset, "data set or vibration recordings (HDF5)")
      ->required();
  command.add_option("--exploration", args.trials.exploration,
                     "use only this exploration, such as M1");
  add_group_option(command, args.trials.group);
  command
      .add_option("--groups-are", args.groups_are,
                  "treat the groups of an import as mountings or pieces")
      ->check(CLI::IsMember({"mounting", "piece"}));
  add_split_options(command, args.split, "train on this share of each label's trials, such as 0.4",
                    "test each group once, with all others as training");
  add_count(command, "--repeats", args.repeats, 1, 1000, "use this number of random splits");
  add_count(command, "--permutations", args.options.permutations, 99, 100000,
            "permute the labels N times with LDA, and fewer times with trees");
  command
      .add_option("--seed", args.options.seed,
                  "set the seed of permutations, random splits and trees")
      ->check(seed_problem)
      ->capture_default_str();
  add_count(command, "--threads", args.options.threads, 0, 1024,
            "use this number of threads; 0: one per processor core");
}

bool has_taxels(const Dataset& dataset) {
  return dataset.trials.empty() || dataset.trials.front().taxels > 0;
}

Status load_recordings(const AuditArgs& args, AuditReport& out) {
  auto set = open_recordings(args.dataset, args.trials.exploration, false);
  if (!set) return pass(set.error());
  out.sha256 = recordings_sha256(*set);
  if (auto ok = set_groups(*set, args.trials.group); !ok)
    return pass(ok.error(), args.dataset.string());
  auto tables = recording_tables(*set, recording_window_s);
  if (!tables) return pass(tables.error(), args.dataset.string());
  out.tables = std::move(*tables);
  out.kind = set->kind;
  out.banner = bench_banner(set->kind);
  return {};
}

Status load_tables(const AuditArgs& args, AuditReport& out) {
  out.dataset = args.dataset;
  if (is_recordings_file(args.dataset)) return load_recordings(args, out);
  const auto dataset = open_dataset(args.dataset);
  if (!dataset) return pass(dataset.error());
  if (!has_taxels(*dataset)) return load_recordings(args, out);
  if (holds_imprints(*dataset) && !args.trials.exploration.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = args.dataset.string() + ": --exploration",
                 .what = "option not possible for imprints",
                 .got = args.trials.exploration,
                 .hint = "Leave the option out"});
  auto chosen = load_trials(args.dataset, args.trials, true);
  if (!chosen) return pass(chosen.error());
  auto tables = chosen->imprint_plan ? imprint_tables(*chosen) : slide_tables(*chosen);
  if (!tables) return pass(tables.error(), args.dataset.string());
  out.tables = std::move(*tables);
  out.sha256 = chosen->sha256;
  out.kind = chosen->dataset.info.kind;
  out.banner = bench_banner(chosen->dataset.info);
  return {};
}

/// Errors: invalid_argument, if the data set names mountings (pieces) itself.
Status name_groups(const AuditArgs& args, AuditTables& tables) {
  if (args.groups_are.empty()) return {};
  if (std::ranges::find(tables.columns, args.groups_are, &AuditColumn::name) !=
      tables.columns.end())
    return fail({.code = Errc::invalid_argument,
                 .where = "--groups-are",
                 .what = "data set has its own column " + args.groups_are,
                 .hint = "Use --group " + args.groups_are});
  tables.columns.push_back({args.groups_are, tables.full.groups, false});
  return {};
}

/// Whether complete groups can be left out: every label is in at least two.
bool can_leave_groups_out(const classifier::FeatureMatrix& matrix) {
  std::map<std::string, std::set<std::string>> groups;
  for (std::size_t r = 0; r < matrix.size(); ++r) groups[matrix.labels[r]].insert(matrix.groups[r]);
  return std::ranges::all_of(groups, [](const auto& of_label) {
    return of_label.second.size() > 1 && !of_label.second.contains("");
  });
}

bool has_split(const SplitChoice& choice) {
  return !choice.test_groups.empty() || choice.leave_one_group_out || choice.train_fraction != 0.0;
}

/// The requested splits, else splits in parts; records the method in the report.
Result<std::vector<classifier::Split>> choose_splits(const AuditArgs& args, AuditReport& out) {
  if (has_split(args.split)) {
    EvaluateArgs given;
    static_cast<SplitChoice&>(given) = args.split;
    given.repeats = args.repeats;
    given.training.seed = args.options.seed;
    auto splits = make_splits(given, out.tables.full);
    if (!splits) return pass(splits.error());
    out.split_text = std::to_string(splits->size()) + " splits as requested";
    return splits;
  }
  const bool by_group = can_leave_groups_out(out.tables.full);
  auto splits = classifier::split_in_parts(out.tables.full, by_group, audit_parts);
  out.split_text = splits.empty()
                       ? "no split possible"
                       : std::to_string(splits.size()) + "-fold cross-validation over whole " +
                             (by_group ? "groups" : "recordings");
  return splits;
}

Status add_beside(const AuditArgs& args, std::span<const classifier::Split> splits,
                  AuditReport& out) {
  const auto add = [&](const std::string& name, const classifier::FeatureMatrix& matrix,
                       std::span<const classifier::Split> on) -> Status {
    const auto reached = classifier::reach(matrix, on, args.options);
    if (!reached) return pass(reached.error(), name);
    out.beside.push_back({name, *reached});
    return {};
  };
  for (const classifier::Probe& changed : out.tables.changed)
    if (auto ok = add(changed.name, changed.features, splits); !ok) return ok;
  for (const AuditColumn& column : out.tables.columns) {
    classifier::FeatureMatrix matrix = out.tables.full;
    if (column.of_row == matrix.groups) continue;  // the splits use these groups already
    matrix.groups = column.of_row;
    const auto across = classifier::split_in_parts(matrix, true, audit_parts);
    if (across.empty())
      out.single_columns.push_back(column.name);
    else if (auto ok = add("across " + column.name + "s", matrix, across); !ok)
      return ok;
  }
  return {};
}

enum class AuditForm { whole, quick };  // quick: only LDA is permuted, no comparisons

Status measure_audit(const AuditArgs& args, AuditForm form,
                     std::span<const classifier::Split> splits, AuditReport& out) {
  note_whole_columns(out.tables.columns, out.tables.full, splits);
  if (!classifier::groups_on_both_sides(splits, out.tables.full.groups).empty())
    add_group_probe(out.tables);
  add_column_probes(out.tables);
  classifier::AuditOptions options = args.options;
  options.tree_permutations =
      form == AuditForm::quick ? 0 : std::max<std::size_t>(99, options.permutations / 2);
  auto figures = classifier::audit(out.tables.full, out.tables.probes, splits, options);
  if (!figures) return pass(figures.error(), args.dataset.string());
  out.figures = std::move(*figures);
  if (form == AuditForm::quick) return {};
  if (auto ok = add_beside(args, splits, out); !ok) return pass(ok.error(), args.dataset.string());
  return {};
}

Result<AuditReport> compute_audit(const AuditArgs& args, AuditForm form) {
  AuditReport out;
  if (auto ok = load_tables(args, out); !ok) return pass(ok.error());
  if (auto ok = name_groups(args, out.tables); !ok) return pass(ok.error(), args.dataset.string());
  const auto splits = choose_splits(args, out);
  if (!splits) return pass(splits.error(), args.dataset.string());
  out.splits = splits->size();
  if (!splits->empty())
    if (auto ok = measure_audit(args, form, *splits, out); !ok) return pass(ok.error());
  return out;
}

Result<int> run_audit(const AuditArgs& args, Console& console) {
  const auto report = compute_audit(args, AuditForm::whole);
  if (!report) return pass(report.error());
  print(console, audit_text(*report), audit_json(*report));
  return exit_ok;
}

std::optional<StrongestProbe> find_strongest(const AuditReport& report) {
  if (!report.figures || report.figures->probes.empty()) return std::nullopt;
  const auto order = [](const classifier::ProbeFigure& one) {
    return std::tuple(one.named, one.share);
  };
  const auto strongest = std::ranges::max_element(report.figures->probes, {}, order);
  return StrongestProbe{strongest->name, strongest->reached.accuracy,   strongest->share,
                        strongest->p,    report.figures->full.accuracy, strongest->chance,
                        strongest->named};
}

AuditHeadline make_headline(const std::string& exploration, const Result<AuditReport>& report) {
  AuditHeadline out{exploration, {}, {}, {}};
  if (!report) {
    out.reason = to_string(report.error());
    return out;
  }
  const nlohmann::json verdict = audit_json(*report)["verdict"];
  out.verdict = verdict["code"];
  if (verdict["why"].is_string()) out.why = verdict["why"];
  if (out.verdict == "cannot_tell") out.reason = obstacle_text(*report);
  out.probe = find_strongest(*report);
  if (report->figures) out.permutations = report->figures->permutations;
  return out;
}

}  // namespace

std::vector<AuditHeadline> audit_quickly(const std::filesystem::path& file,
                                         const Dataset& dataset) {
  std::vector<AuditHeadline> out;
  if (!dataset.info.ended_early.empty() || !dataset.info.factors.empty())
    return {
        {"all", "", "",
         "trials that a live vote ended early, or cells of a sweep, cannot be audited together"}};
  // Imprints are one exploration: the explorations of their recipe are press forces.
  const std::vector<std::string> explorations =
      holds_imprints(dataset) ? std::vector<std::string>{"imprints"} : list_explorations(dataset);
  for (const std::string& exploration : explorations) {
    AuditArgs args;
    args.dataset = file;
    if (!holds_imprints(dataset)) args.trials.exploration = exploration;
    args.options.permutations = 99;  // the minimum for p = 2 %
    out.push_back(make_headline(exploration, compute_audit(args, AuditForm::quick)));
  }
  return out;
}

void add_audit_command(const CommandGroup& weft) {
  weft.add<AuditArgs>("audit", run_audit);
}

}  // namespace weft::daemon::cli
