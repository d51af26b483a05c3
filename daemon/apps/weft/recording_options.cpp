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
                    "drop training windows beyond N standard deviations from the mean; 0: none");
}

void add_recording_feature_options(LearningOptions& options, RecordingChoice& choice) {
  CLI::App& command = options.place_of("--combine");
  command.add_option(
      "--features", choice.features,
      "use these vibration features (SMMRP, SMMRP10, FFT, SMMRPFFT, ALL, BANDS, WIDE)");
  command
      .add_option("--combine", choice.combine,
                  "combine the features of the channels (concat, mean)")
      ->capture_default_str();
  add_number(command, "--step-s", choice.step_s, 0.001, 1e6,
             "set the time from one vibration window to the next [s]");
}

void add_row_options(LearningOptions& options, RecordingChoice& choice) {
  CLI::App& command = options.place_of("--components");
  command
      .add_option("--components", choice.components,
                  "reduce the features to N principal components; 0: use all features")
      ->capture_default_str();
  add_outliers_option(command, choice.outliers);
}

void add_recording_options(CLI::App& command, LearningOptions& options, RecordingChoice& choice) {
  add_learners_option(
      command, options.name_of("--method"), choice.methods,
      "evaluate these vibration learners (comma-separated: nb, knn, svm, best, ...)");
  add_keyword(command, "--protocol", choice.protocol, {"blocks", "random"},
              "test on contiguous parts, or on random windows as the paper (which leaks)");
  add_recording_feature_options(options, choice);
  add_row_options(options, choice);
  add_count(command, options.name_of("--blocks"), choice.blocks, 2, 1000,
            "split every recording into N contiguous parts");
  add_count(command, "--per-recording", choice.per_recording, 2, 100000,
            "draw this number of random windows per recording");
  command
      .add_option("--importance", choice.importance,
                  "also measure the importance of each feature, with N permutations")
      ->check(CLI::Range(1, 1000));
}

}  // namespace weft::daemon::cli
