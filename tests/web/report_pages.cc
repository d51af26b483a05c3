// Builds pages of every kind from made-up results with the real builders: report_pages FOLDER. For
// figures.mjs, with 2, 3, 17 and 50 classes and labels of 1 to 40 characters.

#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "daemon/analysis/calibration/calibration_page.hpp"
#include "daemon/analysis/design/design_page.hpp"
#include "daemon/analysis/handover/train.hpp"
#include "daemon/analysis/imprint/tables.hpp"
#include "daemon/analysis/report/evaluation_page.hpp"
#include "daemon/analysis/report/report.hpp"
#include "daemon/analysis/tradeoff/measure_classifier.hpp"
#include "daemon/analysis/tradeoff/measure_vibro.hpp"
#include "daemon/analysis/tradeoff/sim/sim_page.hpp"
#include "daemon/pages/document/document.hpp"
#include "sim/plant/fidelity/table.hpp"

namespace {

using namespace weft;
using namespace weft::daemon;

using Labels = std::vector<std::string>;

/// Labels of 1 to 40 characters; some share a long beginning, like "sandpaper_60" and
/// "sandpaper_80".
Labels make_labels(std::size_t count) {
  Labels out;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t length = 1 + i * 39 / std::max<std::size_t>(1, count - 1);
    const std::string number = std::to_string(i);
    std::string label = i % 3 == 0 ? std::string("sandpaper_of_a_very_long_name_indeed_")
                        : i % 3 == 1
                            ? std::string("WWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWW")
                            : std::string("G\u00E4nsel\u00FCmmchen <&> im weiten Feld daheim ");
    label = label.substr(0, length > number.size() ? length - number.size() : 0);
    while (!is_utf8(label)) label.pop_back();
    out.push_back(label + number);
  }
  return out;
}

classifier::Confusion confusion_of(const Labels& labels) {
  classifier::Confusion out(labels);
  for (std::size_t t = 0; t < labels.size(); ++t)
    for (std::size_t p = 0; p < labels.size(); ++p)
      out.at(t, p) = t == p ? 120 + t : (t * 7 + p * 3) % 5 == 0 ? (t + p) % 9 : 0;
  return out;
}

classifier::Interval interval(double low, double high) {
  return {low, high, "made up"};
}

/// An evaluation of two labels that differ in one feature; it has cores, for the table of them.
const classifier::Evaluation& small_evaluation() {
  static const classifier::Evaluation made = [] {
    classifier::FeatureMatrix matrix;
    matrix.names = {"one", "two"};
    matrix.values = classifier::Matrix(12, 2);
    for (std::size_t row = 0; row < 12; ++row) {
      matrix.labels.push_back(row % 2 == 0 ? "a" : "b");
      matrix.groups.push_back(std::to_string(row / 2));
      matrix.files.push_back(std::to_string(row));
      matrix.values(row, 0) = static_cast<double>(10 * (row % 2) + row / 2);
      matrix.values(row, 1) = static_cast<double>(row % 3);
    }
    const auto splits = classifier::stratified_splits(matrix.labels, 0.5, 1, 1);
    if (!splits) throw std::runtime_error(to_string(splits.error()));
    auto made_up = classifier::evaluate(matrix, *splits, classifier::Learner::pvalue, {});
    if (!made_up) throw std::runtime_error(to_string(made_up.error()));
    return std::move(*made_up);
  }();
  return made;
}

classifier::Evaluation evaluation_of(const Labels& labels, double accuracy) {
  classifier::Evaluation out = small_evaluation();
  out.confusion = confusion_of(labels);
  out.splits.resize(5);
  out.accuracy = accuracy;
  out.ci95 = interval(accuracy - 0.08, std::min(1.0, accuracy + 0.05));
  out.train_s = 1.5;
  out.test_s_per_sample = 2e-4;
  classifier::CalibrationCheck check;
  for (int b = 0; b < 10; ++b) {
    check.reliability.bins.push_back(
        {b / 10.0, (b + 1) / 10.0, static_cast<std::size_t>(7 * b * b), b / 10.0 + 0.05, b / 10.5});
    check.bins.push_back({3, interval(b / 12.0, b / 9.5)});
  }
  check.recordings = 40;
  check.calibration_error_ci95 = interval(0.02, 0.07);
  out.calibration = check;
  return out;
}

