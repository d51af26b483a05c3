#include "daemon/apps/weft/evaluate_recordings.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {

namespace vibro = classifier::vibro;

Result<vibro::FeatureChoice> parse_feature_choice(const RecordingChoice& choice) {
  const auto family = vibro::family_from(choice.features.empty() ? "SMMRPFFT" : choice.features);
  if (!family) return pass(family.error(), "--features");
  const auto combine = vibro::combine_from(choice.combine);
  if (!combine) return pass(combine.error(), "--combine");
  return vibro::FeatureChoice{*family, *combine};
}

std::string format_outliers(double deviations, const std::map<std::string, std::size_t>& found) {
  if (deviations == 0.0) return {};
  std::vector<std::string> of_label;
  for (const auto& [label, rows] : found) of_label.push_back(label + " " + std::to_string(rows));
  return ", training windows beyond " + general(deviations) + " standard deviations left out" +
         (of_label.empty() ? "" : " (" + joined(of_label) + ")");
}

std::string format_chosen(const classifier::Recipe& recipe) {
  return std::string(classifier::to_string(recipe.learner)) +
         (recipe.features.empty() ? "" : " on " + recipe.features);
}

CLI::Option* add_outliers_option(CLI::App& command, double& outliers) {
  return add_number(command, "--outliers", outliers, 0.0, 1e6,
                    "leave out training windows with a value beyond so many standard deviations "
                    "from the mean of all; 0: none");
}

void add_recording_feature_options(LearningOptions& options, RecordingChoice& choice) {
  CLI::App& command = options.place_of("--combine");
  command.add_option(
      "--features", choice.features,
      "of sound and vibration: SMMRP, SMMRP10, FFT, SMMRPFFT, ALL (the paper's); BANDS, WIDE "
      "(ours); where none is named, best chooses, and others take SMMRPFFT");
  command.add_option("--combine", choice.combine, "figures of channels: concat, or their mean")
      ->capture_default_str();
  add_number(command, "--step-s", choice.step_s, 0.001, 1e6,
             "from one window of sound and vibration to the next");
}

void add_row_options(LearningOptions& options, RecordingChoice& choice) {
  CLI::App& command = options.place_of("--components");
  command
      .add_option("--components", choice.components,
                  "principal components, the paper's 3; 0: the features themselves")
      ->capture_default_str();
  add_outliers_option(command, choice.outliers);
}

void add_recording_options(CLI::App& command, LearningOptions& options, RecordingChoice& choice) {
  add_learners_option(command, options.name_of("--method"), choice.methods,
                      "of sound and vibration: nb, knn, tree, forest, svm, lg, nn, mlp2, xgb, "
                      "xgbrf, lda or any other learner; best (where none is named): chosen on "
                      "training windows; every: those named here, and best");
  add_keyword(command, "--protocol", choice.protocol, {"blocks", "random"},
              "blocks: contiguous parts left out; random: the paper's, which leaks");
  add_recording_feature_options(options, choice);
  add_row_options(options, choice);
  add_count(command, options.name_of("--blocks"), choice.blocks, 2, 1000,
            "contiguous parts of every recording");
  add_count(command, "--per-recording", choice.per_recording, 2, 100000, "windows at random");
  command
      .add_option("--importance", choice.importance,
                  "also weigh the features: so many permutations of each among test windows, by "
                  "the one learner or forest, and a forest's own; and train with the five that the "
                  "same selects among training windows; try --features SMMRP10")
      ->check(CLI::Range(1, 1000));
}

}  // namespace weft::daemon::cli
