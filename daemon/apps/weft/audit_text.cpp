#include "daemon/apps/weft/audit_text.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>

#include "daemon/apps/weft/console.hpp"

namespace weft::daemon::cli {
namespace {

using classifier::AuditVerdict;
using classifier::CannotTell;
using classifier::ProbeFigure;
using nlohmann::json;

/// Meaning of a named probe, and the next step to resolve it.
struct Meaning {
  std::string_view probe;
  std::string_view confounded;  ///< the quantity confounded with the label
  std::string_view next;
};

constexpr std::array meanings = {
    Meaning{"phase S", "sensor reading at rest",
            "Lift and place the probe again for every trial. Mount each label several times, in "
            "mixed order."},
    Meaning{"pad pattern", "mounting",
            "Mount each label at least three times, in mixed order. Name the mounting (column "
            "group of a manifest), and leave out whole mountings: --group mounting, or "
            "--groups-are mounting for an import."},
    Meaning{"durations", "length of the recordings",
            "Record all trials equally long, or evaluate with --window-s."},
    Meaning{"order and time", "time of recording",
            "Record the labels in random order (\"order\": {\"kind\": \"randomised\"}), each in "
            "every session. Otherwise drift of the sensor counts as the label."},
    Meaning{"lost frames", "lost frames",
            "Repair the connection (weft doctor) and record the trials with lost frames again."},
    Meaning{"force error", "error of the force",
            "Check the force control at this speed. Record some trials of every label at several "
            "forces, so that force does not depend on the label."},
    Meaning{"group", "group",
            "Record every label in every group (session, piece, person), and leave out whole "
            "groups: --leave-one-group-out."},
    Meaning{"level", "level of the signal",
            "Record each label at several forces and gains, and compare \"without level\"."},
};

const Meaning& meaning_of(const std::string& probe) {
  return *std::ranges::find(meanings, std::string_view(probe), &Meaning::probe);
}

/// The column name of a column probe; empty for other probes.
std::string column_of(const ProbeFigure& one) {
  return one.name.starts_with(column_probe) ? one.name.substr(column_probe.size()) : "";
}

/// Name of the quantity that is confounded with the label.
std::string confounded_by(const ProbeFigure& one) {
  const std::string column = column_of(one);
  return column.empty() ? std::string(meaning_of(one.name).confounded) : column;
}

std::string next_step(const ProbeFigure& one) {
  const std::string column = column_of(one);
  if (column.empty()) return std::string(meaning_of(one.name).next);
  return "Record every label with every " + column + ", and test across them: --group " + column +
         " --leave-one-group-out.";
}

bool is_contact(const ProbeFigure& one) {
  return one.name == "phase S" || one.name == "pad pattern";
}

/// Origin of a probe's share. Level, force error and contact also differ with the material. Splits
/// that keep mountings (pieces) whole gain nothing from the common traits of one mounting (piece).
enum class Carrier { nuisance, undecided, material };

Carrier carrier_of(const AuditReport& report, const ProbeFigure& one) {
  if (one.name == "level" || one.name == "force error") return Carrier::undecided;
  if (!is_contact(one)) return Carrier::nuisance;
  const auto is_whole = [&](std::string_view name) {
    return std::ranges::any_of(report.tables.columns, [name](const AuditColumn& column) {
      return column.name == name && column.whole;
    });
  };
  if (is_whole("piece")) return Carrier::material;
  return is_whole("mounting") ? Carrier::undecided : Carrier::nuisance;
}

/// Named probes of this carrier, in descending order of share.
std::vector<const ProbeFigure*> named_probes(const AuditReport& report, Carrier carrier) {
  std::vector<const ProbeFigure*> out;
  if (report.figures)
    for (const ProbeFigure& one : report.figures->probes)
      if (one.named && carrier_of(report, one) == carrier) out.push_back(&one);
  std::ranges::stable_sort(out, std::ranges::greater{}, &ProbeFigure::share);
  return out;
}

std::string verdict_code(const AuditReport& report) {
  if (!report.figures || report.figures->why != CannotTell::none) return "cannot_tell";
  if (!named_probes(report, Carrier::nuisance).empty()) return "confounded";
  return named_probes(report, Carrier::undecided).empty() ? "no_sign" : "cannot_tell";
}

/// Reason for a missing result: a code for programs, a sentence, and the data to record next.
struct Obstacle {
  std::string code, text, next;
};

Obstacle obstacle_of(const AuditReport& report) {
  const CannotTell why = report.figures ? report.figures->why : CannotTell::none;
  if (!report.figures)
    return {"one_recording", "each label has only one recording or one group",
            "Record each label at least five times, in mixed order, in at least two groups."};
  if (why == CannotTell::too_few_units)
    return {
        "too_few_units",
        std::to_string(report.figures->units) + " independent units are too few for permutations",
        "Record more groups: at least five, each with every label."};
  if (why == CannotTell::full_at_chance)
    return {"full_at_chance", "the accuracy of the full features does not exceed chance",
            "Record more trials, or use other features."};
  if (why == CannotTell::no_probe)
    return {"no_probe", "the data set has no quantity that could be confounded with the label",
            "Record times, force and mounting with the trials, as weft run does."};
  if (verdict_code(report) == "cannot_tell")
    return {"undecided", "the material itself may be the cause", ""};
  return {};
}

std::string share_text(double share) {
  return share >= 1.0 ? "All" : percent(share, 0) + " %";
}

std::string had_from(const ProbeFigure& one) {
  return share_text(one.share) + " of the accuracy above chance can be reached with " +
         (one.name == "phase S" ? "phase S alone" : "the " + one.name + " alone");
}

/// Accuracy of the features without level and pattern.
std::string remaining_text(const AuditReport& report) {
  const auto at =
      std::ranges::find(report.beside, "without level and pattern", &BesideFigure::name);
  if (at == report.beside.end()) return {};
  return "Without level and pattern the features reach " + percent(at->reached.accuracy, 1) +
         " %, because of the material or other properties of one mounting or piece.";
}

/// For slides: of mounting and piece, those that the data set does not name.
std::vector<std::string> unnamed_columns(const AuditReport& report) {
  std::vector<std::string> out;
  if (report.tables.rows != "trials") return out;
  for (const char* const name : {"mounting", "piece"})
    if (std::ranges::find(report.tables.columns, name, &AuditColumn::name) ==
        report.tables.columns.end())
      out.emplace_back(name);
  return out;
}

std::string undecided_text(const ProbeFigure& one) {
  if (one.name == "level") return ", because of the material, or of gain, distance and force.";
  if (one.name == "force error")
    return ", because of the material, which affects the force loop, or of the loop itself.";
  return ", with whole mountings left out, because of the material or of its single piece.";
}

std::vector<std::string> verdict_sentences(const AuditReport& report) {
  std::vector<std::string> out;
  const auto confounds = named_probes(report, Carrier::nuisance);
  const auto contact = named_probes(report, Carrier::undecided);
  for (const ProbeFigure* one : confounds)
    out.push_back(had_from(*one) + ": label and " + confounded_by(*one) + " are confounded.");
  for (const ProbeFigure* one : contact) out.push_back(had_from(*one) + undecided_text(*one));
  for (const ProbeFigure* one : named_probes(report, Carrier::material))
    out.push_back(had_from(*one) + ", with whole pieces left out: a property of the material.");
  const std::string code = verdict_code(report);
  if (code == "no_sign")
    out.emplace_back("No confound found by these probes.");
  else if (code == "cannot_tell")
    out.push_back("Undecided: " + obstacle_of(report).text + ".");
  if (const std::string text = remaining_text(report);
      !text.empty() && !(confounds.empty() && contact.empty()))
    out.push_back(text);
  for (const std::string& column : report.single_columns)
    out.push_back("The accuracy for another " + column + " is unknown: each label has only one.");
  for (const std::string& column : unnamed_columns(report))
    out.push_back("The accuracy for another " + column +
                  " is unknown: the data set does not record it.");
  return out;
}

std::vector<std::string> next_steps(const AuditReport& report) {
  std::vector<std::string> out;
  for (const ProbeFigure* one : named_probes(report, Carrier::nuisance))
    out.push_back(next_step(*one));
  const auto undecided = named_probes(report, Carrier::undecided);
  for (const ProbeFigure* one : undecided)
    if (!is_contact(*one)) out.push_back(next_step(*one));
  if (std::ranges::any_of(undecided, [](const ProbeFigure* one) { return is_contact(*one); }))
    out.emplace_back(
        "Record each label on several pieces (\"piece\": \"each_label_split\"), and leave out "
        "pieces: weft audit --group piece.");
  if (const std::string next = obstacle_of(report).next; !next.empty()) out.push_back(next);
  for (const std::string& column : report.single_columns)
    out.push_back(
        "Record each label with another " + column +
        (column == "mounting" || column == "piece" ? " (\"repetition\" in the recipe)." : "."));
  return out;
}

std::vector<std::string> probe_row(const ProbeFigure& one) {
  return {one.name + (one.named ? " *" : ""),
          std::to_string(one.columns),
          percent(one.reached.accuracy, 1),
          percent(one.chance, 1),
          percent(one.share, 0),
          fixed(one.p, 3),
          std::string(classifier::to_string(one.reached.learner))};
}

double beside_share(const classifier::AuditFigures& figures, const BesideFigure& one) {
  const double above = figures.full.accuracy - figures.chance;
  return above > 0.0 ? (one.reached.accuracy - figures.chance) / above : 0.0;
}

std::string table_text(const AuditReport& report) {
  if (!report.figures) return {};
  const classifier::AuditFigures& figures = *report.figures;
  Table table;
  table.row(
      {"labels predicted from", "columns", "accuracy %", "chance %", "share %", "p", "learner"});
  table.row({"full features", std::to_string(report.tables.full.names.size()),
             percent(figures.full.accuracy, 1), percent(figures.chance, 1), "100", "",
             std::string(classifier::to_string(figures.full.learner))});
  for (const ProbeFigure& one : figures.probes) table.row(probe_row(one));
  for (const BesideFigure& one : report.beside)
    table.row({one.name, "", percent(one.reached.accuracy, 1), "",
               percent(beside_share(figures, one), 0), "",
               std::string(classifier::to_string(one.reached.learner))});
  std::string out = table.text();
  for (const auto& [name, why] : report.tables.absent)
    out += "  not tried: " + name + " (" + why + ")\n";
  return out + wrapped(
                   "* named: p at most 0.02 and share at least 25 %. p is family-wise over all "
                   "probes: " +
                       std::to_string(figures.permutations) + " permutations with LDA, " +
                       (figures.tree_permutations == 0
                            ? "none with trees, as they could not change the verdict"
                            : std::to_string(figures.tree_permutations) + " with trees") +
                       "; " + std::to_string(figures.units) + " units (" +
                       (figures.units_of_groups ? "a label in a group" : "recordings") +
                       ") exchange labels. Accuracy: the better of LDA and trees.",
                   "  ");
}

json reached_json(const classifier::Reached& reached) {
  return {{"accuracy", reached.accuracy},
          {"learner", classifier::to_string(reached.learner)},
          {"ci95", {reached.ci95.low, reached.ci95.high}},
          {"ci95_method", reached.ci95.method}};
}

json probes_json(const AuditReport& report) {
  json out = json::array();
  if (!report.figures) return out;
  for (const ProbeFigure& one : report.figures->probes) {
    json probe = reached_json(one.reached);
    probe.update({{"name", one.name},
                  {"columns", one.columns},
                  {"chance", one.chance},
                  {"share", one.share},
                  {"p", one.p},
                  {"named", one.named}});
    out.push_back(std::move(probe));
  }
  return out;
}

json verdict_json(const AuditReport& report) {
  const auto names = [&](Carrier carrier) {
    json out = json::array();
    for (const ProbeFigure* one : named_probes(report, carrier)) out.push_back(one->name);
    return out;
  };
  const std::string why = obstacle_of(report).code;
  return {{"code", verdict_code(report)},
          {"why", why.empty() ? json() : json(why)},
          {"confounds", names(Carrier::nuisance)},
          {"undecided", names(Carrier::undecided)},
          {"material", names(Carrier::material)},
          {"single", report.single_columns},
          {"unnamed", unnamed_columns(report)},
          {"text", verdict_sentences(report)},
          {"next", next_steps(report)}};
}

}  // namespace

std::string obstacle_text(const AuditReport& report) {
  return obstacle_of(report).text;
}

std::string audit_text(const AuditReport& report) {
  const classifier::FeatureMatrix& full = report.tables.full;
  const std::set<std::string> labels(full.labels.begin(), full.labels.end());
  std::string out = report.banner + report.dataset.string() + " (" +
                    std::string(to_string(report.kind)) + "), " + thousands(full.size()) + " " +
                    report.tables.rows + ", " + std::to_string(labels.size()) + " labels; " +
                    report.split_text + "\n" + table_text(report);
  out += "Verdict\n";
  for (const std::string& sentence : verdict_sentences(report)) out += wrapped(sentence, "  ");
  if (const auto steps = next_steps(report); !steps.empty()) {
    out += "Record next\n";
    for (const std::string& step : steps) out += wrapped("- " + step, "  ");
  }
  return out;
}

json audit_json(const AuditReport& report) {
  const classifier::FeatureMatrix& full = report.tables.full;
  json beside = json::array(), absent = json::array();
  for (const BesideFigure& one : report.beside) {
    json figure = reached_json(one.reached);
    figure["name"] = one.name;
    figure["share"] = beside_share(*report.figures, one);
    beside.push_back(std::move(figure));
  }
  for (const auto& [name, why] : report.tables.absent)
    absent.push_back({{"name", name}, {"why", why}});
  json out{{"command", "audit"},
           {"dataset", report.dataset.string()},
           {"dataset_sha256", report.sha256},
           {"bench", to_string(report.kind)},
           {"rows", full.size()},
           {"row", report.tables.rows},
           {"labels", std::set<std::string>(full.labels.begin(), full.labels.end())},
           {"splits", report.splits},
           {"split", report.split_text},
           {"probes", probes_json(report)},
           {"not_tried", absent},
           {"beside", beside},
           {"verdict", verdict_json(report)}};
  if (!report.figures) return out;
  const classifier::AuditFigures& figures = *report.figures;
  out["full"] = reached_json(figures.full);
  out["chance"] = figures.chance;
  out["permutations"] = {{"lda", figures.permutations},
                         {"trees", figures.tree_permutations},
                         {"units", figures.units},
                         {"unit", figures.units_of_groups ? "label in a group" : "recording"}};
  return out;
}

}  // namespace weft::daemon::cli