TrialRecord record_of(const std::string& label, std::uint32_t index) {
  TrialRecord out;
  out.spec.index = index;
  out.spec.label = label;
  out.spec.exploration = "M1";
  out.spec.repetition = 1;
  for (int i = 0; i < 400; ++i) {
    out.wrench.t_ns.push_back(static_cast<std::int64_t>(i) * 20'000'000);
    for (const double value : {0.3, 0.4, i < 100 ? 2.0 : 5.0 + 0.1 * (i % 3), 0.0, 0.0, 0.0})
      out.wrench.quanta.push_back(static_cast<std::int32_t>(value * 1e6));
  }
  out.quality.force_rms_error_n = 0.1;
  return out;
}

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

constexpr const char* recipe = R"({"schema_version": 1, "name": "made", "seed": 7,
  "fabrics": ["wool"], "repetitions": 2, "explorations": {"M1": {"phases": [
  {"phase": "S", "duration_s": 1}, {"phase": "P", "force_N": 5, "force_band_N": 0.5, "duration_s": 2},
  {"phase": "M", "force_N": 5, "force_band_N": 0.5, "speed_mm_s": 2, "path": [{"dx_mm": 0, "dy_mm": 20}]},
  {"phase": "E", "duration_s": 1}]}}})";

Dataset dataset_of(const Labels& labels, const std::string& rig) {
  Dataset out;
  out.info.kind = BenchKind::simulated;
  out.info.name = "made-up";
  out.info.recipe_json = recipe;
  out.info.rig_json = rig;
  for (const std::string& label : labels) {
    TrialRecord record = record_of(label, static_cast<std::uint32_t>(out.trials.size()));
    classifier::Trial trial;
    trial.label = label;
    trial.taxels = 16;
    for (int i = 0; i < 296; ++i) {
      record.t_ns.push_back(static_cast<std::int64_t>(i) * 27'000'000);
      trial.phase.push_back(i < 37    ? Phase::rest
                            : i < 110 ? Phase::press
                            : i < 240 ? Phase::motion
                                      : Phase::end);
      for (std::size_t pad = 0; pad < 16; ++pad)
        trial.counts.push_back(1000 + static_cast<double>(pad) * (i % 11));
    }
    out.trials.push_back(std::move(trial));
    out.records.push_back(std::move(record));
  }
  return out;
}

RepetitionStudy study_of(const Labels& labels) {
  RepetitionStudy out;
  out.bench = BenchKind::simulated;
  out.exploration = "M1";
  out.learner = "lda";
  for (std::size_t r = 3; r < 21; r += 3) {
    const double accuracy = 1 - 1.0 / static_cast<double>(r);
    out.curve.points.push_back({r, accuracy, interval(accuracy - 0.06, accuracy + 0.03), {}});
  }
  out.curve.fabrics = labels.size();
  out.forecast.predict = 40;
  out.forecast.accuracy = 0.96;
  out.forecast.ci95 = interval(0.9, 0.99);
  out.forecast.wanted = 0.9;
  return out;
}

ExplorationResult result_of(const std::string& exploration, const Labels& labels) {
  ExplorationResult out;
  out.exploration = exploration;
  out.trials = 20 * labels.size();
  for (const auto reduction :
       {classifier::Reduction::pvalue, classifier::Reduction::pca, classifier::Reduction::all})
    out.reductions.push_back({reduction, evaluation_of(labels, 0.93)});
  out.best = BestResult{evaluation_of(labels, 0.95), 0.06};
  return out;
}

/// A page like the demo's: figures of the whole campaign, with two campaigns beside it. Without
/// results it is a page of imprints.
Document campaign_page(const Labels& labels, const std::string& rig,
                       const std::vector<ExplorationResult>& results,
                       nlohmann::ordered_json& record,
                       const std::function<void(ReportInput&)>& add) {
  const Dataset set = dataset_of(labels, rig);
  CampaignSummary run;
  run.name = "made-up";
  run.bench = set.info.kind;
  run.trials_planned = run.trials_complete = set.trials.size();
  run.virtual_s = 1000;
  run.wall_s = 4;
  run.time = {2, 1, 0.5, 0.7};
  run.force.add(0.3, 0.25);
  const std::vector<CampaignBeside> beside{{"patches", Repeated::patch, 10, results},
                                           {"pieces", Repeated::piece, 10, results}};
  ReportInput input{run, set, results, "test machine", "abc123"};
  for (const ExplorationResult& result : results) {
    Headline headline{result.exploration, "lda", "each group left out", 340, "trials",
                      {0.9, 0.85, 0.94}};
    headline.labels = labels.size();
    headline.confusion = confusion_of(labels);
    headline.confusion_unit = "trials";
    input.headlines.push_back(std::move(headline));
  }
  if (!results.empty()) input.beside = &beside;
  if (!results.empty()) input.design.blocks = design_section(study_of(labels));
  if (add) add(input);
  record = report_record(input);
  return report_document(input);
}

