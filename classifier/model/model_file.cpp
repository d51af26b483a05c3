#include "classifier/model/model_file.hpp"

#include <algorithm>
#include <array>
#include <istream>
#include <iterator>
#include <memory>
#include <ostream>
#include <string_view>

#include "classifier/base/line_io.hpp"
#include "classifier/base/parallel.hpp"
#include "classifier/fabric/model_text.hpp"
#include "classifier/vote/postprocessing.hpp"

namespace weft::classifier {
namespace {

constexpr std::string_view header_keyword = "weft-fabric-model ";
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

// ---- writing ----

void write_setup(LineWriter& out, const FeatureSetup& setup) {
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

// ---- reading ----

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

FeatureSetup read_setup(LineReader& in) {
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

Result<StoredModel> read_body(std::string_view body, int version) {
  LineReader in(body);
  Provenance provenance = read_provenance(in);
  FeatureSetup setup = read_setup(in);
  const LearnerHead head = read_head(in, version);
  std::vector<std::string> labels = read_labels(in);
  // Each taxel has twelve lines of names: what a short file claims costs no memory.
  if (setup.taxels > body.size() / 12)
    in.refuse("more taxels than the file has features for",
              "at most " + std::to_string(body.size() / 12), std::to_string(setup.taxels));
  if (!in.ok()) return pass(in.status().error());
  auto parts = read_model_parts(in, head, std::move(labels),
                                FeatureLayout(setup.taxels, setup.phases).names());
  in.finish();
  if (!in.ok()) return pass(in.status().error());
  return StoredModel{std::move(parts->learner), std::move(setup), std::move(provenance),
                     std::move(parts->postprocessing)};
}

struct Body {
  std::string_view text;
  int version = 0;
};

// By the first line; 0 for a version that is not known.
int version_of(std::string_view header) {
  for (const int version : {6, 5, 4, 3})
    if (header == std::string(header_keyword) + std::to_string(version)) return version;
  return 0;
}

// What follows the header.
Result<Body> after_header(std::string_view text) {
  if (!text.starts_with(header_keyword))
    return fail({.code = Errc::parse,
                 .what = "not a model file",
                 .expected = model_file_header,
                 .got = std::string(text.substr(0, std::min(text.find('\n'), std::size_t{40})))});
  if (auto ok = check_line_ends(text); !ok) return pass(ok.error());
  const std::string_view first = text.substr(0, text.find('\n'));
  const int version = version_of(first);
  if (version == 0)
    return fail({.code = Errc::unsupported,
                 .what = "a model file of another version",
                 .expected = std::string(model_file_header) + ", 5, 4 or 3",
                 .got = std::string(first.substr(0, 40)),
                 .hint = "Train the model again with this version"});
  return Body{text.substr(std::min(first.size() + 1, text.size())), version};
}

// The text between header and checksum, once both are in order.
Result<Body> body_of(std::string_view text) {
  const Result<Body> rest = after_header(text);
  if (!rest) return rest;
  const Result<std::string_view> body = check_checksum(text, text.size() - rest->text.size());
  if (!body) return pass(body.error());
  return Body{*body, rest->version};
}

// [trials x features] of trials that the model may take; one extractor a thread.
Result<Matrix> compute_features(const FeatureSetup& setup, std::span<const Trial> trials,
                                std::size_t threads) {
  for (const Trial& trial : trials)
    if (auto ok = check_trial(setup, trial); !ok) return pass(ok.error());
  Matrix out(trials.size(), FeatureLayout(setup.taxels, setup.phases).size());
  std::vector<Status> done(trials.size());
  parallel_workers(trials.size(), threads, [&] {
    auto extractor = std::make_shared<FeatureExtractor>(setup.options);
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

Status save_model(const StoredModel& stored, std::ostream& out) {
  const TrainedLearner& learner = stored.learner;
  if (learner.feature_names() != FeatureLayout(stored.setup.taxels, stored.setup.phases).names())
    return fail({.code = Errc::invalid_argument,
                 .where = "model",
                 .what = "features are not those of the taxels and phases"});
  LineWriter text;
  write_provenance(text, stored.provenance);
  write_setup(text, stored.setup);
  write_model_parts(text, learner, stored.postprocessing);
  return write_checksummed(model_file_header, text.str(), out);
}

Result<StoredModel> load_model(std::istream& in) {
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (in.bad()) return fail({.code = Errc::io, .what = "cannot read the model"});
  const Result<Body> body = body_of(text);
  if (!body) return pass(body.error());
  return read_body(body->text, body->version);
}

Result<ModelHead> load_model_head(std::string_view beginning) {
  const Result<Body> body = after_header(beginning);
  if (!body) return pass(body.error());
  LineReader in(body->text);
  ModelHead out{read_provenance(in), read_setup(in)};
  if (!in.ok()) return pass(in.status().error());
  return out;
}

Status check_trial(const FeatureSetup& setup, const Trial& trial) {
  if (trial.taxels != setup.taxels)
    return fail({.code = Errc::invalid_argument,
                 .where = trial.file,
                 .what = "the model was trained for another sensor",
                 .expected = std::to_string(setup.taxels) + " taxels",
                 .got = std::to_string(trial.taxels)});
  const PhaseSet phases = phases_of(trial);
  if (phases != setup.phases)
    return fail({.code = Errc::invalid_argument,
                 .where = trial.file,
                 .what = "the model was trained on other phases",
                 .expected = phase_letters(setup.phases),
                 .got = phase_letters(phases)});
  return {};
}

Result<std::vector<Prediction>> classify(const StoredModel& stored, std::span<const Trial> trials,
                                         const VoteOptions& options, std::size_t threads) {
  const auto features = compute_features(stored.setup, trials, threads);
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

void write_model_parts(LineWriter& out, const TrainedLearner& learner,
                       const std::optional<VotePostprocessing>& postprocessing) {
  write_head(out, {learner.kind(), learner.view().kind()});
  write_labels(out, learner.labels());
  out.count("features", learner.feature_names().size());
  for (const std::string& feature : learner.feature_names()) out.text("feature", feature);
  write_learner(out, learner);
  write_postprocessing(out, postprocessing);
}

std::optional<ModelParts> read_model_parts(LineReader& in, const LearnerHead& head,
                                           std::vector<std::string> labels,
                                           const std::vector<std::string>& expected) {
  const std::size_t columns = in.count("features", expected.size(), expected.size());
  std::vector<std::string> features = read_names(in, "feature", columns);
  const auto other = std::mismatch(features.begin(), features.end(), expected.begin());
  if (other.first != features.end())
    in.refuse("features are not those that the file describes", *other.second, *other.first);
  auto learner = read_learner(in, head, std::move(labels), std::move(features));
  if (!learner) return std::nullopt;
  const FabricModel* cores = learner->cores();
  const std::size_t sigmoids = cores != nullptr ? cores->cores().size() : 0;
  // Cores are calibrated on the features that they see, other learners by those of the trial.
  const std::size_t checked_columns = cores != nullptr ? cores->feature_names().size() : columns;
  auto postprocessing =
      read_postprocessing(in, learner->labels().size(), checked_columns, sigmoids);
  if (!in.ok()) return std::nullopt;
  return ModelParts{std::move(*learner), std::move(postprocessing)};
}

}  // namespace weft::classifier
