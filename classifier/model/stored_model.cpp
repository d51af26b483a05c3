#include "classifier/model/stored_model.hpp"

#include <algorithm>
#include <array>
#include <memory>

#include "classifier/base/content_digest.hpp"
#include "classifier/base/parallel.hpp"

namespace weft::classifier {
namespace {

constexpr std::size_t most_taxels = 100'000;

// Words of the options, in the order of their enumerators.
constexpr std::array<std::string_view, 2> skew_names{"peaks", "signal"};
constexpr std::array<std::string_view, 2> norm_names{"l2", "rms"};
constexpr std::array<std::string_view, 2> spectrum_names{"amplitude", "magnitude"};

std::string phase_letters(PhaseSet phases) {
  std::string out;
  if (phases.rest) out += to_char(Phase::rest);
  if (phases.press) out += to_char(Phase::press);
  out += to_char(Phase::motion);
  if (phases.end) out += to_char(Phase::end);
  return out;
}

std::optional<PhaseSet> phases_from(std::string_view letters) {
  PhaseSet phases;
  for (const char c : letters) {
    const auto phase = phase_from_char(c);
    if (phase == Phase::rest) phases.rest = true;
    if (phase == Phase::press) phases.press = true;
    if (phase == Phase::end) phases.end = true;
  }
  return phase_letters(phases) == letters ? std::optional(phases) : std::nullopt;
}

// Features [trials x features] of trials with the setup of the model; one extractor per thread.
Result<Matrix> compute_features(const FeatureSetup& setup, BlockSet wanted,
                                std::span<const Trial> trials, std::size_t threads) {
  for (const Trial& trial : trials)
    if (auto ok = check_trial(setup, trial); !ok) return pass(ok.error());
  Matrix out(trials.size(), FeatureLayout(setup.taxels, setup.phases).size());
  std::vector<Status> done(trials.size());
  parallel_workers(trials.size(), threads, [&] {
    auto extractor = std::make_shared<FeatureExtractor>(setup.options, wanted);
    return [&, extractor](std::size_t i) {
      const auto features = extractor->extract(trials[i]);
      if (features) std::ranges::copy(*features, out.row(i).begin());
      if (!features) done[i] = pass(features.error());
    };
  });
  for (const Status& status : done)
    if (!status) return pass(status.error());
  return out;
}

}  // namespace

void SetupText<FeatureSetup>::write(LineWriter& out, const FeatureSetup& setup) {
  out.count("taxels", setup.taxels);
  out.text("phases", phase_letters(setup.phases));
  out.text("skew", word_in(skew_names, setup.options.skew));
  out.text("norm", word_in(norm_names, setup.options.norm));
  out.text("spectrum", word_in(spectrum_names, setup.options.spectrum));
  out.number("mode_bin_counts", setup.options.mode_bin_counts);
  out.number("window_s", setup.window_s);
  out.number("window_step_s", setup.window_step_s);
  out.number("sample_period_s", setup.sample_period_s);
  out.text("exploration", setup.exploration);
}

FeatureSetup SetupText<FeatureSetup>::read(LineReader& in) {
  FeatureSetup setup;
  setup.taxels = in.count("taxels", 1, most_taxels);
  const std::string letters = in.text("phases");
  const auto phases = phases_from(letters);
  if (!phases) in.refuse("unknown phases", "letters of SPME", letters);
  setup.phases = phases.value_or(PhaseSet{});
  setup.options.skew = static_cast<SkewOf>(word(in, "skew", skew_names));
  setup.options.norm = static_cast<Norm>(word(in, "norm", norm_names));
  setup.options.spectrum = static_cast<SpectrumScale>(word(in, "spectrum", spectrum_names));
  setup.options.mode_bin_counts = in.positive("mode_bin_counts");
  setup.window_s = in.not_negative("window_s");
  setup.window_step_s = in.not_negative("window_step_s");
  setup.sample_period_s = in.not_negative("sample_period_s");
  setup.exploration = in.text("exploration");
  return setup;
}

Result<std::vector<std::string>> SetupText<FeatureSetup>::feature_names(const FeatureSetup& setup,
                                                                        std::size_t most) {
  // Checked before a layout is made: a short file that claims many taxels must not allocate memory.
  if (setup.taxels <= most / taxel_blocks.size()) {
    const FeatureLayout layout(setup.taxels, setup.phases);
    if (layout.size() <= most) return layout.names();
  }
  return fail({.code = Errc::corrupt,
               .what = "too many taxels for the features of the file",
               .expected = "at most " + std::to_string(most) + " features",
               .got = std::to_string(setup.taxels) + " taxels of " +
                      std::to_string(taxel_blocks.size()) + " or more features each"});
}

std::uint64_t content_digest(const Trial& trial) {
  ContentDigest digest;
  digest.add(trial.taxels);
  digest.add(trial.counts);
  for (const Phase phase : trial.phase) digest.add(static_cast<std::uint64_t>(phase));
  return digest.value();
}

std::vector<std::uint64_t> content_digests(std::span<const Trial> trials) {
  std::vector<std::uint64_t> out;
  for (const Trial& trial : trials) out.push_back(content_digest(trial));
  return out;
}

Status check_trial(const FeatureSetup& setup, const Trial& trial) {
  if (trial.taxels != setup.taxels)
    return fail({.code = Errc::invalid_argument,
                 .where = trial.file,
                 .what = "model trained for another sensor",
                 .expected = std::to_string(setup.taxels) + " taxels",
                 .got = std::to_string(trial.taxels) + " taxels"});
  const PhaseSet phases = phases_of(trial);
  if (phases != setup.phases)
    return fail({.code = Errc::invalid_argument,
                 .where = trial.file,
                 .what = "model trained on other phases",
                 .expected = phase_letters(setup.phases),
                 .got = phase_letters(phases)});
  return {};
}

BlockSet used_blocks(const StoredModel& stored) {
  if (stored.postprocessing && !stored.postprocessing->profile.empty()) return BlockSet::all();
  return FeatureLayout(stored.setup.taxels, stored.setup.phases)
      .blocks_of(stored.learner.used_columns());
}

Result<std::vector<Prediction>> classify(const StoredModel& stored, std::span<const Trial> trials,
                                         const VoteOptions& options, std::size_t threads) {
  // A short-list measures distances in every column too.
  const BlockSet wanted = options.profile == nullptr ? used_blocks(stored) : BlockSet::all();
  const auto features = compute_features(stored.setup, wanted, trials, threads);
  if (!features) return pass(features.error());
  auto predicted = predict_all(stored.learner, stored.postprocessing, *features, options, threads);
  std::vector<Prediction> out;
  out.reserve(predicted.size());
  for (std::size_t i = 0; i < predicted.size(); ++i) {
    if (!predicted[i]) return pass(predicted[i].error(), trials[i].file);
    out.push_back(std::move(*predicted[i]));
  }
  return out;
}

}  // namespace weft::classifier