/// The optional parts of `weft report`.
void add_options(ReportInput& input, const std::string& fidelity_json) {
  const auto table = sim::parse_fidelity(fidelity_json);
  if (!table) throw std::runtime_error(to_string(table.error()));
  input.fidelity = fidelity_section(*table, "L1 3.072 ms").value();
  input.audit = {{"M1",
                  "confounded",
                  {},
                  {},
                  StrongestProbe{"pad pattern alone", 0.99, 0.9, 0.01, 1.0, 0.05, true},
                  199},
                 {"M2", "cannot_tell", "few", "too few mountings", {}, 199}};
}

Document evaluation_page(const Labels& labels) {
  std::vector<EvaluatedLearner> learners;
  CurvePoint few{2, 4, {}}, many{20, 4, {}};
  const std::size_t count = std::min<std::size_t>(labels.size(), 9);
  for (std::size_t i = 0; i < count; ++i) {
    learners.push_back({labels[labels.size() - 1 - i], evaluation_of(labels, 0.9), ""});
    few.values.push_back({learners.back().name, 0.6, 0.1, interval(0.5, 0.7)});
    many.values.push_back({learners.back().name, 0.99, 0.01, interval(0.9, 1)});
  }
  std::vector<GroupLeftOut> groups;
  for (const std::string& label : labels)
    groups.push_back({label, 12, std::vector<double>(count, 0.75)});
  const std::vector<CurvePoint> curve{few, many};
  return evaluation_document(
      {BenchKind::simulated, "set.h5", {{"data", "a & b"}}, 1e-4, learners, groups, curve});
}

classifier::vibro::CrossValidation scores_of(const Labels& labels) {
  classifier::vibro::CrossValidation out{confusion_of(labels), 0.7, 0.68};
  out.voted_accuracy = 0.8;
  out.voted = 60;
  out.accuracy_ci95 = interval(0.6, 0.8);
  out.f_score_ci95 = interval(0.55, 0.75);
  out.voted_ci95 = interval(0.7, 0.9);
  out.answer_s = 3e-4;
  out.train_s = 2;
  return out;
}

Result<Document> vibration_page(const Labels& labels, const std::string& exploration) {
  RecordingSet set;
  set.name = "made-up";
  set.kind = BenchKind::simulated;
  set.recordings.resize(labels.size());
  classifier::vibro::Channel channel;
  channel.name = "S";
  channel.rate_hz = 8000;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    set.recordings[i].file = std::to_string(i);
    set.recordings[i].label = labels[i];
    set.recordings[i].channels = {channel};
    set.recordings[i].samples = {std::vector<double>(10, 0.5)};
  }
  VibrationTrainingResult training{{2, 0.5, 100, 30, 5, scores_of(labels)}, {}, labels};
  double answer_s = 1e-4;
  for (const auto protocol :
       {classifier::vibro::Protocol::random, classifier::vibro::Protocol::groups})
    for (const auto learner : {classifier::Learner::lda, classifier::Learner::knn}) {
      VibroPoint point{
          learner, classifier::vibro::Family::smmrpfft, 2, "S", protocol, scores_of(labels), 1e-3};
      point.result.answer_s = answer_s *= 3;
      training.tradeoff.points.push_back(std::move(point));
    }
  training.tradeoff.honest = classifier::vibro::Protocol::groups;
  return vibration_document(exploration, set, training);
}

