#include "tests/fuzz/samples.hpp"

#include "classifier/learners/tree_ensemble.hpp"
#include "classifier/vibro/cross_validation.hpp"

namespace weft::fuzz {
namespace {

using daemon::Dataset;
using daemon::TrialRecord;

constexpr std::size_t samples = 6;

classifier::Trial trial_of(std::size_t number) {
  classifier::Trial trial;
  trial.file = "trial" + std::to_string(number);
  trial.label = number == 0 ? "denim" : "silk";
  trial.group = "repetition" + std::to_string(number);
  trial.taxels = 2;
  for (std::size_t i = 0; i < samples; ++i) {
    trial.phase.push_back(i < 2 ? Phase::press : Phase::motion);
    trial.counts.push_back(static_cast<double>(1000 + 7 * i + number));
    trial.counts.push_back(static_cast<double>(2000 + (i * i * 5) % 11));
  }
  return trial;
}

TrialRecord record_of(const classifier::Trial& trial, std::size_t number) {
  TrialRecord record;
  record.spec.index = static_cast<std::uint32_t>(number);
  record.spec.label = trial.label;
  record.spec.group = trial.group;
  record.spec.exploration = "M1";
  record.quality.force_rms_error_n = 0.05;
  for (std::size_t i = 0; i < samples; ++i) {
    record.t_ns.push_back(static_cast<std::int64_t>(i) * 27'027'027);
    record.device_us.push_back(static_cast<std::uint32_t>(i) * 27'027);
  }
  for (std::size_t i = 0; i < 2; ++i) {
    record.wrench.t_ns.push_back(static_cast<std::int64_t>(i) * 10'000'000);
    record.stages.t_ns.push_back(static_cast<std::int64_t>(i) * 50'000'000);
    record.wrench.quanta.insert(record.wrench.quanta.end(), {1, -2, 5'000'000, 3, 4, -5});
    record.stages.quanta.insert(record.stages.quanta.end(), {75'000'000, -1000});
  }
  return record;
}

}  // namespace

Dataset sample_dataset() {
  Dataset dataset;
  dataset.info.kind = daemon::BenchKind::simulated;
  dataset.info.name = "fuzz";
  dataset.info.source = "campaign";
  dataset.info.recipe_json = "{}";
  dataset.info.rig_json = "{}";
  dataset.info.taxel_rate_hz = 37;
  dataset.info.wrench_rate_hz = 100;
  dataset.info.stage_rate_hz = 20;
  dataset.info.axes = {{"x", false}, {"rx", true}};
  dataset.info.devices = {{"taxels", "taxel_array", "{}"}};
  for (std::size_t number = 0; number < 2; ++number) {
    dataset.trials.push_back(trial_of(number));
    dataset.records.push_back(record_of(dataset.trials.back(), number));
  }
  return dataset;
}

daemon::RecordingSet sample_recordings() {
  daemon::RecordingSet set{"fuzz", "recordings", daemon::BenchKind::simulated, {}};
  for (std::size_t number = 0; number < 3; ++number) {
    classifier::vibro::Recording r{"recording" + std::to_string(number),
                                   number < 2 ? "felt" : "foil",
                                   std::to_string(number),
                                   {{"S", 8000.0, "Pa"}, {"X", 200.0, "m/s2"}},
                                   {{}, {}}};
    for (std::size_t i = 0; i < 8 + number; ++i)
      r.samples[0].push_back(0.25 * static_cast<double>((i * 5) % 7) - 0.5);
    for (std::size_t i = 0; i < 2 + number; ++i)
      r.samples[1].push_back(9.81 + 0.5 * static_cast<double>(i));
    set.recordings.push_back(std::move(r));
  }
  return set;
}

namespace {

// A thousand trees would exceed an input of the fuzzer. One row is in two classes, so that a leaf
// is not pure.
Result<classifier::TrainedLearner> two_trees_of(const classifier::TrainedLearner& trained,
                                                const classifier::FeatureMatrix& matrix) {
  classifier::Matrix rows = matrix.values;
  std::copy(rows.row(0).begin(), rows.row(0).end(), rows.row(1).begin());
  std::vector<std::size_t> of_row;
  for (std::size_t r = 0; r < rows.rows(); ++r) of_row.push_back(r % trained.labels().size());
  auto trees = classifier::fit_extra_trees(rows, of_row, trained.labels().size(), {}, 2);
  if (!trees) return pass(trees.error());
  return classifier::TrainedLearner(classifier::Learner::trees, trained.labels(),
                                    trained.feature_names(), {},
                                    std::make_shared<classifier::TreeEnsemble>(std::move(*trees)));
}

}  // namespace

Result<classifier::StoredModel> sample_model(classifier::Learner learner, classifier::View view) {
  classifier::FeatureSetup setup;
  setup.taxels = 1;
  setup.phases.press = true;
  setup.exploration = "M1";
  classifier::FeatureMatrix matrix;
  matrix.names = classifier::FeatureLayout(setup.taxels, setup.phases).names();
  const std::size_t rows = 9;
  matrix.values = classifier::Matrix(rows, matrix.names.size());
  for (std::size_t r = 0; r < rows; ++r) {
    matrix.labels.push_back(std::string(1, static_cast<char>('a' + r % 3)));
    matrix.groups.emplace_back();
    matrix.files.push_back("trial" + std::to_string(r));
    for (std::size_t c = 0; c < matrix.names.size(); ++c)
      matrix.values(r, c) =
          static_cast<double>((r % 3) * (c + 1)) + 0.1 * static_cast<double>((7 * r + 3 * c) % 5);
  }
  classifier::TrainOptions options;
  options.cap = 3;
  options.threads = 1;
  auto trained = classifier::train_recipe(matrix, {learner, options.cap, view}, options);
  if (!trained) return pass(trained.error());
  auto postprocessing = classifier::fit_postprocessing(*trained, matrix, options);
  if (!postprocessing) return pass(postprocessing.error());
  if (learner == classifier::Learner::trees) trained = two_trees_of(*trained, matrix);
  if (!trained) return pass(trained.error());
  return classifier::StoredModel{
      std::move(*trained), setup, {"simulated", "", "0", "fuzz"}, std::move(*postprocessing)};
}

Result<classifier::imprint::ImprintModel> sample_imprint_model(classifier::Learner learner) {
  using namespace classifier::imprint;
  const TaxelGrid grid{6, 8, 1e-3, 7};
  std::vector<Imprint> imprints;
  for (std::size_t i = 0; i < 9; ++i) {
    Imprint one{Image(grid.rows, grid.cols),
                "imprint" + std::to_string(i),
                std::string(1, static_cast<char>('a' + i % 3)),
                {}};
    one.object = one.label + std::to_string(i / 3);
    for (std::size_t k = 0; k < grid.rows * grid.cols; ++k)
      one.image.data()[k] = static_cast<double>((k * (1 + i % 3) * 13 + 5 * i) % 128);
    imprints.push_back(std::move(one));
  }
  FeaturePlan plan{ScaleOptions{}, {LawsSize::three}};
  plan.scales->sigmas = {0.0, 1.0};
  plan.scales->form = Form::brief;
  const auto matrix = build_matrix(imprints, plan, 1);
  if (!matrix) return pass(matrix.error());
  classifier::TrainOptions options;
  options.cap = 3;
  options.threads = 1;
  auto trained = classifier::train_learner(*matrix, learner, options);
  if (!trained) return pass(trained.error());
  auto postprocessing = classifier::fit_postprocessing(trained->trained, *matrix, options);
  if (!postprocessing) return pass(postprocessing.error());
  return ImprintModel{std::move(trained->trained),
                      {grid, plan},
                      {"simulated", "", "0", "fuzz"},
                      std::move(*postprocessing),
                      content_digests(imprints)};
}

Result<classifier::vibro::RecordingModel> sample_recording_model(classifier::Learner learner) {
  using namespace classifier::vibro;
  std::vector<Recording> recordings;
  for (std::size_t i = 0; i < 4; ++i) {
    Recording r{"recording" + std::to_string(i),
                i % 2 == 0 ? "felt" : "foil",
                std::to_string(i),
                {{"X", 200.0, "m/s2"}},
                {{}}};
    for (std::size_t k = 0; k < 60; ++k)
      r.samples[0].push_back(static_cast<double>((k * (2 + 3 * (i % 2)) + i) % 11));
    recordings.push_back(std::move(r));
  }
  RecordingSetup setup;
  setup.features = {Family::smmrpfft, Combine::concat};
  setup.window_s = setup.step_s = 0.1;
  classifier::TrainOptions options;
  options.trees = 2;
  options.threads = 1;
  return train_recording_model(recordings, setup, window_recipe(learner, 2), options,
                               {"simulated", "", "0", "fuzz"});
}

Result<classifier::StagedModel> sample_live_model() {
  std::vector<classifier::Trial> slides;
  for (std::size_t n = 0; n < 9; ++n) {
    classifier::Trial& slide = slides.emplace_back();
    slide.file = std::to_string(n).insert(0, "slide");
    slide.label = std::string(1, static_cast<char>('a' + n % 3));
    slide.taxels = 1;
    for (std::size_t i = 0; i < 14; ++i) {
      slide.phase.push_back(i < 2 ? Phase::press : Phase::motion);
      slide.counts.push_back(static_cast<double>(100 * (n % 3) + (i * (n + 5)) % 13));
    }
  }
  classifier::StagedOptions options;
  options.learner = classifier::Learner::lda;
  options.training.threads = 1;
  options.exploration = "M1";
  options.provenance = {"simulated", "", "0", "fuzz"};
  return classifier::train_staged(slides, 10.0, options);
}

}  // namespace weft::fuzz
