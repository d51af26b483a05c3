#include "classifier/features/extract.hpp"

#include <algorithm>
#include <string>

namespace weft::classifier {
namespace {

Status check(const Trial& trial) {
  if (trial.taxels == 0)
    return fail(
        {.code = Errc::invalid_argument, .where = trial.file, .what = "trial without taxels"});
  if (trial.counts.size() != trial.samples() * trial.taxels) {
    return fail({.code = Errc::invalid_argument,
                 .where = trial.file,
                 .what = "samples and phases disagree",
                 .expected = std::to_string(trial.samples() * trial.taxels) + " values",
                 .got = std::to_string(trial.counts.size())});
  }
  const auto motion = std::count(trial.phase.begin(), trial.phase.end(), Phase::motion);
  if (auto ok = check_motion_frames(static_cast<std::size_t>(motion), trial.taxels); !ok)
    return pass(ok.error(), trial.file);
  const std::size_t bad = first_not_finite(trial.counts);
  if (bad == trial.counts.size()) return {};
  return fail({.code = Errc::invalid_argument,
               .where = trial.file + ": sample " + std::to_string(bad / trial.taxels) + ", taxel " +
                        std::to_string(bad % trial.taxels + 1),
               .what = "sample is not finite",
               .expected = "a finite count",
               .got = std::to_string(trial.counts[bad]),
               .hint = "Repair or drop the recording"});
}

}  // namespace

Result<std::span<const double>> FeatureExtractor::extract(const Trial& trial) {
  if (auto ok = check(trial); !ok) return pass(ok.error());
  if (!stream_ || stream_->taxels() != trial.taxels) stream_.emplace(trial.taxels, options_);
  stream_->restart();
  // phases come in runs: each is handed over whole
  for (std::size_t from = 0, to = 0; from < trial.samples(); from = to) {
    while (to < trial.samples() && trial.phase[to] == trial.phase[from]) ++to;
    stream_->add_checked(
        trial.phase[from],
        std::span(trial.counts).subspan(from * trial.taxels, (to - from) * trial.taxels));
  }
  auto features = stream_->features();
  if (!features) return pass(features.error(), trial.file);
  return features;
}

Result<std::vector<double>> extract(const Trial& trial, const FeatureOptions& options) {
  FeatureExtractor extractor(options);
  const auto features = extractor.extract(trial);
  if (!features) return pass(features.error());
  return std::vector<double>(features->begin(), features->end());
}

}  // namespace weft::classifier