Result<Document> recordings_page(const Labels& labels) {
  std::vector<WindowLearner> learners;
  for (std::size_t i = 0; i < std::min<std::size_t>(4, labels.size()); ++i) {
    learners.push_back({labels[i], scores_of(labels)});
    learners.back().result.answer_s = 1e-4 * static_cast<double>(i + 1);
  }
  return vibro_document({BenchKind::simulated,
                         "set.h5",
                         "abc",
                         {{"data", "made up"}},
                         2,
                         1e-3,
                         std::move(learners),
                         "loudness 0.2\n"});
}

Result<Document> tradeoff_page(const Labels& labels) {
  TradeoffSet set{"set.h5", "abc", BenchKind::simulated, {{"trials", 40.0}}, {}, {}};
  double cost = 1e-4;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    TradeoffPoint p;
    p.name = labels[i];
    p.family = labels[i % 9 < labels.size() ? i % 9 : 0];
    p.bench = set.bench;
    p.accuracy = 0.5 + 0.45 * static_cast<double>((i * 5) % labels.size()) /
                           static_cast<double>(labels.size());
    p.ci95 = interval(p.accuracy - 0.05, p.accuracy + 0.04);
    p.answer_s = cost *= 1.1;
    p.contact_s = 1 + static_cast<double>(i % 7);
    set.points.push_back(std::move(p));
  }
  TradeoffReport report;
  report.title = "Classifier: accuracy against time";
  report.costs = classifier_costs();
  report.sets = {set};
  report.notes = {"made up"};
  return tradeoff_document(report);
}

Document sim_page(const Labels& labels) {
  SimTradeoffReport out;
  for (std::size_t s = 0; s < 2; ++s) {
    SimSceneResult scene;
    scene.scene = labels[s];
    scene.cases = 3;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      SimPoint p;
      p.setting.level = static_cast<sim::Level>(i % 4);
      p.setting.step_s = sim_sample_s / static_cast<double>(1 + i);
      p.best_s = p.median_s = 1e-3 * static_cast<double>(i + 1);
      p.total.worst_n = {0.5 / static_cast<double>(i + 1), 0.1 / static_cast<double>(i + 1)};
      p.total.pads_lsb = SimDeviation{10.0 / static_cast<double>(i + 1), 1};
      p.discretisation = p.total;
      p.front = true;
      scene.points.push_back(p);
    }
    out.scenes.push_back(std::move(scene));
  }
  return sim_document(out);
}

SweepAnalysis sweep_of(const Labels& labels) {
  SweepAnalysis out;
  out.bench = BenchKind::simulated;
  out.exploration = "M1";
  out.factors = {"force_n", "speed_mps"};
  out.fabrics = labels;
  out.replicates = 3;
  out.learner = "lda";
  const std::size_t side = std::min<std::size_t>(labels.size(), 7);
  for (std::size_t y = 0; y < side; ++y)
    for (std::size_t x = 0; x < side; ++x) {
      const auto step = static_cast<double>(x + y);
      out.cells.push_back({{1.0 + static_cast<double>(y), 0.001 * static_cast<double>(x + 1)},
                           40,
                           {3 + step, interval(2 + step, 4 + step)},
                           {0.01 * step, interval(0, 0.02 * step)},
                           {20 - step, interval(18 - step, 22 - step)}});
      classifier::design::CellSummary summary;
      summary.figures.accuracy = 0.5 + 0.03 * step;
      summary.ci95 = interval(0.45 + 0.03 * step, 0.55 + 0.03 * step);
      out.choice.cells.push_back(summary);
    }
  out.choice.front = {0, out.cells.size() - 1};
  out.choice.chosen = out.cells.size() - 1;
  return out;
}

Document imprint_page(const Labels& labels) {
  ImprintTables out;
  out.bench = BenchKind::simulated;
  out.dataset = "made-up";
  out.options.laws = true;
  out.classes = labels.size();
  out.pictures.words = "made up";
  for (std::size_t i = 0; i < 2 * labels.size(); ++i) {
    const std::string& label = labels[i / 2];
    out.files.push_back(label + "-" + std::to_string(i));
    out.labels.push_back(label);
    if (out.pictures.tiles.size() == 42) continue;
    chart::Tile tile{label + std::to_string(i), label, 32};
    for (std::size_t k = 0; k < 1024; ++k) tile.levels += "0123456789abcdef"[(k * k / 40 + i) % 16];
    out.pictures.tiles.push_back(std::move(tile));
  }
  out.imprints = out.objects = out.files.size();
  out.requested.assign(out.options.experiments.size(), out.imprints);
  for (const auto form : {classifier::imprint::Form::full, classifier::imprint::Form::brief})
    for (const auto& scales : out.options.scales) {
      FeatureSet set{scales, form, {}, {}, {}, {}};
      for (std::size_t i = 0; i < out.options.experiments.size() * out.options.rules.size(); ++i) {
        classifier::imprint::ExperimentOutcome outcome;
        outcome.converged = i % 3 != 0;
        outcome.total = out.imprints;
        outcome.correct = out.imprints - 1;
        outcome.wrong = {i % out.imprints};
        outcome.taken_for = {labels[(i + 1) % labels.size()]};
        set.outcomes.push_back(std::move(outcome));
      }
      out.sets.push_back(std::move(set));
    }
  return tables_document(out);
}

Document calibration_page(const Labels& labels) {
  calibration::CalibrationResult out;
  for (std::size_t i = 0; i < std::min<std::size_t>(labels.size(), 12); ++i) {
    out.cloths.push_back({labels[i], {}, labels[i]});
    for (const char* band : {"band_0.1", "band_0.2", "band_0.4", "band_0.8"}) {
      const double value = 0.01 * static_cast<double>(i + 1);
      out.statistics.push_back({{band, labels[i], {}, value, value},
                                value * 0.8,
                                value * 1.3,
                                value * 1.1,
                                value * 0.9,
                                true});
    }
  }
  for (const char* name : {"repetition", "control", "pattern_path", "pattern_patch"})
    out.statistics.push_back({{name, {}, {}, 0.5, 0.5}, 0.4, 0.6, 0.45, 0.55, true});
  calibration::CalibrationSource source;
  source.bench = BenchKind::real;
  return calibration::calibration_document(out, source);
}

bool write(const std::filesystem::path& folder, const std::string& kind, std::size_t classes,
           const Result<Document>& page, const nlohmann::ordered_json& record = {{"made", "up"}}) {
  const auto html = folder / (kind + "-" + std::to_string(classes) + ".html");
  const Status ok = page ? write_page(html, record, *page) : pass(page.error());
  if (!ok) std::cerr << kind << ": " << to_string(ok.error()) << '\n';
  return ok.has_value();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const std::filesystem::path folder = argv[1];
  const std::filesystem::path root = argv[2];
  const std::string rig = text_of(root / "sim/rigs/bench17.json");
  const std::string fidelity = text_of(root / "sim/fidelity.json");
  bool ok = true;
  for (const std::size_t classes : {2U, 3U, 17U, 50U}) {
    const Labels labels = make_labels(classes);
    const auto add = [&](const char* kind, const Result<Document>& page) {
      ok = write(folder, kind, classes, page) && ok;
    };
    const std::vector<ExplorationResult> results{result_of("M1", labels), result_of("M2", labels)};
    const auto add_campaign = [&](const char* kind, const std::vector<ExplorationResult>& of,
                                  const std::function<void(ReportInput&)>& more) {
      nlohmann::ordered_json record;
      const Document page = campaign_page(labels, rig, of, record, more);
      ok = write(folder, kind, classes, page, record) && ok;
    };
    add_campaign("campaign", results, {});
    add_campaign("campaign_options", results,
                 [&](ReportInput& input) { add_options(input, fidelity); });
    add_campaign("campaign_imprints", {},
                 [&](ReportInput& input) { input.documents = {imprint_page(labels)}; });
    add_campaign("campaign_vibration", results, [&](ReportInput& input) {
      for (const char* exploration : {"V1", "V2"})
        input.documents.push_back(vibration_page(labels, exploration).value());
    });
    add("evaluation", evaluation_page(labels));
    add("vibration", vibration_page(labels, "V1"));
    add("recordings", recordings_page(labels));
    add("tradeoff", tradeoff_page(labels));
    add("sim", sim_page(labels));
    add("sweep",
        design_document("Which setting", BenchKind::simulated, design_section(sweep_of(labels))));
    add("repetitions", design_document("How many repetitions", BenchKind::simulated,
                                       design_section(study_of(labels))));
    add("imprints", imprint_page(labels));
    add("calibration", calibration_page(labels));
  }
  return ok ? 0 : 1;
}
